"""The diagnosis task: what may be measured at what price, and what the machine may suffer from."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.build import from_mapping
from indexer_env.checks import check_number
from indexer_env.errors import ParameterError, refuse
from indexer_env.fault_law import FaultLaw, fault_law
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint

TURNS = 2
"""Table turns of a measurement: one until the start's transient is gone, one that is recorded."""

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
    if isinstance(given, tuple) and all(isinstance(pair, tuple) and len(pair) == 2 for pair in given):
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
        for field in ("crack_at", "loose_at", "backlash_per_joule"):
            if any(value > 0.0 for value in getattr(made, field).extremes):
                rule = "0, as a fault does not change during a diagnosis"
                raise refuse(f"DiagnosisTask.hypotheses.{name}", field, rule, getattr(made, field).extremes)
        found.append((name, made))
    return tuple(found)
