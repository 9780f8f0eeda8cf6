"""`indexer_env/Indexer-v1`: one machine under speed control (docs/reference/environments/indexer.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from indexer_env.checks import check_choice
from indexer_env.control import ControlTask, Limits, checked_actions, reward_bounds
from indexer_env.errors import ParameterError
from indexer_env.fault_law import FaultLaw
from indexer_env.fleet import Fleet
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.scenario import Scenario, options_for
from indexer_env.sensors import Sensor

if TYPE_CHECKING:
    from indexer_env.film import Film
    from indexer_env.render import Window


class IndexerEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A cam indexing machine whose motor speed is commanded anew every control period.

    The reward of a period is

        r = min(max(Δα / (τ ω T), 0), 2) - w min(a / s, 4)

    with the cam's advance Δα over that at nominal motor speed ω in the period T (indexes per second over nominal), the
    rms a of the table's true acceleration at the period's samples in the dwell (0 where none is), its scale s
    (`limits.vibration`, a tenth of the peak acceleration of rigid motion at nominal speed) and the weight
    w = `vibration_weight`. The step in which the machine leaves the model's range (a joint deflected by more than
    0.5 rad, or no longer finite) ends the episode with r = -100.

    Parameters
    ----------
    machine : str, Machine
        A preset's name, a YAML file or a machine.
    operating_point : str, OperatingPoint
        Nominal motor speed and load; its start angle is not used.
    faults : None, mapping, FaultLaw, Course, Faults or str
        See `fault_law`; a str is a preset of `conf/faults_law` or a YAML file.
    sensor : str, Sensor
        The chain through which the acceleration is seen; it must have a range.
    reveal : bool
        Whether info carries the truth.
    render_mode : None, "rgb_array" or "human"
        `render` gives a picture, or every step shows it in a window. Needs the extra ``[render]``.
    **task
        Fields of `ControlTask`: period, sample_rate, step, ramp, highest_share, brake_torque, vibration_weight,
        start_angle.

    Raises
    ------
    ParameterError
        One sentence on the parameter in question.
    """

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 50}  # noqa: RUF012 (Gymnasium's interface)

    def __init__(
        self,
        *,
        machine: str | Machine = "reference",
        operating_point: str | OperatingPoint = "reference",
        faults: object = None,
        sensor: str | Sensor = "environment",
        reveal: bool = False,
        render_mode: str | None = None,
        **task: Any,
    ) -> None:
        self._scenario = Scenario.of(machine, operating_point, faults, sensor, task)
        if not isinstance(reveal, bool):
            raise ParameterError(f"IndexerEnv.reveal must be True or False, got {reveal!r}.")
        if render_mode is not None:
            check_choice("IndexerEnv", "render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space, self.observation_space = self._scenario.spaces()
        truth = reveal or render_mode is not None
        self._fleet = Fleet(1, self._scenario.task, self._scenario.limits, self._scenario.sensor, truth=truth)
        self._reveal, self._running = reveal, False
        self._film: Film | None = None
        self._window: Window | None = None

    @property
    def limits(self) -> Limits:
        """What the observation is scaled by."""
        return self._scenario.limits

    @property
    def task(self) -> ControlTask:
        """Numbers of the control problem."""
        return self._scenario.task

    @property
    def machine(self) -> Machine:
        """The machine as it was ordered; an episode's own may be given by `reset`."""
        return self._scenario.machine

    @property
    def operating_point(self) -> OperatingPoint:
        """Nominal motor speed and load torque."""
        return self._scenario.operating_point

    @property
    def faults(self) -> FaultLaw:
        """The law by which an episode draws its faults."""
        return self._scenario.faults

    @property
    def reward_range(self) -> tuple[float, float]:
        """Lowest and highest reward of a step."""
        return reward_bounds(self._scenario.task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; the motor runs at its nominal speed, the table stands on its law, no joint is deflected but
        the input joint by what ripples on the drive.

        options, for this episode only: "faults" (as in the constructor), "machine", "operating_point", "start_angle".

        Raises
        ------
        ParameterError
            An option that does not exist, or a value of one that cannot be.
        """
        self._running = False  # what is refused below leaves nothing that could go on
        super().reset(seed=seed)
        scenario = options_for(self._scenario, options)
        readings = self._fleet.start([0], [scenario.draw(self.np_random)], [self.np_random])
        self._running = True
        if self.render_mode is not None:
            self._show(first=True)
        return self._fleet.observations[0], self._info(readings)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Run one control period; see the class for the reward.

        Raises
        ------
        ParameterError
            An action out of its box, of the wrong shape or kind, or not finite; nothing is clipped.
        ResetNeeded
            Before the first reset, and after the end of an episode.
        """
        if not self._running:
            raise ResetNeeded("IndexerEnv.step must follow a reset, at first and after each end; call reset.")
        actions = checked_actions("IndexerEnv", action, (self.task.actions,))
        self._running = False  # a step that is broken off leaves nothing that could go on
        period = self._fleet.step(self.task.shares(actions)[np.newaxis], None, (self.np_random,))
        terminated = bool(period.terminated[0])
        self._running = not terminated
        if self.render_mode is not None and not terminated:
            self._show(first=False)
        return period.observations[0], float(period.rewards[0]), terminated, False, self._info(period.readings)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """The present picture (480, 640, 3) uint8 in mode "rgb_array"; in mode "human" every step has shown it already.
        After a termination it is that of the last period within the model's range.

        Raises
        ------
        ResetNeeded
            Before the first reset.
        gymnasium.error.DependencyNotInstalled
            pygame, the extra ``[render]``, is not installed.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "IndexerEnv.render was called without a render mode; make the environment with "
                'render_mode="rgb_array" or "human".'
            )
            return None
        if self._film is None:
            raise ResetNeeded("IndexerEnv.render must follow a reset; call reset.")
        if self.render_mode == "human":
            return None
        from indexer_env.render import draw

        return draw(self._film.scene(self._fleet.machine(0), self._fleet.operating_point(0)))

    def close(self) -> None:
        """Close the window, if one is open."""
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        """All but the window, which a copy opens for itself."""
        return {**self.__dict__, "_window": None}

    def _show(self, *, first: bool) -> None:
        """Keep what the picture needs; in mode "human" show it."""
        from indexer_env.film import Film
        from indexer_env.render import Window

        channels = self._fleet.channels(0)
        if self._film is None:
            window = 2.0 * self.machine.turn_duration(self.operating_point) / self.machine.stations
            self._film = Film(window, self.task.period)
        if first:
            self._film.start(channels)
        else:
            self._film.add(channels)
        if self.render_mode == "human":
            self._window = self._window or Window(render_fps=self.metadata["render_fps"])
            self._window.show(self._film.scene(self._fleet.machine(0), self._fleet.operating_point(0)))

    def _info(self, readings: np.ndarray) -> dict[str, Any]:
        info: dict[str, Any] = {"acceleration": readings[0]}
        if self._reveal:
            truths = self._fleet.truths()
            info["truth"] = {name: v[0] if v.ndim > 1 else float(v[0]) for name, v in truths.items()}
        return info
