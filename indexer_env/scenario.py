"""What an environment is made with, and what of it an episode draws: the same for one machine and for many."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from indexer_env.build import check_keywords, from_mapping
from indexer_env.checks import check_number, did_you_mean
from indexer_env.control import ControlTask, Limits, check_drive, dwell_begin, limits_of
from indexer_env.errors import ParameterError, refuse
from indexer_env.fault_law import Course, FaultLaw, fault_law
from indexer_env.faults import Faults
from indexer_env.kernels.control import OBSERVED
from indexer_env.machine import Machine
from indexer_env.operating_point import START_ANGLE, OperatingPoint
from indexer_env.presets import load_machine, load_operating_point, load_sensor, load_yaml
from indexer_env.sensors import Sensor
from indexer_env.start import Start, items_of
from indexer_env.units import DEGREE

_ARGUMENTS = ("machine", "operating_point", "faults", "sensor", "reveal", "render_mode")
"""What an environment takes besides the fields of `ControlTask`."""

OPTIONS = ("faults", "machine", "operating_point", "start_angle")
"""What `reset(options=...)` takes."""


@dataclass(frozen=True)
class Scenario:
    """The machine, what it is asked to do, the law of its faults, the sensor, the task and the observation's limits."""

    machine: Machine
    operating_point: OperatingPoint
    faults: FaultLaw
    sensor: Sensor
    task: ControlTask
    limits: Limits

    @staticmethod
    def of(
        machine: object,
        operating_point: object,
        faults: object,
        sensor: object,
        task: Mapping[str, Any],
        others: Sequence[str] = (),
    ) -> Scenario:
        """From the arguments of an environment, which has `others` besides; raises ParameterError."""
        check_keywords("IndexerEnv", task, (*_ARGUMENTS, *others), ControlTask)
        numbers = from_mapping(ControlTask, task, owner="IndexerEnv")
        chain = loaded("IndexerEnv", "sensor", sensor, Sensor, load_sensor)
        ordered = loaded("IndexerEnv", "machine", machine, Machine, load_machine)
        point = loaded("IndexerEnv", "operating_point", operating_point, OperatingPoint, load_operating_point)
        limits = limits_of(ordered, point, chain, numbers)
        scenario = Scenario(ordered, point, _faults(faults), chain, numbers, limits)
        dwell_begin(ordered)
        check_drive(ordered, point, numbers)
        check_faults([scenario])
        return scenario

    def spaces(self) -> tuple[Box, Box]:
        """Action and observation space of one machine."""
        return Box(-1.0, 1.0, (self.task.actions,)), Box(-1.0, 1.0, (OBSERVED,))

    def draw(self, rng: np.random.Generator) -> Start:
        """Start of an episode: the start angle is drawn first, uniform over the first dwell, then the faults.

        A cam without dwell starts anywhere in its first turn.
        """
        angle = self.task.start_angle
        if angle is None:
            begin = dwell_begin(self.machine) % (2.0 * math.pi)
            angle = begin + (2.0 * math.pi - begin) * float(rng.random())
        point = dataclasses.replace(self.operating_point, start_angle=angle)
        return Start(self.machine, point, self.faults.draw(rng))


def check_faults(scenarios: Sequence[Scenario]) -> None:
    """Refuse a machine that the step refuses, and a law of faults, the same in all these scenarios, that can draw one
    which a machine or the step refuses.

    Each fault is tried alone at the ends of its law; machines that are varied from episode to episode are tried as they
    were ordered.
    """
    step = scenarios[0].task.integrator_step
    items_of([(Start(each.machine, each.operating_point, Course()), Faults()) for each in scenarios], step)
    for name, value, course in scenarios[0].faults.extremes():
        starts = [Start(scenario.machine, scenario.operating_point, course) for scenario in scenarios]
        try:
            items_of([(start, faults) for start in starts for faults in (start.faults_at(0.0, 0.0), start.worst)], step)
        except ParameterError as error:
            unit = {"backlash": "deg", "backlash_per_joule": "deg/J"}.get(name)
            shown = f"{value / DEGREE:g} {unit}" if unit else f"{value:g}"
            raise ParameterError(f"faults.{name} can be {shown}, but {error}") from None


def options_for(scenario: Scenario, options: Mapping[str, Any] | None) -> Scenario:
    """The scenario of an episode that was reset with options; the limits stay."""
    if not options:
        return scenario
    if not isinstance(options, Mapping):
        raise refuse("IndexerEnv.reset", "options", "a mapping", options)
    changes: dict[str, Any] = {}
    for key, value in options.items():
        if key == "faults":
            changes["faults"] = _faults(value)
        elif key == "machine":
            changes["machine"] = loaded("IndexerEnv", "machine", value, Machine, load_machine)
        elif key == "operating_point":
            changes["operating_point"] = loaded(
                "IndexerEnv", "operating_point", value, OperatingPoint, load_operating_point
            )
        elif key == "start_angle":
            check_number("IndexerEnv.reset", "start_angle", value, **START_ANGLE)
            changes["task"] = dataclasses.replace(scenario.task, start_angle=float(value))
        else:
            hint = did_you_mean(key, OPTIONS) or "the options are " + ", ".join(OPTIONS)
            raise ParameterError(f"IndexerEnv.reset has no option {key!r}; {hint}.")
    changed = dataclasses.replace(scenario, **changes)
    dwell_begin(changed.machine)
    check_drive(changed.machine, changed.operating_point, changed.task)
    return changed


def loaded(owner: str, name: str, given: Any, cls: type, load: Any) -> Any:
    """The object given, or loaded where a preset's name or a file is."""
    if isinstance(given, cls):
        return given
    if isinstance(given, str | Path):
        return load(given)
    raise refuse(owner, name, f"a {cls.__name__} or the name of a preset", given)


def _faults(given: object) -> FaultLaw:
    return fault_law(load_yaml("faults_law", given) if isinstance(given, str | Path) else given)
