"""What the rules that search along a line share: conjugate gradients and quasi-Newton; no rule itself."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.base import Step, Trainer
from classifier.trainers.line_search import LineSearch
from classifier.trainers.objective import Objective, Point
from indexer_env.checks import check_number


class Turn(NamedTuple):
    """Where a network goes next: the direction (n, count), the first trial length of the search (n,), and
    what the rule itself remembers.
    """

    direction: Tensor
    first: Tensor
    own: Any


class Searched(NamedTuple):
    """A finished search: old and new point, the direction (n, count) between them, the length (n,) along it
    and the slopes (n,) at both ends.
    """

    old: Point
    new: Point
    direction: Tensor
    length: Tensor
    old_slope: Tensor
    new_slope: Tensor


class Memory(NamedTuple):
    """The turn to be taken, and whether it is steepest descent (n,)."""

    turn: Turn
    steepest: Tensor


@dataclass(frozen=True)
class Descent(Trainer):
    """One line search per epoch, along a direction made from the last ones.

    first_step                  length of the first trial step along a steepest descent, in the space of the
                                parameters
    decrease, flatness, trials  of the line search, see `LineSearch`

    Where a direction does not lead downhill, or the search along it finds nothing lower, the rule begins
    again with steepest descent; where that finds nothing lower either, the network is stuck.
    """

    first_step: float = 0.1
    decrease: float = LineSearch.decrease
    flatness: float = LineSearch.flatness
    trials: int = LineSearch.trials

    def __post_init__(self) -> None:
        super().__post_init__()
        owner = type(self).__name__
        check_number(owner, "first_step", self.first_step, low=0.0, low_open=True)
        self.line_search.check(owner)

    @property
    def line_search(self) -> LineSearch:
        """The search with this rule's numbers."""
        return LineSearch(self.decrease, self.flatness, self.trials)

    @abstractmethod
    def start(self, point: Point) -> Any:
        """What the rule itself remembers before the first step: a NamedTuple of tensors with first axis n."""

    @abstractmethod
    def turn(self, searched: Searched, own: Any) -> Turn:
        """Next direction of each network; rows that have not moved are not used."""

    @abstractmethod
    def forget(self, own: Any, rows: Tensor) -> Any:
        """What the rule remembers, as at the start in the rows of a mask (n,)."""

    def begin(self, point: Point) -> Memory:
        """Steepest descent."""
        turn = Turn(-point.gradient, self._first(point), self.start(point))
        return Memory(turn, torch.ones_like(point.error, dtype=torch.bool))

    def _first(self, point: Point) -> Tensor:
        return self.first_step / point.gradient.norm(dim=1).clamp_min(1e-300)

    def step(self, at: Point, memory: Memory, objective: Objective) -> Step:
        """One line search, then the next direction."""
        direction, first, own = memory.turn
        found = self.line_search.search(at, direction, first, objective)
        new, moved = found.point, found.length > 0
        searched = Searched(at, new, direction, found.length, (at.gradient * direction).sum(dim=1), found.slope)
        turn = self.turn(searched, own)
        slope = (new.gradient * turn.direction).sum(dim=1)
        downhill = slope < -1e-10 * new.gradient.norm(dim=1) * turn.direction.norm(dim=1)
        steepest = ~(downhill & moved)
        direction = torch.where(steepest[:, None], -new.gradient, turn.direction)
        first = torch.where(steepest, self._first(new), turn.first)
        own = self.forget(turn.own, steepest) if steepest.any() else turn.own
        return Step(new, Memory(Turn(direction, first, own), steepest), ~moved & memory.steepest)


def same_decrease(searched: Searched, direction: Tensor) -> Tensor:
    """First trial length (n,) along a new direction that promises, to first order, the last decrease."""
    slope = (searched.new.gradient * direction).sum(dim=1)
    return searched.length * (searched.old_slope / slope).clamp(0.01, 100.0)
