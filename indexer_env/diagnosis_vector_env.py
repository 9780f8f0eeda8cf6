"""`indexer_env/IndexerDiagnosis-v1` for many machines: the turns of a step are simulated together, on all cores."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from indexer_env.checks import check_integer
from indexer_env.diagnosis import Measurement
from indexer_env.diagnosis_fleet import DiagnosisFleet, FleetView
from indexer_env.diagnosis_task import DiagnosisTask
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.vector_parts import Generators, autoreset_mode_of, final_infos, mask_of, naming, seeds_of

_ARGUMENTS = ("num_envs", "autoreset_mode", "max_episode_steps")
"""What it takes that the single environment does not."""

_OWNER = "IndexerDiagnosisVectorEnv"

MOST_MACHINES = 4096
"""Machines of a fleet, whose records take some 1 GB in a step."""


class IndexerDiagnosisVectorEnv(FleetView, gymnasium.vector.VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """`num_envs` machines with hidden faults, each with its own generator.

    Item i gives the bits that `IndexerDiagnosisEnv` gives with the same seed; `reset(seed=s)` seeds item i with s + i.
    Infos are those of the single environment, batched with masks as Gymnasium's vector environments do.

    Parameters
    ----------
    num_envs : int
        1 to MOST_MACHINES.
    machine, operating_point, sensor, task, reveal, **changes
        As in `IndexerDiagnosisEnv`.
    render_mode : None
        There is no picture of many.
    autoreset_mode : AutoresetMode or str
        NextStep (default), SameStep or Disabled; in metadata["autoreset_mode"].
    max_episode_steps : int or None
        Steps after which an episode is truncated; None: never, since the budget ends every episode.

    Raises
    ------
    ParameterError
        One sentence on the parameter in question.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        *,
        machine: str | Machine = "reference",
        operating_point: str | OperatingPoint = "reference",
        sensor: str | Sensor = "bench",
        task: str | Mapping[str, Any] | DiagnosisTask = "bench",
        reveal: bool = False,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **changes: Any,
    ) -> None:
        check_integer(_OWNER, "num_envs", num_envs, low=1, high=MOST_MACHINES)
        if max_episode_steps is not None:
            check_integer(_OWNER, "max_episode_steps", max_episode_steps, low=1)
        if render_mode is not None:
            raise refuse(_OWNER, "render_mode", "None", render_mode, "there is no picture of many machines")
        if not isinstance(reveal, bool):
            raise refuse(_OWNER, "reveal", "True or False", reveal)
        self.num_envs = num_envs
        self.autoreset_mode = autoreset_mode_of(_OWNER, autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._fleet = DiagnosisFleet(num_envs, machine, operating_point, sensor, task, changes, _ARGUMENTS)
        self.single_action_space, self.single_observation_space = self._fleet.spaces()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._reveal, self._most_steps = reveal, max_episode_steps
        self._generators = Generators(num_envs)
        self._elapsed = np.zeros(num_envs, dtype=np.int64)
        self._ended, self._started = np.zeros(num_envs, dtype=bool), np.zeros(num_envs, dtype=bool)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The items' generators."""
        self._generators.seed([None] * self.num_envs, np.zeros(self.num_envs, dtype=bool))
        return tuple(self._generators.rngs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The items' seeds."""
        self._generators.seed([None] * self.num_envs, np.zeros(self.num_envs, dtype=bool))
        return tuple(self._generators.seeds)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start all episodes, or those of options["reset_mask"] (n,) bool; `seed` is one for item 0, item i getting
        seed + i, or a sequence of one for each. The option "hypothesis" is for the episodes started.

        Raises
        ------
        ParameterError
            As `IndexerDiagnosisEnv.reset`; a mask or a sequence of seeds of another length.
        """
        before, self._started[:] = self._started.copy(), False  # what is refused below leaves nothing that could go on
        if options and not isinstance(options, Mapping):
            raise refuse(f"{_OWNER}.reset", "options", "a mapping", options)
        given = dict(options or {})
        mask = mask_of(_OWNER, given.pop("reset_mask", None), self.num_envs)
        self._started[~mask] = before[~mask]
        name = self._fleet.hypothesis(given)
        self._generators.seed(seeds_of(_OWNER, seed, self.num_envs), mask)
        self._start(np.flatnonzero(mask), name)
        return self._fleet.observations, self._infos([None] * self.num_envs, mask)

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Run one turn of, or name the fault of, every machine, those apart that the autoreset mode starts anew in this
        call.

        Raises
        ------
        ParameterError
            Actions that are no whole numbers of the action space (n,).
        ResetNeeded
            Before the first reset; with autoreset disabled also while an episode that has ended was not reset.
        SimulationError
            A machine leaves the model's range at its setting; no item has measured or named then.
        """
        if not self._started.all():
            raise ResetNeeded(f"{_OWNER}.step must follow a reset of all its machines; call reset.")
        ended = self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and ended.any():
            which = np.flatnonzero(ended).tolist()
            raise ResetNeeded(
                f'Episodes {which} have ended; reset them with options={{"reset_mask": …}} before a step.'
            )
        checked = _checked(actions, self.num_envs, int(self.single_action_space.n))  # type: ignore[attr-defined]
        turn = self._fleet.step(checked, ~ended, self._generators.rngs)
        observations, rewards, terminations = turn.observations, turn.rewards, turn.terminated
        self._elapsed += 1
        truncations = np.zeros(self.num_envs, dtype=bool)
        if self._most_steps is not None:
            truncations = self._elapsed >= self._most_steps
        if ended.any():  # only in NEXT_STEP: these are started in place of a step
            index = np.flatnonzero(ended)
            self._start(index)
            observations[index] = self._fleet.observations[index]
            rewards[index], truncations[index] = 0.0, False
        self._ended = terminations | truncations
        measured, infos = turn.measured, {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            infos = final_infos(observations, self._ended, self._infos(measured, self._ended))
            index = np.flatnonzero(self._ended)
            measured = [None if over else each for over, each in zip(self._ended, measured, strict=True)]
            self._start(index)
            observations[index] = self._fleet.observations[index]
        infos |= self._infos(measured, np.ones(self.num_envs, dtype=bool))
        return observations, rewards, terminations, truncations, infos

    def _start(self, index: np.ndarray, name: int | None = None) -> None:
        """Start items anew."""
        self._started[index] = False
        for i in index.tolist():
            with naming(_OWNER, i):
                self._fleet.start(i, self._generators.rngs[i], name)
        self._elapsed[index], self._started[index] = 0, True
        self._ended = self._ended.copy()
        self._ended[index] = False

    def _infos(self, measured: list[Measurement | None], mask: np.ndarray) -> dict[str, Any]:
        """Infos of the items of the mask (n,), as Gymnasium batches them."""
        infos: dict[str, Any] = {
            "action_mask": np.where(mask[:, np.newaxis], self._fleet.action_masks, np.int8(0)),
            "_action_mask": mask.copy(),
        }
        there = mask & np.array([each is not None for each in measured])
        if there.any():
            records = np.full(self.num_envs, None, dtype=object)
            for i in np.flatnonzero(there):
                records[i] = measured[i].record  # type: ignore[union-attr]
            infos |= {"record": records, "_record": there}
        if self._reveal:
            truth: dict[str, Any] = {}
            for name, values in self._fleet.truths().items():
                truth |= {name: np.where(mask, values, values.dtype.type(0)), f"_{name}": mask.copy()}
            infos |= {"truth": truth, "_truth": mask.copy()}
        return infos


def _checked(given: object, n: int, count: int) -> np.ndarray:
    """Actions (n,) as whole numbers, or one sentence on what is wrong with them."""
    actions = np.asarray(given)
    if isinstance(given, np.ma.MaskedArray) or actions.dtype.kind not in "iu" or actions.shape != (n,):
        shown = given if actions.size < 9 else f"{actions.dtype} of shape {actions.shape}"
        raise refuse(_OWNER, "action", f"whole numbers of shape ({n},)", shown)
    for i in np.flatnonzero((actions < 0) | (actions >= count))[:1].tolist():
        check_integer(f"{_OWNER} (item {i})", "action", int(actions[i]), low=0, high=count - 1)
    return actions.astype(np.int64)
