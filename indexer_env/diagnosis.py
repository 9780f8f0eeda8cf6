"""What an episode of the diagnosis task hides, and what a turn shows of it: pure functions of one machine or of many.

`diagnosis_env` is the Gymnasium environment around them.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.coefficients import coefficients
from indexer_env.diagnosis_task import TURNS, DiagnosisTask, Setting
from indexer_env.errors import ParameterError, SimulationError, refuse
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.modes import FINEST_STEP, largest_steps
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.simulate import simulate_batch
from indexer_env.spectrum import density, level
from indexer_env.wrappers import varied

SAMPLE_RATE = 1000.0
"""Of a record [Hz], as on the paper's bench (paper.txt, section 5.1)."""

BANDS, BAND_HZ = 25, 4
"""Bands of the spectrum that is observed, and their width [Hz]: 1 to 4 Hz, 5 to 8 Hz, ... 97 to 100 Hz."""

LEVELS = (-70.0, 30.0)
"""Level of a band [dB over 1 (unit of the reading)²/Hz] that is observed as -1 and as 1; what lies beyond is clipped.
The bench's noise stands at -54 dB, its strongest band at about +10 dB."""

SHORTEST_TURN, LONGEST_TURN = 1.0, 600.0
"""Bounds of a turn's time [s]: a window of the spectrum, and what a record may hold."""


@dataclass(frozen=True)
class Case:
    """What an episode hides.

    Attributes
    ----------
    name : int
        Place of its hypothesis in `DiagnosisTask.names`.
    faults : Faults
    machine : Machine
        One of its own, the faults in it.
    """

    name: int
    faults: Faults
    machine: Machine


def draw_case(task: DiagnosisTask, machine: Machine, rng: np.random.Generator, name: int | None = None) -> Case:
    """The case of an episode: its name (uniform) unless given, its machine (`varied`) and its faults, in that order.

    Raises
    ------
    ParameterError
        Faults that the machine cannot have.
    """
    if name is None:
        name = int(rng.integers(len(task.names)))
    own = varied(machine, task.machine_spread, rng)
    faults = task.laws[name].draw(rng).faults
    return Case(name, faults, _faulty(task.names[name], own, faults))


def check_hypotheses(task: DiagnosisTask, machine: Machine) -> None:
    """Refuse a task whose laws draw at their ends what the machine cannot have; raises ParameterError."""
    for name, law in task.hypotheses:
        ends = {field.name: getattr(law, field.name).extremes for field in dataclasses.fields(Faults)}
        for place in range(max(len(values) for values in ends.values())):
            chosen = {field: values[min(place, len(values) - 1)] for field, values in ends.items()}
            _faulty(name, machine, Faults(**chosen))


def _faulty(name: str, machine: Machine, faults: Faults) -> Machine:
    """The machine with the faults of a hypothesis, if it can have them."""
    try:
        faulty = faults.applied_to(machine)
        largest = float(largest_steps([coefficients(faulty, OperatingPoint())])[0])
    except ParameterError as error:
        raise ParameterError(f"diagnosis.hypotheses.{name}: {error}") from None
    if largest < FINEST_STEP:
        rule = f"such that a step of {1e3 * FINEST_STEP:g} ms resolves the machine's fastest mode"
        remedy = f"it needs {1e3 * largest:.2g} ms, so make loose screws looser or tight"
        raise refuse("diagnosis.hypotheses", name, rule, faults, remedy)
    return faulty


def measure(
    cases: Sequence[Case],
    settings: Sequence[Setting],
    operating_point: OperatingPoint,
    sensor: Sensor,
    rngs: Sequence[np.random.Generator],
) -> list[Signal]:
    """One turn of each case at its setting, read by the sensor; case i takes from generator i, and from nothing else.

    The record starts at a cam angle drawn uniformly over the table's turn, for a bench has no mark; then the noise is
    drawn. A turn is run before it, from motion on the law.

    Raises
    ------
    SimulationError
        A machine that leaves the model's range at its setting.
    """
    points = [
        _point(case, setting, operating_point, rng) for case, setting, rng in zip(cases, settings, rngs, strict=True)
    ]
    lengths = [
        round(case.machine.turn_duration(point) * SAMPLE_RATE) for case, point in zip(cases, points, strict=True)
    ]
    records: dict[int, Signal] = {}
    for length in dict.fromkeys(lengths):
        members = [i for i in range(len(cases)) if lengths[i] == length]
        run = Run(sample_rate=SAMPLE_RATE, samples=length, warmup_turns=TURNS - 1)
        batch = simulate_batch([cases[i].machine for i in members], [points[i] for i in members], run)
        if batch.rejected:
            raise SimulationError(next(iter(batch.rejected.values())))
        for row, i in enumerate(members):
            records[i] = sensor.read(batch.table_acceleration[row], SAMPLE_RATE, rngs[i])
    return [records[i] for i in range(len(cases))]


def _point(case: Case, setting: Setting, nominal: OperatingPoint, rng: np.random.Generator) -> OperatingPoint:
    return dataclasses.replace(
        nominal,
        motor_speed=setting.speed * nominal.motor_speed,
        load_torque=nominal.load_torque + setting.brake,
        start_angle=2.0 * math.pi * case.machine.stations * float(rng.random()),
    )


def band_levels(record: Signal) -> np.ndarray:
    """The spectrum of a record as it is observed, (BANDS,) in [-1, 1]: mean density of each band, as a level in dB, -1
    and 1 at LEVELS."""
    lines = density(record.values, record.sample_rate, BANDS * BAND_HZ + 1)[1:]
    low, high = LEVELS
    levels = level(lines.reshape(BANDS, BAND_HZ).mean(axis=1), LEVELS)
    return (2.0 * levels - low - high) / (high - low)


def check_bench(task: DiagnosisTask, machine: Machine, operating_point: OperatingPoint, sensor: Sensor) -> None:
    """Refuse what cannot be measured: turns too short for a spectrum or endless, records too coarse for its bands."""
    for speed in task.speeds:
        turn = machine.turn_duration(operating_point) / speed
        if not SHORTEST_TURN <= turn <= LONGEST_TURN:
            rule = f"such that a turn takes {SHORTEST_TURN:g} to {LONGEST_TURN:g} s"
            raise refuse("IndexerDiagnosisEnv", "operating_point", rule, f"{turn:.3g} s at {speed:g} of its speed")
    sensor.sections(SAMPLE_RATE)
    rate = sensor.record_rate(SAMPLE_RATE)
    if rate != round(rate) or rate < 2 * BANDS * BAND_HZ:
        rule = f"a whole number of Hz and >= {2 * BANDS * BAND_HZ} Hz, twice the highest band"
        raise refuse("IndexerDiagnosisEnv.sensor", "sample_rate", rule, rate)
