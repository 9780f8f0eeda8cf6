"""The size at which something leaves what was drawn for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from indexer_env.errors import ParameterError, SimulationError

_CLOSE = 0.1
"""Relative error of a level at which its size is settled."""

_ROUNDS, _FARTHEST = 8, 30.0
"""Most trials of a size, and the largest factor between two of them."""

_STEEPEST = 3.0
"""Power of its size with which a level may grow from one trial to the next."""

_NEAR = 0.25
"""Relative error of a level at which a size is settled for which the machine has been fitted: each trial takes long."""


class LevelOf(Protocol):
    """What a size leaves."""

    def __call__(self, size: Any, /, *, straight: bool = False) -> float: ...


def settled(level: LevelOf, first: float, target: float, most: float = math.inf) -> tuple[float, float] | None:
    """The size at which a level is the target's within `_NEAR`, and the level; None where there is none.

    It is sought from the size on that linear theory gives: what is left of a loose base grows steeply from the size on
    that no machine within its bounds makes up for, and is next to nothing below.
    """
    straight = sought(lambda size: level(size, straight=True), first, target, most)
    return None if straight is None else sought(level, straight[0], target, most, _NEAR)


def sought(
    level: Callable[[float], float], first: float, target: float, most: float = math.inf, close: float = _CLOSE
) -> tuple[float, float] | None:
    """The size at which a level is the target's within `close`, and the level; None where there is none.

    Sizes are taken in proportion to the level, then by the secant of their logarithms. A size that breaks a range or
    the machine counts as too large.
    """
    size, known, too_large = min(first, most), [], math.inf
    for _ in range(_ROUNDS):
        try:
            reached = level(size)
        except (ParameterError, SimulationError):
            too_large = min(too_large, size)
            size = math.sqrt(size * known[-1][0]) if known else size / 4.0
            continue
        if abs(reached / target - 1.0) <= close:
            return size, reached
        known.append((size, reached))
        slope = 1.0
        if len(known) > 1 and known[-1][0] != known[-2][0]:
            (s0, l0), (s1, l1) = known[-2:]
            slope = min(max(math.log(max(l1, 1e-12) / max(l0, 1e-12)) / math.log(s1 / s0), 0.3), _STEEPEST)
        factor = (target / max(reached, 1e-12)) ** (1.0 / slope)
        new = min(size * min(max(factor, 1.0 / _FARTHEST), _FARTHEST), most)
        if new >= too_large:
            new = math.sqrt(size * too_large)
        if new == size:
            return None
        size = new
    return None
