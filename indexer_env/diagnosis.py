"""What an episode of the diagnosis task hides, and what a turn shows of it: pure functions of one machine or of many.

`diagnosis_env` is the Gymnasium environment around them.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import operator
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from indexer_env.coefficients import Coefficients, Pack, coefficients, pack
from indexer_env.control import speed_kept
from indexer_env.diagnosis_task import DiagnosisTask, Setting
from indexer_env.engine import advance, cores, prepare_kernel
from indexer_env.errors import ParameterError, SimulationError, refuse
from indexer_env.faults import Faults
from indexer_env.kernels import layout
from indexer_env.kernels.layout import LANES
from indexer_env.machine import Machine
from indexer_env.modes import largest_steps
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.spectrum import density, level
from indexer_env.turns import LEAST_SPEED
from indexer_env.variation import varied

SAMPLE_RATE = 1000.0
"""Of a record [Hz], as on the paper's bench (section 5.1)."""

BANDS, BAND_HZ = 25, 4
"""Bands of the spectrum that is observed, and their width [Hz]: 1 to 4 Hz, 5 to 8 Hz, ... 97 to 100 Hz."""

LEVELS = (-70.0, 30.0)
"""Level of a band [dB over 1 (unit of the reading)²/Hz] that is observed as -1 and as 1; what lies beyond is clipped.
The bench's noise stands at -54 dB, its strongest band at about +10 dB."""

_ROWS = np.array([layout.TABLE_ACC], dtype=np.int64)

WARMUP = 0.5
"""Share of a turn that is simulated before a record: at 1.3 of nominal speed nine time constants of the reference
machine's slowest mode, after which 2e-4 is left of the start's transient."""

MOST_STEPS = 4
"""Integrator steps in a sampling interval that a hypothesis may ask for; 4 resolve a housing at 150 Hz."""

SHORTEST_TURN, LONGEST_TURN = 1.0, 600.0
"""Bounds of a turn's time [s]: a window of the spectrum, and what a record may hold."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """What a turn shows: the record, and its spectrum as it is observed, (BANDS,) in [-1, 1]."""

    record: Signal
    levels: np.ndarray


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
            faults = Faults(**{field: values[min(place, len(values) - 1)] for field, values in ends.items()})
            faulty = _faulty(name, machine, faults)
            try:
                steps = _steps([coefficients(faulty, OperatingPoint())])[0]
            except ParameterError as error:
                raise ParameterError(f"diagnosis.hypotheses.{name}: {error}") from None
            if steps > MOST_STEPS:
                rule = (
                    f"such that a step of {1e3 / (MOST_STEPS * SAMPLE_RATE):g} ms resolves the machine's fastest mode"
                )
                loose = faults.screw_looseness > 0.0
                mend = "make loose screws looser or tight" if loose else "soften its stiffest joint"
                remedy = f"it needs {1e3 / (steps * SAMPLE_RATE):.2g} ms, so {mend}"
                raise refuse("diagnosis.hypotheses", name, rule, faults, remedy)


def _faulty(name: str, machine: Machine, faults: Faults) -> Machine:
    """The machine with the faults of a hypothesis, if it can have them."""
    try:
        return faults.applied_to(machine)
    except ParameterError as error:
        raise ParameterError(f"diagnosis.hypotheses.{name}: {error}") from None


def measure(
    cases: Sequence[Case],
    settings: Sequence[Setting],
    operating_point: OperatingPoint,
    sensor: Sensor,
    rngs: Sequence[np.random.Generator],
    numbers: Sequence[int] | None = None,
) -> list[Measurement]:
    """One turn of each case at its setting, read by the sensor; case i takes from generator i, and from nothing else.

    The record starts at a cam angle drawn uniformly over the table's turn, for a bench has no mark; then the noise is
    drawn. Of the turn before it WARMUP is simulated, from motion on the law. The integrator's step is the longest part
    of a sampling interval that resolves the machine's fastest mode.

    Raises
    ------
    SimulationError
        A machine that leaves the model's range at its setting; the sentence calls case i by `numbers[i]`, or by i.
    """
    points = [
        _point(case, setting, operating_point, rng) for case, setting, rng in zip(cases, settings, rngs, strict=True)
    ]
    lengths = [
        round(case.machine.turn_duration(point) * SAMPLE_RATE) for case, point in zip(cases, points, strict=True)
    ]
    items = [
        coefficients(case.machine, OperatingPoint(load_torque=point.load_torque))
        for case, point in zip(cases, points, strict=True)
    ]
    parts = _steps(items)
    found: dict[int, Measurement] = {}

    def run(members: list[int]) -> None:
        """Simulate a block and read it while its records are still in the cache."""
        chosen = _packed([items[i] for i in members], [points[i] for i in members])
        every, n = parts[members[0]], np.array([lengths[i] + round(WARMUP * lengths[i]) for i in members])
        out, status, when = advance(
            chosen, n * every, np.full(len(n), 1.0 / (SAMPLE_RATE * every)), np.zeros(len(n)),
            every=every, rows=_ROWS, samples=int(n.max()),
        )  # fmt: skip
        for row, i in enumerate(members):
            if status[row] != layout.RUNNING:
                which = i if numbers is None else numbers[i]
                raise SimulationError(
                    f"{cases[i].machine.name} (item {which}) left the model's range at a speed of "
                    f"{settings[i].speed:g} of nominal under a brake of {settings[i].brake:g} N m, "
                    f"at t = {when[row]:.4g} s."
                )
        rows = range(len(members))
        for length, alike in itertools.groupby(rows, key=lambda row: lengths[members[row]]):
            some = list(alike)
            turns = out[some, 0, n[some[0]] - length : n[some[0]]]
            read = _read(turns, sensor, [rngs[members[row]] for row in some])
            found.update(zip((members[row] for row in some), read, strict=True))

    blocks = list(_blocks(items, parts, lengths))
    if blocks:
        prepare_kernel()
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(run, blocks))
    return [found[i] for i in range(len(cases))]


def _packed(items: Sequence[Coefficients], points: Sequence[OperatingPoint]) -> Pack:
    """Items of one model; what else some of them have acts in the others at its null value, which changes no bit."""
    features = functools.reduce(operator.or_, (item.features for item in items))
    return dataclasses.replace(pack(items, points), features=features)


def _blocks(items: Sequence[Coefficients], parts: Sequence[int], lengths: Sequence[int]) -> Iterator[list[int]]:
    """Items of the same model and step, in blocks of the kernel's lanes, which cost as much half empty as full and run
    as long as their longest."""
    order = sorted(range(len(items)), key=lambda i: (items[i].model, parts[i], -lengths[i]))
    for _, members in itertools.groupby(order, key=lambda i: (items[i].model, parts[i])):
        kind = list(members)
        for first in range(0, len(kind), int(LANES)):
            yield kind[first : first + int(LANES)]


def _steps(items: Sequence[Coefficients]) -> list[int]:
    """Integrator steps in a sampling interval, for each of some machines."""
    found = np.zeros(len(items))
    for model in {item.model for item in items}:
        members = [place for place, item in enumerate(items) if item.model == model]
        found[members] = np.ceil(1.0 / (SAMPLE_RATE * largest_steps([items[place] for place in members])) - 1e-9)
    return np.maximum(found, 1.0).astype(int).tolist()


def _read(accelerations: np.ndarray, sensor: Sensor, rngs: Sequence[np.random.Generator]) -> list[Measurement]:
    """What the sensor makes of accelerations (n, samples) [rad/s²]."""
    readings, rate = sensor.read_batch(accelerations, SAMPLE_RATE, rngs), sensor.record_rate(SAMPLE_RATE)
    return [
        Measurement(Signal(values, rate, unit=sensor.unit, source="simulated sensor"), levels)
        for values, levels in zip(readings, band_levels(readings, rate), strict=True)
    ]


def _point(case: Case, setting: Setting, nominal: OperatingPoint, rng: np.random.Generator) -> OperatingPoint:
    return dataclasses.replace(
        nominal,
        motor_speed=setting.speed * nominal.motor_speed,
        load_torque=nominal.load_torque + setting.brake,
        start_angle=2.0 * math.pi * case.machine.stations * float(rng.random()),
    )


def band_levels(records: np.ndarray, sample_rate: float) -> np.ndarray:
    """The spectra of records (n, samples) as they are observed, (n, BANDS) in [-1, 1]: mean density of each band, as a
    level in dB, -1 and 1 at LEVELS. A row does not depend on the others."""
    lines = density(records, sample_rate, BANDS * BAND_HZ + 1)[:, 1:]
    low, high = LEVELS
    levels = level(lines.reshape(-1, BANDS, BAND_HZ).mean(axis=2), LEVELS)
    return (2.0 * levels - low - high) / (high - low)


def check_bench(task: DiagnosisTask, machine: Machine, operating_point: OperatingPoint, sensor: Sensor) -> None:
    """Refuse what cannot be measured: turns too short for a spectrum or endless, records too coarse for its bands."""
    for speed in task.speeds:
        turn = machine.turn_duration(operating_point) / speed
        if not SHORTEST_TURN <= turn <= LONGEST_TURN:
            rule = f"such that a turn takes {SHORTEST_TURN:g} to {LONGEST_TURN:g} s"
            raise refuse("IndexerDiagnosisEnv", "operating_point", rule, f"{turn:.3g} s at {speed:g} of its speed")
    for setting in task.settings:
        torque = abs(operating_point.load_torque + setting.brake)
        share = speed_kept(machine, torque, setting.speed * operating_point.motor_speed)
        if share < LEAST_SPEED:
            rule = f"one that keeps {LEAST_SPEED:.0%} of the commanded speed at each setting"
            got = f"{machine.name} with {share:.0%} at {setting.speed:g} of nominal speed under {setting.brake:g} N m"
            raise refuse("IndexerDiagnosisEnv", "machine", rule, got, "lower the brakes or drive.slip's compliance")
    sensor.sections(SAMPLE_RATE)
    rate = sensor.record_rate(SAMPLE_RATE)
    if rate != round(rate) or rate < 2 * BANDS * BAND_HZ:
        rule = f"a whole number of Hz and >= {2 * BANDS * BAND_HZ} Hz, twice the highest band"
        raise refuse("IndexerDiagnosisEnv.sensor", "sample_rate", rule, rate)
