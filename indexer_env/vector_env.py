"""`indexer_env/Indexer-v1` for many machines: one kernel call steps them all."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from indexer_env.checks import check_integer
from indexer_env.control import ControlTask, Limits
from indexer_env.device import CPU, cuda_of
from indexer_env.errors import ParameterError, refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_operating_point
from indexer_env.registration import MAX_EPISODE_STEPS
from indexer_env.scenario import Scenario, check_faults, loaded, options_for
from indexer_env.sensors import Sensor
from indexer_env.start import Start
from indexer_env.variation import check_half_width, variation_rng, varied
from indexer_env.vector_parts import Arrays, Generators, autoreset_mode_of, mask_of, naming, seeds_of

_ARGUMENTS = ("num_envs", "half_width", "autoreset_mode", "max_episode_steps", "device")
"""What it takes that the single environment does not."""


MOST_MACHINES = 1_000_000
"""Machines of a fleet: some 5 GB."""

MOST_READINGS = 20_000_000
"""Readings of a fleet in one period: with the truth to them some 3 GB."""


class IndexerVectorEnv(gymnasium.vector.VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """`num_envs` machines, each with its own generator, faults and, if given, parameters.

    Item i gives the bits that `IndexerEnv` gives with the same seed and item 0's limits; `reset(seed=s)` seeds item i
    with s + i. Infos are those of the single environment, batched with masks as Gymnasium's vector environments do.

    Parameters
    ----------
    num_envs : int
        1 to MOST_MACHINES; times the samples of a period at most MOST_READINGS.
    machine, operating_point : as in `IndexerEnv`, or a sequence of num_envs of them
        The limits, by which observations and the reward's vibration are scaled, are those of the first.
    half_width : float
        w [-], in [0, 0.5]: each episode has a machine of its own, drawn around the item's as by the wrapper
        `DomainRandomisation`, bit for bit; 0 draws none.
    autoreset_mode : AutoresetMode or str
        NextStep (default), SameStep or Disabled; in metadata["autoreset_mode"].
    max_episode_steps : int
        Control periods after which an episode is truncated.
    device : str
        "cpu"; or "cuda" or "cuda:N" for a GPU (extra [cuda]): actions, observations, rewards and infos are then torch
        tensors there. Machines and faults are drawn as on the CPU, a sensor's noise on the GPU.
    faults, sensor, reveal, render_mode, **task
        As in `IndexerEnv`.

    Raises
    ------
    ParameterError
        One sentence on the parameter in question.
    """

    metadata = {"render_modes": [], "render_fps": 50, "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        *,
        machine: str | Machine | Sequence[str | Machine] = "reference",
        operating_point: str | OperatingPoint | Sequence[str | OperatingPoint] = "reference",
        faults: object = None,
        sensor: str | Sensor = "environment",
        reveal: bool = False,
        render_mode: str | None = None,
        half_width: float = 0.0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int = MAX_EPISODE_STEPS,
        device: str = CPU,
        **task: Any,
    ) -> None:
        check_integer("IndexerVectorEnv", "num_envs", num_envs, low=1, high=MOST_MACHINES)
        check_integer("IndexerVectorEnv", "max_episode_steps", max_episode_steps, low=1)
        if render_mode is not None:
            raise ParameterError(f"IndexerVectorEnv.render_mode must be None, got {render_mode!r}; it has no picture.")
        if not isinstance(reveal, bool):
            raise ParameterError(f"IndexerVectorEnv.reveal must be True or False, got {reveal!r}.")
        check_half_width("IndexerVectorEnv", half_width)
        self.num_envs = num_envs
        self.autoreset_mode = autoreset_mode_of("IndexerVectorEnv", autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._scenarios = _scenarios(num_envs, machine, operating_point, faults, sensor, task)
        first = self._scenarios[0]
        if num_envs * first.task.samples > MOST_READINGS:
            rule = f"at most {MOST_READINGS // first.task.samples} with {first.task.samples} samples in a period"
            raise refuse("IndexerVectorEnv", "num_envs", rule, num_envs, "make the period shorter or the fleet smaller")
        self.single_action_space, self.single_observation_space = first.spaces()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._arrays = _arrays(device)
        self._fleet = self._arrays.fleet(num_envs, first, truth=reveal)
        self._reveal, self._most_steps, self._half_width = reveal, max_episode_steps, half_width
        self._generators = Generators(num_envs)
        self._machine_rngs: dict[int, np.random.Generator] = {}
        self._elapsed = np.zeros(num_envs, dtype=np.int64)
        self._ended, self._started = np.zeros(num_envs, dtype=bool), np.zeros(num_envs, dtype=bool)

    @property
    def limits(self) -> Limits:
        """What the observation is scaled by."""
        return self._scenarios[0].limits

    @property
    def task(self) -> ControlTask:
        """Numbers of the control problem."""
        return self._fleet.task

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The items' generators."""
        self._seed([None] * self.num_envs, np.zeros(self.num_envs, dtype=bool))
        return tuple(self._generators.rngs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The items' seeds."""
        self._seed([None] * self.num_envs, np.zeros(self.num_envs, dtype=bool))
        return tuple(self._generators.seeds)

    def _seed(self, seeds: Sequence[int | None], mask: np.ndarray) -> None:
        """Seed the items' generators, those of their machines too."""
        for i in self._generators.seed(seeds, mask):
            self._machine_rngs[i] = variation_rng(seeds[i] if mask[i] else None)
            if i == 0:
                self._fleet.seed_noise(self._generators.seeds[0])

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start all episodes, or those of options["reset_mask"] (n,) bool; `seed` is one for item 0, item i getting
        seed + i, or a sequence of one for each. Further options as in `IndexerEnv.reset`, for the episodes started.

        Raises
        ------
        ParameterError
            As `IndexerEnv.reset`; a mask or a sequence of seeds of another length.
        """
        before, self._started[:] = self._started.copy(), False  # what is refused below leaves nothing that could go on
        if options and not isinstance(options, Mapping):
            raise refuse("IndexerVectorEnv.reset", "options", "a mapping", options)
        given = dict(options or {})
        mask = mask_of("IndexerVectorEnv", given.pop("reset_mask", None), self.num_envs)
        self._started[~mask] = before[~mask]
        self._seed(seeds_of("IndexerVectorEnv", seed, self.num_envs), mask)
        index = np.flatnonzero(mask)
        readings = self._arrays.zeros(self.num_envs, self._fleet.task.samples)
        readings[self._arrays.index(index)] = self._start(index, given)
        return self._fleet.observations, self._infos(readings, mask)

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Run one control period of every machine, those apart that the autoreset mode starts anew in this call.

        Raises
        ------
        ParameterError
            An action out of its box, of the wrong shape or kind, or not finite; nothing is clipped.
        ResetNeeded
            Before the first reset; with autoreset disabled also while an episode that has ended was not reset.
        """
        ended = self._ended
        if not self._started.all():
            raise ResetNeeded("IndexerVectorEnv.step must follow a reset of all its machines; call reset.")
        any_ended = bool(ended.any())
        if any_ended and self.autoreset_mode is AutoresetMode.DISABLED:
            which = np.flatnonzero(ended).tolist()
            raise ResetNeeded(
                f'Episodes {which} have ended; reset them with options={{"reset_mask": …}} before a step.'
            )
        shares = self._arrays.shares("IndexerVectorEnv", actions, self.num_envs, self.task)
        self._started[:] = False  # a step that is broken off leaves nothing that could go on
        live = np.flatnonzero(~ended) if any_ended else None
        period = self._fleet.step(shares, live, self._generators.rngs)
        observations, rewards = period.observations, period.rewards
        terminations = self._arrays.on_host(period.terminated)
        self._elapsed += 1
        truncations = self._elapsed >= self._most_steps
        readings = period.readings
        if any_ended:  # only in NEXT_STEP: these are started in place of a step
            index = np.flatnonzero(ended)
            self._start_in_place(index, observations, readings)
            rewards[self._arrays.index(index)], terminations[index], truncations[index] = 0.0, False, False
        self._ended = terminations | truncations
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            infos = self._same_step(observations, readings)
        infos.update(self._infos(readings, np.ones_like(ended)))
        self._started[:] = True
        return observations, rewards, self._arrays.given(terminations), self._arrays.given(truncations), infos

    def _start_in_place(self, index: np.ndarray, observations: Any, readings: Any) -> None:
        """Start items anew in place of a step, or behind it; what is seen then goes among the others'."""
        places = self._arrays.index(index)
        readings[places] = self._start(index)
        observations[places] = self._fleet.observations[places]

    def _same_step(self, observations: Any, readings: Any) -> dict[str, Any]:
        """Start the episodes that this step ended, in place; what they ended with, as final_obs and final_info."""
        ended = self._ended.copy()
        of_those = self._arrays.zeros(*readings.shape)
        places = self._arrays.index(np.flatnonzero(ended))
        of_those[places] = readings[places]
        infos = self._arrays.final_infos(observations, ended, self._infos(of_those, ended))
        self._start_in_place(np.flatnonzero(ended), observations, readings)
        return infos

    def _start(self, index: np.ndarray, options: Mapping[str, Any] | None = None) -> Any:
        """Start items anew; readings (k, m)."""
        starts = []
        for i in index.tolist():
            with naming("IndexerVectorEnv", i):
                starts.append(self._drawn(i, options))
        try:
            readings = self._fleet.start(index.tolist(), starts, self._generators.rngs)
        except ParameterError:
            for i, start in zip(index.tolist(), starts, strict=True):  # they were checked together: which is it?
                with naming("IndexerVectorEnv", i):
                    start.check(self.task.integrator_step)
            raise
        self._elapsed[index], self._ended[index], self._started[index] = 0, False, True
        return readings

    def _drawn(self, i: int, options: Mapping[str, Any] | None) -> Start:
        """What item i starts its next episode with."""
        scenario = options_for(self._scenarios[i], options)
        if self._half_width > 0.0:
            machine = varied(scenario.machine, self._half_width, self._machine_rngs[i])
            scenario = dataclasses.replace(scenario, machine=machine)
        return scenario.draw(self._generators.rngs[i])

    def _infos(self, readings: Any, mask: np.ndarray) -> dict[str, Any]:
        infos: dict[str, Any] = {"acceleration": readings, "_acceleration": self._arrays.given(mask.copy())}
        if self._reveal:
            truth: dict[str, Any] = {}
            others = self._arrays.index(np.flatnonzero(~mask))
            for name, values in self._fleet.truths().items():
                values[others] = 0.0
                truth |= {name: values, f"_{name}": self._arrays.given(mask.copy())}
            infos |= {"truth": truth, "_truth": self._arrays.given(mask.copy())}
        return infos


def _arrays(device: object) -> Arrays:
    """The arrays of a device; raises ParameterError where there is none of this name."""
    cuda = cuda_of("IndexerVectorEnv", device)
    if cuda is None:
        return Arrays()
    from indexer_env.cuda.arrays import Tensors

    return Tensors(cuda)


def _scenarios(
    n: int, machine: object, operating_point: object, faults: object, sensor: object, task: Mapping[str, Any]
) -> list[Scenario]:
    """One scenario per item; one object where nothing differs."""
    many = (list, tuple)
    if not isinstance(machine, many) and not isinstance(operating_point, many):
        return [Scenario.of(machine, operating_point, faults, sensor, task, _ARGUMENTS)] * n
    machines = machine if isinstance(machine, many) else [machine] * n
    points = operating_point if isinstance(operating_point, many) else [operating_point] * n
    for name, given in (("machine", machines), ("operating_point", points)):
        if len(given) != n:
            raise refuse("IndexerVectorEnv", name, f"one, or a sequence of num_envs = {n}", f"{len(given)} of them")
    pairs = []
    for i, (own, point) in enumerate(zip(machines, points, strict=True)):
        with naming("IndexerVectorEnv", i):
            pairs.append((
                loaded("IndexerVectorEnv", "machine", own, Machine, load_machine),
                loaded("IndexerVectorEnv", "operating_point", point, OperatingPoint, load_operating_point),
            ))  # fmt: skip
    first = Scenario.of(pairs[0][0], pairs[0][1], faults, sensor, task, _ARGUMENTS)
    scenarios = []
    for i, (own, point) in enumerate(pairs):
        with naming("IndexerVectorEnv", i):
            scenarios.append(options_for(first, {"machine": own, "operating_point": point}))
    try:
        check_faults(scenarios)
    except ParameterError:
        for i, scenario in enumerate(scenarios):  # they were checked together: which is it?
            with naming("IndexerVectorEnv", i):
                check_faults([scenario])
        raise
    return scenarios
