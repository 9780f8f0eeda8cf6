"""Resilient back-propagation (paper fig. 9, "trainrp")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.base import Step, Trainer
from classifier.trainers.objective import Objective, Point
from indexer_env.checks import check_number
from indexer_env.errors import refuse


class _Memory(NamedTuple):
    """Step sizes, last changes and last gradients, each (n, count)."""

    size: Tensor
    change: Tensor
    gradient: Tensor


@dataclass(frozen=True)
class TrainRp(Trainer):
    """Each parameter has a step size of its own and goes by the sign of its derivative alone:

        sign as before:   size × size_increase, step against the sign
        sign has changed: size × size_decrease, last step undone, derivative counted as 0 in the next epoch
        derivative 0 before or now: size as it was, step against the sign

    size           first step size
    size_increase  >= 1
    size_decrease  in (0, 1)
    minimum_size, maximum_size  bounds of the step size

    Source: M. Riedmiller, H. Braun, Proc. IEEE Int. Conf. on Neural Networks (1993) 586–591. The first step
    size is that documented for MATLAB's trainrp (0.07; in the source 0.1), the other numbers stand in both.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "trainrp"
    one_point: ClassVar[bool] = True
    first_order: ClassVar[bool] = True
    in_span: ClassVar[bool] = False

    size: float = 0.07
    size_increase: float = 1.2
    size_decrease: float = 0.5
    minimum_size: float = 1e-6
    maximum_size: float = 50.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("TrainRp", "minimum_size", self.minimum_size, low=0.0, low_open=True)
        check_number("TrainRp", "maximum_size", self.maximum_size, low=0.0, low_open=True)
        check_number("TrainRp", "size", self.size, low=0.0, low_open=True)
        if not self.minimum_size <= self.size <= self.maximum_size:
            rule = f"between minimum_size = {self.minimum_size:g} and maximum_size = {self.maximum_size:g}"
            raise refuse("TrainRp", "size", rule, self.size)
        check_number("TrainRp", "size_increase", self.size_increase, low=1.0)
        check_number("TrainRp", "size_decrease", self.size_decrease, low=0.0, high=1.0, low_open=True, high_open=True)

    def begin(self, point: Point) -> _Memory:
        """The first step size for all parameters."""
        zero = torch.zeros_like(point.parameters)
        return _Memory(torch.full_like(zero, self.size), zero, zero)

    def step(self, at: Point, memory: _Memory, objective: Objective) -> Step:
        """One epoch of the rule; the error may rise."""
        agreement = at.gradient * memory.gradient
        turned = agreement < 0
        size = torch.where(agreement > 0, memory.size * self.size_increase, memory.size)
        size = torch.where(turned, memory.size * self.size_decrease, size)
        size = size.clamp(self.minimum_size, self.maximum_size)
        change = torch.where(turned, -memory.change, -at.gradient.sign() * size)
        gradient = torch.where(turned, 0.0, at.gradient)
        point = objective.evaluate(at.parameters + change)
        return Step(point, _Memory(size, change, gradient), torch.zeros_like(point.error, dtype=torch.bool))
