"""What the three rules of conjugate gradients share; no rule itself."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from classifier.trainers.descent import Descent, Searched, Turn, same_decrease
from classifier.trainers.objective import Point


class Own(NamedTuple):
    """Searches (n,) since the last steepest descent."""

    searches: Tensor


@dataclass(frozen=True)
class ConjugateGradient(Descent):
    """Directions conjugate to the last one on a quadratic error:

        d_new = −g_new + β d_old

    After as many searches as there are parameters, d = −g again. The parameters are those of `Descent`.
    """

    @abstractmethod
    def beta(self, old: Tensor, new: Tensor) -> Tensor:
        """β (n,) from the old and new gradients (n, count)."""

    def start(self, point: Point) -> Own:
        """No search yet."""
        return Own(torch.zeros_like(point.error))

    def turn(self, searched: Searched, own: Own) -> Turn:
        """The direction of the formula, or steepest descent after a whole round."""
        searches = own.searches + 1
        whole = searches >= searched.direction.shape[1]
        beta = torch.where(whole, 0.0, self.beta(searched.old.gradient, searched.new.gradient))
        direction = torch.addcmul(-searched.new.gradient, beta[:, None], searched.direction)
        return Turn(direction, same_decrease(searched, direction), Own(torch.where(whole, 0.0, searches)))

    def forget(self, own: Own, rows: Tensor) -> Own:
        """A new round."""
        return Own(torch.where(rows, 0.0, own.searches))
