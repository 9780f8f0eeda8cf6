"""The line search of the rules that go far along one direction, for a stack of networks at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from classifier.trainers.objective import Objective, Point
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse


class Found(NamedTuple):
    """Where a search ended: the point, the step lengths (n,) and slopes (n,) there; a length of 0 means that
    nothing lower was found and the point is the old one.
    """

    point: Point
    length: Tensor
    slope: Tensor


class _Bracket(NamedTuple):
    """Step lengths, errors and slopes (n,) at both ends of the interval that holds the minimum; the low end
    is always lower than the start, the high end is infinite until something too far was tried.
    """

    low: Tensor
    low_error: Tensor
    low_slope: Tensor
    high: Tensor
    high_error: Tensor
    high_slope: Tensor


@dataclass(frozen=True)
class LineSearch:
    """Bracket, then bisection or cubic interpolation, until the strong conditions of Wolfe hold:

        E(a) <= E(0) + decrease · a · E′(0)    and    |E′(a)| <= flatness · |E′(0)|

    decrease  in (0, 1)
    flatness  in (decrease, 1); the smaller, the more exact the search
    trials    most evaluations in one search; then the lowest point with the first condition is taken

    A step that is too short moves the low end of the bracket, one that is too long or uphill the high end:
    such a bracket always holds a point that meets both conditions. Without a high end the step grows by the
    secant of the slopes, 2 to 10 times. Inside, the minimum of the cubic through both ends is tried, or the
    middle where the cubic has none or it lies within a tenth of an end.
    Sources: C. Charalambous, IEE Proc. G 139 (1992) 301–310 (the hybrid of bisection and cubic
    interpolation); P. Wolfe, SIAM Review 11 (1969) 226–235 (the conditions).
    """

    decrease: float = 1e-3
    flatness: float = 0.1
    trials: int = 20

    def check(self, owner: str) -> None:
        """Refuse numbers that break their rule, in the name of the rule that searches. Raises ParameterError."""
        check_number(owner, "decrease", self.decrease, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number(owner, "flatness", self.flatness, low=0.0, high=1.0, low_open=True, high_open=True)
        check_integer(owner, "trials", self.trials, low=1)
        if self.flatness <= self.decrease:
            raise refuse(owner, "flatness", f"> decrease = {self.decrease:g}", self.flatness)

    def search(self, at: Point, direction: Tensor, first: Tensor, objective: Objective) -> Found:
        """Search along directions (n, count) that lead downhill, from first trial lengths (n,)."""
        slope0 = (at.gradient * direction).sum(dim=1)
        length, best = torch.zeros_like(first), Point(*(part.clone() for part in at))
        slope = slope0.clone()
        infinite = torch.full_like(first, torch.inf)
        bracket = _Bracket(torch.zeros_like(first), at.error, slope0, infinite, infinite, infinite)
        rows, trial = torch.arange(len(first), device=first.device), first
        for _ in range(self.trials):
            tried = objective.evaluate(torch.addcmul(at.parameters[rows], trial[:, None], direction[rows]))
            start = slope0[rows]
            there = (tried.gradient * direction[rows]).sum(dim=1)
            # Written so that an error or slope that is not a number counts as too far.
            low_enough = tried.error <= at.error[rows] + self.decrease * trial * start
            too_short = low_enough & (there < self.flatness * start)
            done = low_enough & (there.abs() <= -self.flatness * start)
            better = done | (low_enough & (tried.error < best.error[rows]))
            for whole, part in zip((*best, length, slope), (*tried, trial, there), strict=True):
                whole[rows[better]] = part[better]

            longer = _secant(bracket, trial, there)
            bracket = _moved(bracket, trial, tried.error, there, too_short)
            trial = torch.where(bracket.high.isinf(), longer, _inside(bracket))
            # A bracket that rounding has closed has nothing left to try.
            going = ~done & (bracket.high - bracket.low > 1e-14 * trial)
            if not going.any():
                break
            rows, trial, bracket = rows[going], trial[going], _Bracket(*(part[going] for part in bracket))
        return Found(best, length, slope)


def _moved(bracket: _Bracket, trial: Tensor, error: Tensor, slope: Tensor, too_short: Tensor) -> _Bracket:
    """The bracket with its low end at the trial where that was too short, with its high end there elsewhere."""
    new = (trial, error, slope)
    low = [torch.where(too_short, a, b) for a, b in zip(new, bracket[:3], strict=True)]
    high = [torch.where(too_short, b, a) for a, b in zip(new, bracket[3:], strict=True)]
    return _Bracket(*low, *high)


def _secant(bracket: _Bracket, trial: Tensor, slope: Tensor) -> Tensor:
    """A longer step: where the line through the slopes at the low end and at the trial vanishes."""
    growth = (trial - bracket.low) * slope / (bracket.low_slope - slope)
    growth = torch.where(slope > bracket.low_slope, growth / trial, torch.inf)
    return trial * (1 + growth.clamp(1.0, 9.0))


def _inside(bracket: _Bracket) -> Tensor:
    """A step within the bracket: the minimum of the cubic through both ends, or the middle."""
    width = bracket.high - bracket.low
    low_slope, high_slope = bracket.low_slope * width, bracket.high_slope * width
    theta = low_slope + high_slope - 3 * (bracket.high_error - bracket.low_error)
    root = (theta * theta - low_slope * high_slope).sqrt()
    share = 1 - (high_slope + root - theta) / (high_slope - low_slope + 2 * root)
    # Not a number where the cubic has no minimum: that fails both comparisons.
    share = torch.where((share >= 0.1) & (share <= 0.9), share, 0.5)
    return bracket.low + share * width
