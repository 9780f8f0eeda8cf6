"""`indexer_env/IndexerDiagnosis-v1`: a fault to be named from turns that cost, one machine: a fleet of one.

All about it: docs/reference/environments/indexer_diagnosis.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from indexer_env.checks import check_choice, check_integer
from indexer_env.diagnosis import Measurement
from indexer_env.diagnosis_fleet import DiagnosisFleet, FleetView
from indexer_env.diagnosis_task import DiagnosisTask, Setting
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


class IndexerDiagnosisEnv(FleetView, gymnasium.Env[np.ndarray, np.int64]):
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
    render_mode : None or "rgb_array"
        `render` gives a picture of what is known. Needs the extra ``[render]``.
    **changes
        Fields of `DiagnosisTask` that differ from those of `task`.

    Raises
    ------
    ParameterError
        One sentence on the parameter in question.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012 (Gymnasium's interface)

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
        self._fleet = DiagnosisFleet(1, machine, operating_point, sensor, task, changes)
        if not isinstance(reveal, bool):
            raise refuse("IndexerDiagnosisEnv", "reveal", "True or False", reveal)
        if render_mode is not None:
            check_choice("IndexerDiagnosisEnv", "render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self._reveal, self._running = reveal, False
        self.action_space, self.observation_space = self._fleet.spaces()
        self._shown: list[tuple[Setting, np.ndarray]] | None = None

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
        self._running = False  # what is refused below leaves nothing that could go on
        super().reset(seed=seed)
        self._fleet.start(0, self.np_random, self._fleet.hypothesis(options))
        self._running, self._shown = True, []
        return self._fleet.observations[0], self._info(None)

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
        if not self._running:
            raise ResetNeeded("IndexerDiagnosisEnv.step must follow a reset, at first and after each end; call reset.")
        place = _checked(action, int(self.action_space.n))  # type: ignore[attr-defined]
        turn = self._fleet.step(np.array([place]), np.ones(1, dtype=bool), (self.np_random,))
        self._running = not turn.terminated[0]
        (measured,) = turn.measured
        if measured is not None and self._shown is not None:
            self._shown.append((self.settings[place], measured.levels))
        return turn.observations[0], float(turn.rewards[0]), bool(turn.terminated[0]), False, self._info(measured)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """What the episode's turns have shown and what is left of the budget, (480, 640, 3) uint8.

        Raises
        ------
        ResetNeeded
            Before the first reset.
        gymnasium.error.DependencyNotInstalled
            pygame, the extra ``[render]``, is not installed.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "IndexerDiagnosisEnv.render was called without a render mode; make the environment with "
                'render_mode="rgb_array".'
            )
            return None
        if self._shown is None:
            raise ResetNeeded("IndexerDiagnosisEnv.render must follow a reset; call reset.")
        from indexer_env.render import draw_spectra

        return draw_spectra(self._shown, float(self._fleet.left[0] / self.task.budget))

    def _info(self, measured: Measurement | None) -> dict[str, Any]:
        info: dict[str, Any] = {"action_mask": self._fleet.action_masks[0]}
        if measured is not None:
            info["record"] = measured.record
        if self._reveal:
            info["truth"] = {name: values[0].item() for name, values in self._fleet.truths().items()}
        return info


def _checked(action: object, count: int) -> int:
    """The action as an int, or one sentence on what is wrong with it; an array of one whole number is one."""
    if type(action) is np.ndarray and action.size == 1:
        action = action.item()
    check_integer("IndexerDiagnosisEnv", "action", action, low=0, high=count - 1)
    return int(action)  # type: ignore[call-overload]
