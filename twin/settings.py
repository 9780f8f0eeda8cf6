"""What a twin is made with, as conf/twin.yaml has it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from classifier.tasks.conformal import least_records
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from twin.faults import FAULTS, chosen

_HEALTHY_SHARE = 1.0 / 8.0
"""Healthy turns for the thresholds, as share of the records that the networks learn from."""

_RUN = 0.95
"""Share of the machines drawn that is sure to run."""


@dataclass(frozen=True)
class Settings:
    """Settings of a twin.

    Attributes
    ----------
    faults : sequence of str
        Of the fault table.
    motor_speed_rpm, load_torque : sequence of two numbers or None
        Range of operating points at which diagnosis is wanted [rpm, N m]; None: that of the healthy records.
    simulated : int
        Simulated turns that the networks learn from.
    draws : int
        Machines drawn from the posterior.
    epochs : int
        Times that the networks see each record.
    false_alarms : float
        Share of healthy turns that may be called faulty [-].
    power : float
        Share of faulty turns of the stated smallest size that are to be noticed [-].
    coverage : float
        Of the intervals of sizes [-].
    load_uncertainty, gain_uncertainty, housing_uncertainty : float
        Relative standard deviations of a stated load, of the sensor's gain, and of the housing's inertia [-].
    matters : mapping or None
        Smallest size that a headline names, by fault, in the shop's unit; where not given that of the detection table.
    seed : int
    """

    faults: Sequence[str] = tuple(FAULTS)
    motor_speed_rpm: Sequence[float] | None = None
    load_torque: Sequence[float] | None = None
    simulated: int = 36000
    draws: int = 1024
    epochs: int = 16
    false_alarms: float = 0.01
    power: float = 0.95
    coverage: float = 0.9
    load_uncertainty: float = 0.1
    gain_uncertainty: float = 0.01
    housing_uncertainty: float = 0.2
    matters: Mapping[str, float] | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "faults", tuple(fault.name for fault in chosen(self.faults)))
        check_integer("twin", "simulated", self.simulated, low=1000)
        check_integer("twin", "draws", self.draws, low=100)
        check_integer("twin", "epochs", self.epochs, low=1)
        check_integer("twin", "seed", self.seed, low=0, high=2**62)
        for name in ("false_alarms", "power", "coverage"):
            check_number("twin", name, getattr(self, name), low=0.0, low_open=True, high=1.0, high_open=True)
        self._check_enough()
        for name in ("load_uncertainty", "gain_uncertainty", "housing_uncertainty"):
            check_number("twin", name, getattr(self, name), low=0.0, low_open=True, high=1.0)
        for name, unit in (("motor_speed_rpm", "rpm"), ("load_torque", "N m")):
            _check_range(name, getattr(self, name), unit)
        if not isinstance(self.matters, Mapping | None):
            raise refuse("twin", "matters", "a mapping of faults to sizes, {reducer_play: 2}, or null", self.matters)
        for name, size in (self.matters or {}).items():
            if name not in self.faults:
                raise refuse("twin", "matters", "sizes of " + ", ".join(self.faults), name)
            check_number("twin.matters", name, size, low=0.0, unit=FAULTS[name].unit)

    @property
    def healthy(self) -> int:
        """Simulated healthy turns, beside those that the networks learn from."""
        return int(_HEALTHY_SHARE * self.simulated)

    def _check_enough(self) -> None:
        """So seldom an alarm can only be told by so many healthy turns."""
        least = math.ceil(least_records(1.0 - self.false_alarms) / (_HEALTHY_SHARE * _RUN))
        if self.simulated < least:
            rule = f"{least} or more turns for false_alarms={self.false_alarms:g}, which healthy turns must show"
            raise refuse("twin", "simulated", rule, self.simulated, "simulate more, or allow more false alarms")

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        found = dataclasses.asdict(self)
        return {key: list(value) if isinstance(value, tuple) else value for key, value in found.items()}


def _check_range(name: str, given: object, unit: str) -> None:
    if given is None:
        return
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise refuse("twin", name, f"two numbers, the lowest and the highest [{unit}]", given)
    for value in given:
        speed = name == "motor_speed_rpm"
        check_number("twin", name, value, low=0.0 if speed else None, low_open=speed, unit=unit)
    if not given[0] <= given[1]:
        raise refuse("twin", name, f"the lowest and then the highest [{unit}]", list(given))
