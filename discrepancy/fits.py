"""Sets of effects fitted to the end, each kept at the best place that was ever found for it."""

from __future__ import annotations

import functools
import math

import numpy as np

from discrepancy.fit import crossed, fit
from discrepancy.model import NONE, Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import CAUTION
from discrepancy.selection import Fitted, fitted_set, key_of

_CAREFUL, _SHORT, _LONG = 15, 6, 60
"""Steps of a fit that may lack what matters most, of one on the way, and of one that is compared."""

_BETWEEN = 10.0
"""Weight of the machine's priors between the race's and their own."""


class Fits:
    """The fits of a search.

    Parameters
    ----------
    whole : Model
    model : Model
        The part of it that is searched.
    """

    def __init__(self, whole: Model, model: Model) -> None:
        self.whole, self.model = whole, model
        self._library = model.hypotheses()
        self._best: dict[str, Fitted] = {}
        # a fitted set is its own key, by identity
        self._smaller: set[tuple[Fitted, int]] = set()
        self._whole: dict[Fitted, Fitted] = {}
        self._careful: dict[Fitted, Point] = {}

    @functools.cached_property
    def begun(self) -> Fitted:
        """The model as it came, where what is known of the machine has the weight that it has in a race."""
        problem = Problem(self.model, NONE, caution=CAUTION)
        z = np.zeros(len(problem.parameters))
        states = np.zeros((len(self.model.counts), self.model.local_count(NONE)))
        place = fit(problem, problem.searched(problem.point(z, states)), steps=_CAREFUL).place
        # its priors weigh more than those of any score, so that it is no optimum of one
        return fitted_set(self.model, place, True, 0.0, optimum=False)

    def fit(self, place: Point) -> Fitted:
        """A place fitted to the end, what is known of the machine losing its extra weight on the way."""
        known = self.known(place.hypothesis)
        if known is not None and known.place.cost <= self.own(place).cost:
            return known
        problem = Problem(self.model, place.hypothesis, caution=_BETWEEN)
        place = fit(problem, problem.adopted(place), steps=_SHORT).place
        problem = Problem(self.model, place.hypothesis)
        result = fit(problem, problem.adopted(place), steps=_LONG, thorough=True)
        return self.kept(result.place, result.converged)

    def careful(self, fitted: Fitted) -> Point:
        """A set's place where what is known of the machine has the weight that it has in a race."""
        if fitted not in self._careful:
            problem = Problem(self.model, fitted.place.hypothesis, caution=CAUTION)
            place = problem.adopted(fitted.place)
            # the model as it came was fitted so
            self._careful[fitted] = place if fitted is self.begun else fit(problem, place, steps=_SHORT).place
        return self._careful[fitted]

    def own(self, place: Point) -> Point:
        """A place of a race with the cost that it has outside, where priors have their own weight."""
        return Problem(self.model, place.hypothesis).adopted(place)

    def kept(self, place: Point, converged: bool) -> Fitted:
        """A fit, or a better one of the same set that was made before."""
        key = key_of(place.hypothesis)
        before = self._best.get(key)
        if before is None or place.cost < before.place.cost:
            price = self.price(place.hypothesis)
            self._best[key] = fitted_set(self.model, place, converged, price)
        return self._best[key]

    def known(self, hypothesis: Hypothesis) -> Fitted | None:
        """The best fit of a set so far."""
        return self._best.get(key_of(hypothesis))

    def price(self, hypothesis: Hypothesis) -> float:
        """What a set pays in its score: for its parameters, its choices, and what it sets free in every window."""
        samples = float(self.model.counts.sum())
        choices = [len(self._library.get(effect.name, (effect,))) for effect in hypothesis.effects]
        freed = len(self.model.counts) * self.model.freed(hypothesis)
        return len(hypothesis.parameters) * math.log(samples) + 2.0 * sum(math.log(m) for m in choices) + freed

    def without(self, fitted: Fitted, k: int) -> Fitted:
        """The set without its k-th effect, from the machine that it had with it: a poor fit of the smaller set must not
        make an effect look needed. Where that leads to no better place than is known, it is not followed to its end."""
        smaller = together(*fitted.effects[:k], *fitted.effects[k + 1 :])
        known = self.known(smaller)
        if known is None or (fitted, k) not in self._smaller:
            begun, problem = self.left_out(fitted, k), Problem(self.model, smaller)
            if known is not None:
                begun = fit(problem, begun, steps=_CAREFUL).place
            if known is None or known.place.cost - begun.cost > begun.dispersion(self.model):
                result = fit(problem, begun, steps=_LONG, thorough=True)
                if not begun.hypothesis.effects:
                    before = self.own(self.begun.place)
                    if before.cost < result.place.cost:
                        result = fit(problem, before, steps=_LONG, thorough=True)
                known = self.kept(result.place, result.converged)
            self._smaller.add((fitted, k))
        return known

    def left_out(self, fitted: Fitted, k: int) -> Point:
        """The set's place without its k-th effect, all else as it is but for the windows' start states."""
        place, effects = fitted.place, fitted.effects
        smaller = together(*effects[:k], *effects[k + 1 :])
        columns = len(self.model.parameters) + place.hypothesis.places(k)
        problem = Problem(self.model, smaller)
        states = self.model.states_for(smaller, place.states)
        return problem.searched(problem.point(np.delete(place.z, columns), states))

    def alike(self, place: Point, beside: Point, fitted: Fitted) -> Point:
        """A place whose last effect does what one of a set does: its own numbers fitted alone, all else as at the place
        `beside` without it, from the better one of its and the set's start states in each window."""
        others = len(beside.z)
        problem = Problem(self.model, place.hypothesis, held=range(others))
        z = np.concatenate([beside.z, place.z[others:]])
        states = self.model.states_for(place.hypothesis, beside.states)
        alone = fit(problem, problem.searched(problem.point(z, states)), steps=_CAREFUL).place
        return problem.pooled(alone, [fitted.place])

    def on_all(self, fitted: Fitted) -> Fitted:
        """A set fitted to all windows of all records. Those that it was fitted to before start as they did, the others
        where a grid or one of these says: dry friction leaves a resting table far from any grid."""
        if self.whole is self.model:
            return fitted
        if fitted not in self._whole:
            place, problem = fitted.place, Problem(self.whole, fitted.place.hypothesis)
            states, known = np.zeros((len(self.whole.counts), place.states.shape[1])), self.model.among(self.whole)
            states[known] = place.states
            begun = problem.searched(problem.point(place.z, states), np.setdiff1d(problem.all, known))
            result = fit(problem, begun, steps=_SHORT)
            whole = crossed(problem, result.place)
            self._whole[fitted] = fitted_set(self.whole, whole, fitted.converged, fitted.price)
        return self._whole[fitted]
