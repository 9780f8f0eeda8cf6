"""What the native vector environments share: seeds of their items, masks, autoreset modes and last infos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from indexer_env.checks import check_choice
from indexer_env.control import ControlTask, checked_actions
from indexer_env.errors import ParameterError, refuse
from indexer_env.fleet import Fleet
from indexer_env.scenario import Scenario


@contextmanager
def naming(owner: str, item: int) -> Iterator[None]:
    """Say in a refusal which item it is about."""
    try:
        yield
    except ParameterError as error:
        raise ParameterError(f"{owner} item {item}: {error}") from None


class Generators:
    """A generator for each of n items, as Gymnasium's `Env.np_random` is one.

    Attributes
    ----------
    rngs, seeds : list
        Of the items; empty until the first seeding.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self.rngs: list[np.random.Generator] = []
        self.seeds: list[int] = []

    def seed(self, seeds: Sequence[int | None], mask: np.ndarray) -> list[int]:
        """Give the items of the mask that have a seed new generators, and all items one at the first call; returns the
        items that have a new one."""
        first = not self.rngs
        new = [i for i in range(self._n) if first or (mask[i] and seeds[i] is not None)]
        # a seed that is refused leaves all as it was
        made = [seeding.np_random(seeds[i] if mask[i] else None) for i in new]
        if first:
            self.rngs, self.seeds = [rng for rng, _ in made], [seed for _, seed in made]
        for i, (rng, seed) in zip(new, made, strict=True):
            self.rngs[i], self.seeds[i] = rng, seed
        return new


def seeds_of(owner: str, seed: object, n: int) -> list[int | None]:
    """The items' seeds from what `reset` is given: none, one for item 0 (item i has seed + i), or one for each."""
    if seed is None or isinstance(seed, int):
        return [None if seed is None else seed + i for i in range(n)]
    seeds: list[int | None] = list(seed) if isinstance(seed, list | tuple | range) else []
    if len(seeds) != n:
        remedy = "give Python's own: int(seed), or a list of them"
        raise refuse(f"{owner}.reset", "seed", f"one or {n} whole numbers", seed, remedy)
    return seeds


def mask_of(owner: str, mask: object, n: int) -> np.ndarray:
    """The option "reset_mask" (n,) bool; all where there is none."""
    if mask is None:
        return np.ones(n, dtype=bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (n,) or not mask.any():
        raise refuse(f"{owner}.reset", "reset_mask", f"a bool array of shape ({n},) with at least one True", mask)
    return mask


def autoreset_mode_of(owner: str, given: object) -> AutoresetMode:
    """The mode of this name."""
    if isinstance(given, AutoresetMode):
        return given
    names = {mode.value: mode for mode in AutoresetMode}
    check_choice(owner, "autoreset_mode", given, names)
    return names[str(given)]


class Arrays:
    """What a vector environment does with what it is given and gives: numpy's arrays here, tensors of a GPU in
    `cuda.arrays`."""

    def fleet(self, n: int, scenario: Scenario, *, truth: bool) -> Fleet:
        """The machines."""
        return Fleet(n, scenario.task, scenario.limits, scenario.sensor, truth=truth)

    def shares(self, owner: str, actions: Any, n: int, task: ControlTask) -> Any:
        """Commands (n, k) of actions (n, k); raises ParameterError for one out of its box."""
        return task.shares(checked_actions(owner, actions, (n, task.actions)))

    def given(self, array: np.ndarray) -> Any:
        """An array of the host as users get it."""
        return array

    def on_host(self, array: Any) -> np.ndarray:
        """The other way round."""
        return array

    def index(self, items: np.ndarray) -> Any:
        """Numbers of items (k,), to index what users get."""
        return items

    def zeros(self, *shape: int) -> Any:
        """Zeros of this shape."""
        return np.zeros(shape)

    def final_infos(self, observations: Any, ended: np.ndarray, infos: dict[str, Any]) -> dict[str, Any]:
        """`final_infos`."""
        return final_infos(observations, ended, infos)


def final_infos(observations: np.ndarray, ended: np.ndarray, infos: dict[str, Any]) -> dict[str, Any]:
    """What the episodes that ended (n,) ended with, as Gymnasium's mode SameStep gives it: final_obs and final_info."""
    final = np.full(len(ended), None, dtype=object)
    for i in np.flatnonzero(ended):
        final[i] = observations[i].copy()
    return {"final_obs": final, "_final_obs": ended.copy(), "final_info": infos, "_final_info": ended.copy()}
