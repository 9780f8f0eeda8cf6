"""`indexer_env/IndexerDiagnosis-v0`: a fault to be named from turns that cost.

All about it: docs/environments/indexer_diagnosis.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box, Discrete

from indexer_env.checks import check_choice, check_integer
from indexer_env.diagnosis import BANDS, Case, band_levels, check_bench, check_hypotheses, draw_case, measure
from indexer_env.diagnosis_task import DiagnosisTask, task_from_mapping
from indexer_env.errors import ParameterError, refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_operating_point, load_sensor, load_yaml
from indexer_env.scenario import loaded
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal


class IndexerDiagnosisEnv(gymnasium.Env[np.ndarray, np.int64]):
    """A machine with a hidden fault: each action runs one turn at a setting, or names the fault and ends the episode.

    The rewards are -c for a measurement that costs c (`DiagnosisTask.costs`), `right` for the right name, -`wrong` for
    a wrong one and for a measurement that the budget no longer pays, which ends the episode too.

    Parameters
    ----------
    machine : str, Machine
        A preset's name, a YAML file or a machine; an episode's own is drawn around it.
    operating_point : str, OperatingPoint
        Nominal motor speed and load; its start angle is not used.
    sensor : str, Sensor
        The chain through which the acceleration is read.
    task : str, mapping, DiagnosisTask
        A preset of `conf/diagnosis`, a YAML file or the fields of `DiagnosisTask`.
    reveal : bool
        Whether info carries the truth.
    render_mode : None
        There is no picture.
    **changes
        Fields of `DiagnosisTask` that differ from those of `task`.

    Raises
    ------
    ParameterError
        One sentence on the parameter in question.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 (Gymnasium's interface)

    def __init__(
        self,
        *,
        machine: str | Machine = "reference",
        operating_point: str | OperatingPoint = "reference",
        sensor: str | Sensor = "bench",
        task: str | Mapping[str, Any] | DiagnosisTask = "bench",
        reveal: bool = False,
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        owner = "IndexerDiagnosisEnv"
        self.machine: Machine = loaded(owner, "machine", machine, Machine, load_machine)
        self.operating_point: OperatingPoint = loaded(
            owner, "operating_point", operating_point, OperatingPoint, load_operating_point
        )
        self.sensor: Sensor = loaded(owner, "sensor", sensor, Sensor, load_sensor)
        self.task = _task(task, changes)
        check_bench(self.task, self.machine, self.operating_point, self.sensor)
        check_hypotheses(self.task, self.machine)
        if not isinstance(reveal, bool):
            raise refuse(owner, "reveal", "True or False", reveal)
        if render_mode is not None:
            raise refuse(owner, "render_mode", "None", render_mode, "it has no picture")
        self.render_mode = None
        self._reveal = reveal
        self.settings, self.names = self.task.settings, self.task.names
        self.costs = self.task.costs(self.machine, self.operating_point)
        self.action_space = Discrete(len(self.settings) + len(self.names))
        self.observation_space = Box(-1.0, 1.0, (BANDS + len(self.settings) + 1,))
        self._case: Case | None = None
        self._left, self._observation = 0.0, np.zeros(0, dtype=np.float32)

    @property
    def reward_range(self) -> tuple[float, float]:
        """Lowest and highest reward of a step."""
        return -max(self.task.wrong, float(self.costs.max())), self.task.right

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Draw a machine and what it suffers from; nothing has been measured yet.

        options, for this episode only: "hypothesis", the name of what it suffers from.

        Raises
        ------
        ParameterError
            An option that does not exist, or a value of one that cannot be.
        """
        super().reset(seed=seed)
        self._case = None
        self._case = draw_case(self.task, self.machine, self.np_random, self._hypothesis(options))
        self._left = self.task.budget
        self._observation = self._observed(np.full(BANDS, -1.0), None)
        return self._observation.copy(), self._info(None)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Run one turn, or name the fault.

        Raises
        ------
        ParameterError
            An action that is no whole number of the action space.
        ResetNeeded
            Before the first reset, and after the end of an episode.
        SimulationError
            The machine leaves the model's range at the setting; the episode goes on.
        """
        if self._case is None:
            raise ResetNeeded("IndexerDiagnosisEnv.step must follow a reset, at first and after each end; call reset.")
        place = _checked(action, len(self.settings) + len(self.names))
        if place < len(self.settings) and self.costs[place] <= self._left:
            (record,) = measure(
                [self._case], [self.settings[place]], self.operating_point, self.sensor, [self.np_random]
            )
            self._left -= float(self.costs[place])
            self._observation = self._observed(band_levels(record), place)
            return self._observation.copy(), -float(self.costs[place]), False, False, self._info(record)
        info = self._info(None)
        right = place - len(self.settings) == self._case.name
        self._case = None
        reward = float(self.task.right if right else -self.task.wrong)
        return self._observation.copy(), reward, True, False, info

    def _hypothesis(self, options: Mapping[str, Any] | None) -> int | None:
        """Place of the hypothesis that is asked for, None where it is to be drawn."""
        if options and not isinstance(options, Mapping):
            raise refuse("IndexerDiagnosisEnv.reset", "options", "a mapping", options)
        for key in options or {}:
            if key != "hypothesis":
                raise ParameterError(f"IndexerDiagnosisEnv.reset has no option {key!r}; its only one is 'hypothesis'.")
        if not options:
            return None
        check_choice("IndexerDiagnosisEnv.reset", "hypothesis", options["hypothesis"], self.names)
        return self.names.index(options["hypothesis"])

    def _observed(self, levels: np.ndarray, place: int | None) -> np.ndarray:
        taken = np.zeros(len(self.settings))
        if place is not None:
            taken[place] = 1.0
        return np.concatenate([levels, taken, [self._left / self.task.budget]]).astype(np.float32)

    def _info(self, record: Signal | None) -> dict[str, Any]:
        assert self._case is not None
        affordable = self.costs <= self._left
        info: dict[str, Any] = {"action_mask": np.concatenate([affordable, np.ones(len(self.names))]).astype(np.int8)}
        if record is not None:
            info["record"] = record
        if self._reveal:
            faults = self._case.faults
            info["truth"] = {
                "hypothesis": self._case.name,
                "roller_crack": faults.roller_crack,
                "cracked_station": -1 if faults.cracked_station is None else faults.cracked_station,
                "screw_looseness": faults.screw_looseness,
                "backlash": faults.backlash,
            }
        return info


def _task(given: object, changes: Mapping[str, Any]) -> DiagnosisTask:
    if isinstance(given, DiagnosisTask):
        given = {key: getattr(given, key) for key in DiagnosisTask.__dataclass_fields__}
    elif isinstance(given, str | Path):
        given = load_yaml("diagnosis", given)
    if not isinstance(given, Mapping):
        rule = "a DiagnosisTask, a mapping of its fields or the name of a preset"
        raise refuse("IndexerDiagnosisEnv", "task", rule, given)
    return task_from_mapping({**given, **changes})


def _checked(action: object, count: int) -> int:
    """The action as an int, or one sentence on what is wrong with it."""
    if type(action) is np.ndarray and action.shape == ():
        action = action.item()
    check_integer("IndexerDiagnosisEnv", "action", action, low=0, high=count - 1)
    return int(action)  # type: ignore[call-overload]
