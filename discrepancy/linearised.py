"""What starts of an effect promise: each is simulated at full size, and all that was fitted so far is moved by its own
linearisation, as far as its priors allow. Unlike a sensitivity at size zero this sees effects that begin at a threshold
or saturate."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.arrow import Slopes
from discrepancy.model import Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem

_DAMPING = 1e-2

_CHUNK = 24
"""Starts simulated in one call: enough to fill the cores, few enough to stay in memory."""


@dataclass(frozen=True, eq=False)
class Start:
    """A place from which a set with one more effect may be fitted.

    Attributes
    ----------
    effect : Hypothesis
        The effect that is added.
    values : tuple of float
        Its parameters [units].
    place : Point
        Of the whole set; its cost, which is promised, in the units of one race.
    """

    effect: Hypothesis
    values: tuple[float, ...]
    place: Point

    @functools.cached_property
    def rungs(self) -> np.ndarray:
        """Places (k,) of the values in the library's lists."""
        columns = zip(*self.effect.starts, strict=True)
        pairs = zip(columns, self.values, strict=True)
        return np.array([np.searchsorted(sorted(set(column)), v - 1e-9 * abs(v)) for column, v in pairs])

    def smaller(self, other: Start) -> bool:
        """Whether it differs from another one in size alone, or little else, and lies between that and none."""
        own, size = self.values[0], other.values[0]
        return 0.0 <= own * size < size**2 and bool((np.abs(self.rungs - other.rungs)[1:] <= 1).all())

    def beside(self, other: Start) -> bool:
        """Whether two starts stand side by side in every list of one effect."""
        same = self.effect.name == other.effect.name and self.effect.fixed == other.effect.fixed
        return same and bool((np.abs(self.rungs - other.rungs) <= 1).all())


class Linearised:
    """A set of effects at a fitted place, to which one more is added.

    Parameters
    ----------
    model : Model
    base : Point
    caution : float
        As of `Problem`.
    """

    def __init__(self, model: Model, base: Point, caution: float) -> None:
        self.model, self.base = model, base
        self.problem = Problem(model, base.hypothesis, caution=caution).eased(base)
        self.grid = model.state_grid(base.hypothesis, base.z)
        self.residual, *slopes = self.problem.linearised(base)
        self.slopes = Slopes(*slopes)

    def joint(self, effect: Hypothesis) -> Problem:
        """The set with one more effect, its cost in the units of this race."""
        problem = Problem(self.model, together(self.base.hypothesis, effect))
        problem.ease = self.problem.ease
        return problem

    def starts(self, effect: Hypothesis, values: Sequence[tuple[float, ...]]) -> list[Start]:
        """Starts of an effect at some values of its parameters."""
        problem = self.joint(effect)
        found = []
        for first in range(0, len(values), _CHUNK):
            some = values[first : first + _CHUNK]
            z = np.array([np.concatenate([self._making_room(effect, v), effect.coordinates(v)]) for v in some])
            states = np.repeat(self.model.states_for(problem.hypothesis, self.base.states)[None], len(z), axis=0)
            if states.shape[2] > self.base.states.shape[1]:
                # the linearisation does not know these states, so they are refined beforehand
                states = problem.settled_together(z, states)
            if not np.array_equal(self.model.state_grid(problem.hypothesis, z[0]), self.grid):
                # windows start elsewhere, in another play, than any small change of the fitted states
                states, _ = problem.started(z, states, problem.all)
            places = self._moved(problem, z, states, problem.residuals(z, states))
            found += [Start(effect, v, place) for v, place in zip(some, places, strict=True)]
        return found

    def _making_room(self, effect: Hypothesis, values: Sequence[float]) -> np.ndarray:
        """All that was fitted so far (g,), but for the stiffness with which the effect is a compliance in series: as
        much stiffer as leaves the compliance of both what it was, for that is what a fit without the effect has found.
        """
        z = self.base.z.copy()
        for k, p in enumerate(self.model.parameters):
            if p.name == effect.series:
                rest = max(1.0 / p.value(z[k]) - values[0], 1.0 / p.high)
                z[k] = p.coordinate(1.0 / rest)
        return z

    def _moved(self, problem: Problem, z: np.ndarray, states: np.ndarray, residuals: np.ndarray) -> list[Point]:
        """Places (k, g), (k, w, l) with residuals (k, w, n) after what was fitted so far has moved by its own
        linearisation, with the costs that it promises."""
        own, known = self.problem, self.base.z.shape[0]
        base = z[:, :known]
        at_rest, pulls = np.einsum("kwn,kwn->kw", residuals, residuals), self.slopes.pulls(residuals)
        weights = own.weights(at_rest)
        for _ in range(2):
            system = own.informed(self.slopes.arrow(pulls, weights), base)
            curved = np.diagonal(system.A, axis1=-2, axis2=-1) > 1e-12
            step, local = system.step(_DAMPING, own.movable & curved)
            step = np.clip(base + step, own.low, own.high) - base
            squares = self.slopes.squares(at_rest, pulls, step, local)
            weights = own.weights(squares)
        z, states = z.copy(), states.copy()
        z[:, :known] += step
        states[:, :, : local.shape[-1]] += local
        promised = own.losses(squares).sum(axis=1) + own.prior(base + step)
        rows = zip(z, states, squares, promised.tolist(), strict=True)
        return [Point(problem.hypothesis, *row) for row in rows]


def neighbours(value: float, ladder: Sequence[float]) -> list[float]:
    """Values halfway from `value` to the next ones of a ladder, in proportion where both have one sign; beside a single
    one lie 0.7 and 1.4 of it."""
    if len(ladder) < 2:
        return [value * 0.5**0.5, value * 2.0**0.5]
    own = min(range(len(ladder)), key=lambda k: abs(ladder[k] - value))
    others = [*ladder[max(0, own - 1) : own], *ladder[own + 1 : own + 2]]
    return [value * (other / value) ** 0.5 if value * other > 0.0 else (value + other) / 2.0 for other in others]
