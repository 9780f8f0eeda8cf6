"""Gradient descent with momentum and a learning rate that varies: the rule the paper chose (§4.2,
"traingdx").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.base import Point, Trainer
from indexer_env.checks import check_number


class _Memory(NamedTuple):
    """Previous change of the parameters (n, count) and learning rate (n, 1)."""

    change: Tensor
    rate: Tensor


@dataclass(frozen=True)
class TrainGdx(Trainer):
    """Full-batch gradient descent with momentum and variable learning rate, one rate per network.

        change = momentum · previous change − momentum · rate · ∂E/∂parameters
        E_new > maximum_increase · E_old:  step undone, rate × rate_decrease, previous change forgotten
        E_new < E_old:                     step kept,   rate × rate_increase
        between the two:                   step kept,   rate as it was

    rate              learning rate at the start
    momentum          share of the previous change that lives on, and factor of the gradient, in [0, 1]
    rate_increase     >= 1
    rate_decrease     in (0, 1)
    maximum_increase  >= 1, ratio of errors above which a step is undone

    E is the mean square error over records and outputs. Its gradient is small at the start and the rate grows
    by 5 % an epoch until steps start to fail: the first hundred epochs or so are this run-up.
    Sources: T. P. Vogl et al., Biological Cybernetics 59 (1988) 257–263 (the rule); default numbers and the
    factor of the gradient as documented for MATLAB's traingdx.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traingdx"

    rate: float = 0.01
    momentum: float = 0.9
    rate_increase: float = 1.05
    rate_decrease: float = 0.7
    maximum_increase: float = 1.04

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("TrainGdx", "rate", self.rate, low=0.0, low_open=True)
        check_number("TrainGdx", "momentum", self.momentum, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number("TrainGdx", "rate_increase", self.rate_increase, low=1.0)
        check_number("TrainGdx", "rate_decrease", self.rate_decrease, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number("TrainGdx", "maximum_increase", self.maximum_increase, low=1.0)

    def begin(self, point: Point) -> _Memory:
        """No previous change, the initial rate for every network."""
        rate = torch.full((len(point.error), 1), self.rate, dtype=point.error.dtype)
        return _Memory(torch.zeros_like(point.parameters), rate)

    def step(self, at: Point, memory: _Memory, evaluate: Callable[[Tensor], Point]) -> tuple[Point, _Memory]:
        """One epoch of the rule; a network whose step is undone stays where it was."""
        change = self.momentum * memory.change - self.momentum * memory.rate * at.gradient
        tried = evaluate(at.parameters + change)
        undone = (tried.error > self.maximum_increase * at.error)[:, None]
        lower = (tried.error < at.error)[:, None]
        point = Point(
            torch.where(undone, at.parameters, tried.parameters),
            torch.where(undone[:, 0], at.error, tried.error),
            torch.where(undone, at.gradient, tried.gradient),
        )
        # Multiplied tensor by tensor: a factor chosen between two Python numbers would be a float32.
        rate = torch.where(lower, memory.rate * self.rate_increase, memory.rate)
        rate = torch.where(undone, memory.rate * self.rate_decrease, rate)
        return point, _Memory(torch.where(undone, 0.0, change), rate)
