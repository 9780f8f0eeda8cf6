"""Where a hypothesis's fit should begin: every start of the library tried at once around the calibrated base model.

For each start the effect is simulated at full size, and base parameters and window states are moved by the base model's
own linearisation as far as their priors allow. What is left is the cost by which starts are ranked; unlike a
sensitivity at size zero it sees effects that begin at a threshold or saturate.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.arrow import Slopes
from discrepancy.model import NONE, Hypothesis, Model
from discrepancy.problem import Point, Problem

_DAMPING = 1e-2
_SHARES = (0.5, 0.25)
"""Shares of the way to the next start of the library at which a start is looked for more closely, round by round."""

_TURNED = tuple(k / 6 for k in range(1, 13))
"""Moves, in places of the library's list, at which the other sign of an effect is looked at."""

_CHUNK = 24
"""Starts simulated in one call: enough to fill the cores, few enough to stay in memory."""


@dataclass(frozen=True, eq=False)
class Start:
    """A place from which a hypothesis may be fitted, and the cost that the linearisation promises there."""

    hypothesis: Hypothesis
    place: Point
    promised: float

    @property
    def values(self) -> tuple[float, ...]:
        """The effect's parameters [units]."""
        return self.place.values

    @functools.cached_property
    def rungs(self) -> np.ndarray:
        """Places (k,) of the values in the library's lists."""
        columns = zip(*self.hypothesis.starts, strict=True)
        pairs = zip(columns, self.values, strict=True)
        return np.array([np.searchsorted(sorted(set(column)), v - 1e-9 * abs(v)) for column, v in pairs])


class Scanner:
    """The linearised base model at its calibrated place."""

    def __init__(self, model: Model, base: Point, caution: float) -> None:
        self.model, self.base = model, base
        self.problem = Problem(model, NONE, caution=caution).eased(base)
        self.grid = model.state_grid(NONE, base.z)
        self.slopes = Slopes(*self.problem.linearised(base)[1:])

    def gain(self, start: Start) -> float:
        """How much less than the base model's the cost is that a start promises."""
        return self.problem.adopted(self.base).cost - start.promised

    def starts(self, hypothesis: Hypothesis) -> list[Start]:
        """All starts of a hypothesis, best first by what the linearisation promises."""
        return self._tried(hypothesis, hypothesis.starts)

    def unmoved(self, hypothesis: Hypothesis, values: tuple[float, ...]) -> Start:
        """A start beside the base model's machine, what belongs to single records at 0; it promises what it costs."""
        problem = Problem(self.model, hypothesis)
        base = np.where(self.problem.of_machine, self.base.z, 0.0)
        states = self.model.states_for(hypothesis, self.base.states)
        place = problem.point(np.concatenate([base, hypothesis.coordinates(values)]), states)
        return Start(hypothesis, place, place.cost)

    def sharpened(self, start: Start) -> Start:
        """A start, its parameters moved one at a time halfway to their neighbours in the library's list as long as that
        promises more."""
        hypothesis = start.hypothesis
        ladders = [sorted(set(column)) for column in zip(*hypothesis.starts, strict=True)]
        for share in _SHARES:
            values = start.values
            nearby = []
            for k, ladder in enumerate(ladders):
                for other in neighbours(values[k], ladder, share):
                    nearby.append((*values[:k], other, *values[k + 1 :]))
            start = min([start, *self._tried(hypothesis, tuple(nearby))], key=lambda s: s.promised)
        return start

    def turned(self, place: Point) -> list[Start]:
        """Starts with the other sign than a place reached by a fit and one more parameter moved, best first; none where
        an effect has one sign. Half a period of the ringing off, the other sign looks alike."""
        hypothesis = place.hypothesis
        if min(start[0] for start in hypothesis.starts) >= 0.0:
            return []
        size, *values = place.values
        ladders = [sorted(set(column)) for column in zip(*hypothesis.starts, strict=True)][1:]
        nearby = [
            (-size, *values[:k], min(max(other, parameter.low), parameter.high), *values[k + 1 :])
            for k, (ladder, parameter) in enumerate(zip(ladders, hypothesis.parameters[1:], strict=True))
            for share in _TURNED
            for other in neighbours(values[k], ladder, share)
        ]
        return self._tried(hypothesis, tuple(nearby))

    def _tried(self, hypothesis: Hypothesis, starts: tuple[tuple[float, ...], ...]) -> list[Start]:
        problem = Problem(self.model, hypothesis)
        found = []
        for first in range(0, len(starts), _CHUNK):
            values = starts[first : first + _CHUNK]
            z = np.array([np.concatenate([self.base.z, hypothesis.coordinates(v)]) for v in values])
            states = np.repeat(self.model.states_for(hypothesis, self.base.states)[None], len(z), axis=0)
            if states.shape[2] > self.base.states.shape[1]:
                # the base model's linearisation does not know these states, so they are refined beforehand
                states = problem.settled_together(z, states)
            if not np.array_equal(self.model.state_grid(hypothesis, z[0]), self.grid):
                # windows start elsewhere, in another play, than any small change of the base model's states
                states = np.stack([problem.searched(place).states for place in problem.points(z, states)])
            residuals = problem.residuals(z, states)
            found += [self._start(problem, z[k], states[k], residuals[k]) for k in range(len(z))]
        return sorted(found, key=lambda start: start.promised)

    def _start(self, problem: Problem, z: np.ndarray, states: np.ndarray, residual: np.ndarray) -> Start:
        count = len(self.base.z)
        at_rest, pulls = np.einsum("wn,wn->w", residual, residual), self.slopes.pulls(residual)
        weights = self.problem.weights(at_rest)
        for _ in range(2):
            system = self.problem.informed(self.slopes.arrow(pulls, weights), self.base.z)
            step, local = system.step(_DAMPING, self.problem.movable & (np.diag(system.A) > 1e-12))
            step = np.clip(self.base.z + step, self.problem.low, self.problem.high) - self.base.z
            squares = self.slopes.squares(at_rest, pulls, step, local)
            weights = self.problem.weights(squares)
        promised = self.problem.cost(squares) + self.problem.prior(self.base.z + step)
        moved = z.copy()
        moved[:count] += step
        states = states.copy()
        states[:, : local.shape[1]] += local
        place = Point(problem.hypothesis, moved, states, squares, promised)
        return Start(problem.hypothesis, place, promised)


def apart(starts: Sequence[Start], count: int) -> list[Start]:
    """The first `count` starts of an effect of which no two stand side by side in the library's lists."""
    found: list[Start] = []
    for start in starts:
        if len(found) == count:
            break
        if not any(beside(start, other, 1) for other in found):
            found.append(start)
    return found


def beside(a: Start, b: Start, places: int, first: int = 0) -> bool:
    """Whether two starts of an effect lie within so many places in each of the library's lists, from the parameter
    `first` on."""
    return a.hypothesis.fixed == b.hypothesis.fixed and bool((np.abs(a.rungs - b.rungs)[first:] <= places).all())


def neighbours(value: float, ladder: list[float], share: float) -> list[float]:
    """Values a share of the way from `value` to the next ones of a ladder, which goes on beyond its ends; in proportion
    where both have one sign. The rung that `value` is nearest to is its own; beside a single one lie half and
    twice it."""
    if len(ladder) < 2:
        return [value * 0.5**share, value * 2.0**share]
    own = min(range(len(ladder)), key=lambda k: abs(ladder[k] - value))
    below, above = ladder[:own], ladder[own + 1 :]
    found = []
    for other in [below[-1] if below else _beyond(value, ladder[::-1]), above[0] if above else _beyond(value, ladder)]:
        steady = value * other > 0.0
        found.append(value * (other / value) ** share if steady else value + share * (other - value))
    return found


def _beyond(value: float, ladder: list[float]) -> float:
    """What would follow `value` where the ladder ends with it: its last step once more."""
    last, before = ladder[-1], ladder[-2]
    return value * last / before if value * last > 0.0 and last * before > 0.0 else value + last - before
