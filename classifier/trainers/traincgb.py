"""Conjugate gradients with the restarts of Powell and Beale (paper fig. 9, "traincgb")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.descent import Descent, Searched, Turn, same_decrease
from classifier.trainers.objective import Point


class _Own(NamedTuple):
    """The direction d_t (n, count) of the last restart, the change y_t (n, count) of the gradient along it,
    and searches (n,) since then; 0 searches: none yet.
    """

    direction: Tensor
    change: Tensor
    searches: Tensor


@dataclass(frozen=True)
class TrainCgb(Descent):
    """Beale's directions, restarted by Powell's tests without a return to steepest descent:

        d_new = −g_new + β d_old + γ d_t,   β = g_new·y / d_old·y,   γ = g_new·y_t / d_t·y_t,
        y = g_new − g_old

    t is the search of the last restart; γ = 0 in the search after it. The last search becomes t
    - where successive gradients are far from orthogonal, |g_old·g_new| >= 0.2 |g_new|²,
    - after as many searches as there are parameters,
    - where d_new·g_new lies outside −1.2 |g_new|² … −0.8 |g_new|².

    The parameters are those of `Descent`.
    Source: M. J. D. Powell, Mathematical Programming 12 (1977) 241–254 (restarts); E. M. L. Beale in
    F. A. Lootsma (ed.), Numerical Methods for Non-linear Optimization (1972) 39–43 (directions).

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traincgb"

    def start(self, point: Point) -> _Own:
        """No restart yet."""
        zero = torch.zeros_like(point.parameters)
        return _Own(zero, zero, torch.zeros_like(point.error))

    def turn(self, searched: Searched, own: _Own) -> Turn:
        """The direction of three terms, or of two after a restart."""
        new, last = searched.new.gradient, searched.direction
        change = new - searched.old.gradient
        length2 = new.square().sum(dim=1)
        two = torch.addcmul(-new, (_dot(new, change) / _dot(last, change))[:, None], last)
        gamma = _dot(new, own.change) / _dot(own.direction, own.change)
        three = torch.addcmul(two, gamma[:, None], own.direction)
        slope = _dot(three, new)
        restart = (
            (own.searches == 0)
            | (own.searches >= last.shape[1])
            | (_dot(searched.old.gradient, new).abs() >= 0.2 * length2)
            | ~((slope >= -1.2 * length2) & (slope <= -0.8 * length2))
        )
        rows = restart[:, None]
        direction = torch.where(rows, two, three)
        own = _Own(
            torch.where(rows, last, own.direction),
            torch.where(rows, change, own.change),
            torch.where(restart, 0.0, own.searches) + 1,
        )
        return Turn(direction, same_decrease(searched, direction), own)

    def forget(self, own: _Own, rows: Tensor) -> _Own:
        """No restart yet, in these rows."""
        return own._replace(searches=torch.where(rows, 0.0, own.searches))


def _dot(a: Tensor, b: Tensor) -> Tensor:
    return (a * b).sum(dim=1)
