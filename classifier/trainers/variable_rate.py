"""What the two rules of gradient descent with a variable learning rate share; no rule itself."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.base import Step, Trainer
from classifier.trainers.objective import Point, RoomyObjective
from indexer_env.checks import check_number


class Memory(NamedTuple):
    """Previous change of the parameters (n, count), learning rate (n, 1), and room for the parameters and the gradient
    (n, count) of the next point.
    """

    change: Tensor
    rate: Tensor
    parameters: Tensor
    gradient: Tensor


@dataclass(frozen=True)
class VariableRate(Trainer):
    """Full-batch gradient descent, one learning rate per network.

        E_new > maximum_increase · E_old:  step undone, rate × rate_decrease, previous change forgotten
        E_new < E_old:                     step kept,   rate × rate_increase
        between the two:                   step kept,   rate as it was

    rate              learning rate at the start
    rate_increase     >= 1
    rate_decrease     in (0, 1)
    maximum_increase  >= 1, ratio of errors above which a step is undone
    """

    one_point: ClassVar[bool] = True
    first_order: ClassVar[bool] = True

    rate: float = 0.01
    rate_increase: float = 1.05
    rate_decrease: float = 0.7
    maximum_increase: float = 1.04

    def __post_init__(self) -> None:
        super().__post_init__()
        owner = type(self).__name__
        check_number(owner, "rate", self.rate, low=0.0, low_open=True)
        check_number(owner, "rate_increase", self.rate_increase, low=1.0)
        check_number(owner, "rate_decrease", self.rate_decrease, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number(owner, "maximum_increase", self.maximum_increase, low=1.0)

    @abstractmethod
    def change(self, gradient: Tensor, memory: Memory) -> Tensor:
        """Change of the parameters (n, count) to be tried, written over the previous one."""

    def begin(self, point: Point) -> Memory:
        """No previous change, the initial rate for every network."""
        rate = torch.full_like(point.error, self.rate)[:, None]
        change, parameters, gradient = (torch.zeros_like(point.parameters) for _ in range(3))
        return Memory(change, rate, parameters, gradient)

    def step(self, at: Point, memory: Memory, objective: RoomyObjective) -> Step:
        """One epoch of the rule; a network whose step is undone stays where it was.

        Numbers of a whole stack are written over those of the point before the last, as fresh memory is first cleared
        by the system.
        """
        change = self.change(at.gradient, memory)
        parameters = torch.add(at.parameters, change, out=memory.parameters)
        tried = objective.evaluate(parameters, memory.gradient)
        undone = ~(tried.error <= self.maximum_increase * at.error)
        # Multiplied tensor by tensor: a factor chosen between two Python numbers would be a float32.
        lower = (tried.error < at.error)[:, None]
        rate = torch.where(lower, memory.rate * self.rate_increase, memory.rate)
        if undone.any():
            for new, old in zip(tried, at, strict=True):
                new[undone] = old[undone]
            change[undone] = 0.0
            rate = torch.where(undone[:, None], memory.rate * self.rate_decrease, rate)
        return Step(tried, Memory(change, rate, at.parameters, at.gradient), torch.zeros_like(undone))
