"""One-step secant: quasi-Newton that remembers one step (paper fig. 9, "trainoss")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from classifier.trainers.conjugate_gradient import Own
from classifier.trainers.descent import Descent, Searched, Turn, same_decrease
from classifier.trainers.objective import Point


@dataclass(frozen=True)
class TrainOss(Descent):
    """The BFGS direction of a matrix that was the unit matrix one step ago:

        d = −g + A s + B y,   s = step,   y = change of the gradient
        B = s·g / s·y,   A = y·g / s·y − (1 + y·y / s·y) B

    After as many searches as there are parameters, d = −g again. The parameters are those of `Descent`.
    Source: R. Battiti, Neural Computation 4 (1992) 141–166.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "trainoss"

    flatness: float = 0.9

    def start(self, point: Point) -> Own:
        """No search yet."""
        return Own(torch.zeros_like(point.error))

    def turn(self, searched: Searched, own: Own) -> Turn:
        """The direction of the formula, or steepest descent after a whole round."""
        gradient = searched.new.gradient
        s = searched.length[:, None] * searched.direction
        y = gradient - searched.old.gradient
        sy, sg, yg, yy = ((a * b).sum(dim=1) for a, b in ((s, y), (s, gradient), (y, gradient), (y, y)))
        searches = own.searches + 1
        whole = searches >= gradient.shape[1]
        b = torch.where(whole, 0.0, sg / sy)
        a = torch.where(whole, 0.0, yg / sy - (1 + yy / sy) * sg / sy)
        direction = a[:, None] * s + b[:, None] * y - gradient
        return Turn(direction, same_decrease(searched, direction), Own(torch.where(whole, 0.0, searches)))

    def forget(self, own: Own, rows: Tensor) -> Own:
        """A new round."""
        return Own(torch.where(rows, 0.0, own.searches))
