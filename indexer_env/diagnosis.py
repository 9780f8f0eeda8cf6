"""The diagnosis task: what may be measured at what price, what the machine may suffer from, and what a turn shows.

Pure functions of one machine or of many; `diagnosis_env` is the Gymnasium environment around them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.build import from_mapping
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import ParameterError, SimulationError, refuse
from indexer_env.fault_law import FaultLaw, fault_law
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.simulate import simulate_batch
from indexer_env.spectrum import density, level
from indexer_env.wrappers import varied

SAMPLE_RATE = 1000.0
"""Of a record [Hz], as on the paper's bench (paper.txt, section 5.1)."""

TURNS = 2
"""Table turns of a measurement: one until the start's transient is gone, one that is recorded."""

BANDS, BAND_HZ = 25, 4
"""Bands of the spectrum that is observed, and their width [Hz]: 1 to 4 Hz, 5 to 8 Hz, ... 97 to 100 Hz."""

LEVELS = (-70.0, 30.0)
"""Level of a band [dB over 1 (unit of the reading)²/Hz] that is observed as -1 and as 1; what lies beyond is clipped.
The bench's noise stands at -54 dB, the index of a loaded machine at +15 dB."""

HIGHEST_SPEED = 1.5
"""Largest share of the nominal motor speed, as the largest `ControlTask.highest_share`."""


@dataclass(frozen=True)
class Setting:
    """How one turn is run: motor speed [share of nominal] and brake torque on the table [N m]."""

    speed: float
    brake: float


@dataclass(frozen=True)
class DiagnosisTask:
    """What may be measured and named, and what it costs; YAML in `conf/diagnosis`.

    Attributes
    ----------
    speeds : tuple of float
        Motor speeds that a turn may be run at [share of nominal], each in [0.1, 1.5].
    brakes : tuple of float
        Brake torques that it may be run under [N m], added to the load, each in [0, 500].
    hypotheses : mapping of str to FaultLaw
        The names and the law of each; a mapping as `fault_law` takes it is one too. Each name is as likely.
    machine_spread : float
        Half width w of `varied` [-], 0 to 0.5: stiffness and damping of joints 1 and 2 differ from machine to machine.
    budget : float
        What the measurements of an episode may cost in all [reward], > 0.
    time_price : float
        [reward per s of machine time], > 0: an episode ends.
    brake_price : float
        [reward per kJ of work against the brake], >= 0.
    right, wrong : float
        Reward for the right name, loss for a wrong one or none, >= 0.
    """

    speeds: tuple[float, ...]
    brakes: tuple[float, ...]
    hypotheses: tuple[tuple[str, FaultLaw], ...]
    machine_spread: float = 0.1
    budget: float = 0.6
    time_price: float = 0.004
    brake_price: float = 0.01
    right: float = 1.0
    wrong: float = 1.0

    def __post_init__(self) -> None:
        self._check_grid("speeds", "of nominal speed", 0.1, HIGHEST_SPEED)
        self._check_grid("brakes", "N m", 0.0, 500.0)
        object.__setattr__(self, "hypotheses", _hypotheses(self.hypotheses))
        check_number("DiagnosisTask", "machine_spread", self.machine_spread, low=0.0, high=0.5)
        check_number("DiagnosisTask", "budget", self.budget, low=0.0, low_open=True, unit="reward")
        check_number("DiagnosisTask", "time_price", self.time_price, low=0.0, low_open=True, unit="reward per s")
        check_number("DiagnosisTask", "brake_price", self.brake_price, low=0.0, unit="reward per kJ")
        check_number("DiagnosisTask", "right", self.right, low=0.0, unit="reward")
        check_number("DiagnosisTask", "wrong", self.wrong, low=0.0, unit="reward")

    def _check_grid(self, name: str, unit: str, low: float, high: float) -> None:
        values = getattr(self, name)
        if not isinstance(values, list | tuple) or not values:
            raise refuse("DiagnosisTask", name, "a list of at least one number", values)
        for value in values:
            check_number("DiagnosisTask", name, value, low=low, high=high, unit=unit)
        if len(set(values)) < len(values):
            raise refuse("DiagnosisTask", name, "a list of different numbers", values)
        object.__setattr__(self, name, tuple(float(value) for value in values))

    @property
    def settings(self) -> tuple[Setting, ...]:
        """The settings of a turn, one per measuring action: every brake of the first speed, then the next speed."""
        return tuple(Setting(*pair) for pair in itertools.product(self.speeds, self.brakes))

    @property
    def names(self) -> tuple[str, ...]:
        """The names, one per naming action."""
        return tuple(name for name, _ in self.hypotheses)

    @property
    def laws(self) -> tuple[FaultLaw, ...]:
        """The law of each name."""
        return tuple(law for _, law in self.hypotheses)

    def costs(self, machine: Machine, operating_point: OperatingPoint) -> np.ndarray:
        """Cost of a measurement at each setting (k,) [reward].

            c = TURNS (p_t T / s + p_b 2π B / 1000)

        with the time T [s] of a table turn at nominal speed, the speed s [share], the brake torque B [N m] and the
        prices p_t [1/s] and p_b [1/kJ].
        """
        turn = machine.turn_duration(operating_point)
        return np.array([
            TURNS * (self.time_price * turn / s.speed + self.brake_price * 2.0e-3 * math.pi * s.brake)
            for s in self.settings
        ])  # fmt: skip


def task_from_mapping(mapping: Mapping[str, Any]) -> DiagnosisTask:
    """The task from a mapping of its fields (YAML); raises ParameterError."""
    return from_mapping(DiagnosisTask, mapping, owner="diagnosis")


def _hypotheses(given: object) -> tuple[tuple[str, FaultLaw], ...]:
    rule = "a mapping of at least two names to the laws of their faults"
    if isinstance(given, tuple):
        given = dict(given)
    if not isinstance(given, Mapping) or len(given) < 2:
        raise refuse("DiagnosisTask", "hypotheses", rule, given)
    found = []
    for name, law in given.items():
        if not isinstance(name, str) or not name:
            raise refuse("DiagnosisTask", "hypotheses", rule, name, "put the name in quotes")
        if not isinstance(law, Mapping | FaultLaw):
            raise refuse("DiagnosisTask.hypotheses", name, "a mapping of faults to their laws", law)
        try:
            made = fault_law(law)
        except ParameterError as error:
            raise ParameterError(f"DiagnosisTask.hypotheses.{name}: {error}") from None
        for field in ("crack_at", "loose_at", "wear"):
            if any(value > 0.0 for value in getattr(made, field).extremes):
                rule = "0, as a fault does not change during a diagnosis"
                raise refuse(f"DiagnosisTask.hypotheses.{name}", field, rule, getattr(made, field).extremes)
        found.append((name, made))
    return tuple(found)


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
    """The case of an episode: its name (uniform) unless given, its machine (`varied`) and its faults, in that order."""
    if name is None:
        name = int(rng.integers(len(task.names)))
    own = varied(machine, task.machine_spread, rng)
    faults = task.laws[name].draw(rng).faults
    return Case(name, faults, faults.applied_to(own))


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
    ParameterError, SimulationError
        A machine that cannot be run at the setting.
    """
    points = [_point(case, *rest) for case, *rest in zip(cases, settings, [operating_point] * len(cases), rngs, strict=True)]
    records: dict[int, Signal] = {}
    for speed in dict.fromkeys(setting.speed for setting in settings):
        members = [i for i, setting in enumerate(settings) if setting.speed == speed]
        turn = cases[members[0]].machine.turn_duration(points[members[0]])
        run = Run(sample_rate=SAMPLE_RATE, samples=round(turn * SAMPLE_RATE), warmup_turns=TURNS - 1)
        batch = simulate_batch([cases[i].machine for i in members], [points[i] for i in members], run)
        for row, reason in batch.rejected.items():
            raise SimulationError(reason)
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


def check_action(action: object, count: int) -> int:
    """The action as an int, or one sentence on what is wrong with it."""
    if type(action) is np.ndarray and action.shape == ():
        action = action.item()
    check_integer("IndexerDiagnosisEnv", "action", action, low=0, high=count - 1)
    return int(action)  # type: ignore[call-overload]
