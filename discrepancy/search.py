"""Stepwise selection of the set of effects that a model lacks: add, drop, exchange, each time everything fitted anew.

    score = Σ_w ρ_w / D + Σ_known z² + Σ_effects (k ln N + 2 ln m)

with the Cauchy loss ρ of `problem`, k parameters and m discrete choices of an effect, N samples and the dispersion D of
the best set compared: the median mean square of its windows, at least 1, times the integrated autocorrelation time of
what it leaves (quasi-likelihood with an effective number of samples). The score is the Bayesian information criterion
under that dispersion. An effect enters by the race for starts, and stays while leaving it out costs the margin.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.dispersion import dispersion_of
from discrepancy.fit import fit
from discrepancy.model import NONE, Hypothesis, Model, together
from discrepancy.problem import Point, Problem
from discrepancy.race import CAUTION, race

_log = logging.getLogger(__name__)

_CAREFUL, _SHORT, _LONG = 15, 6, 60
"""Steps of a fit that may lack what matters most, of one on the way, and of one that is compared."""

_BETWEEN = 10.0
"""Weight of the machine's priors between the race's and their own."""

_HALF_WAY = 0.5
"""Share of the best effect's gain below which another one is no rival, once the best one is down at the noise."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A set of effects fitted to the end.

    Attributes
    ----------
    place : Point
    converged : bool
    price : float
        Of the parameters and choices of its effects.
    """

    place: Point
    converged: bool
    price: float

    @property
    def effects(self) -> tuple[Hypothesis, ...]:
        return self.place.hypothesis.effects

    @property
    def name(self) -> str:
        return self.place.hypothesis.name


@dataclass(frozen=True, eq=False)
class Selection:
    """The set selected and all that it was compared with.

    Attributes
    ----------
    base : Fitted
        The model as it came.
    best : Fitted
        The set selected; the base where none was.
    without : tuple of Fitted
        For each effect of the best set the set without it.
    instead : tuple of tuple of Fitted
        For each effect of the best set those with another one in its place, the best first.
    tried : tuple of Fitted
        What the last round would have added and did not.
    dispersion : float
        D.
    complete : bool
        False where the time ran out before the search ended.
    model : Model
        With the part of the records that was searched.
    """

    base: Fitted
    best: Fitted
    without: tuple[Fitted, ...]
    instead: tuple[tuple[Fitted, ...], ...]
    tried: tuple[Fitted, ...]
    dispersion: float
    complete: bool

    model: Model

    def other(self, fitted: Fitted, k: int) -> str:
        """Name of the effect that a set has instead of the k-th of the best one."""
        kept = {name for j, name in enumerate(self.best.place.hypothesis.names) if j != k}
        return next(name for name in reversed(fitted.place.hypothesis.names) if name not in kept)

    def gap(self, fitted: Fitted) -> float:
        """By how much a set scores worse than the best one."""
        return score(fitted, self.model, self.dispersion) - score(self.best, self.model, self.dispersion)


def score(fitted: Fitted, model: Model, dispersion: float) -> float:
    """Score of a set under a dispersion, lower is better."""
    problem = Problem(model, fitted.place.hypothesis)
    return problem.deviance(fitted.place, dispersion) + fitted.price


class Search:
    """Stepwise selection on one model's records.

    Parameters
    ----------
    model : Model
        Of which the search sees a part, `Criteria.searched`.
    criteria : Criteria
    """

    def __init__(self, model: Model, criteria: Criteria) -> None:
        self.whole, self.model, self.criteria = model, model.part(criteria.searched), criteria
        self._library: Mapping[str, tuple[Hypothesis, ...]] = model.hypotheses()
        self._best: dict[str, Fitted] = {}
        self._smaller: dict[tuple[int, int], tuple[Fitted, Fitted]] = {}
        self._end = math.inf if criteria.seconds is None else time.process_time() + criteria.seconds

    def run(self) -> Selection:
        """The set selected."""
        current = self._calibrated()
        rivals: list[Fitted] = []
        added: list[Fitted] = []
        while self._in_time() and len(current.effects) < self.criteria.most and self._looks_on(current):
            added = self._added(current)
            grown = self._pruned(added[0]) if added else current
            _log.debug("%s: %s after %s", current.name, grown.name, ", ".join(one.effects[-1].name for one in added))
            if len(grown.effects) <= len(current.effects) and not self._wins(grown, current):
                break
            current, rivals, added = grown, added[1:], []
        current, instead = self._exchanged(current, rivals)
        without = tuple(self._without(current, k) for k in range(len(current.effects)))
        base = self._known(NONE) or current
        dispersion = dispersion_of(self.model, current.place)
        return Selection(base, current, without, instead, tuple(added), dispersion, self._in_time(), self.model)

    def on_all(self, fitted: Fitted) -> Fitted:
        """A set fitted to all windows of all records."""
        if self.whole is self.model:
            return fitted
        place, problem = fitted.place, Problem(self.whole, fitted.place.hypothesis)
        states = np.zeros((len(self.whole.counts), place.states.shape[1]))
        result = fit(problem, problem.searched(problem.point(place.z, states)), steps=_SHORT, thorough=True)
        return Fitted(result.place, fitted.converged, fitted.price)

    def only(self, fitted: Fitted, kept: Sequence[int]) -> Fitted:
        """A set with only some of its effects."""
        for k in reversed(range(len(fitted.effects))):
            if k not in kept:
                fitted = self._without(fitted, k)
        return fitted

    def _in_time(self) -> bool:
        return time.process_time() < self._end

    def _looks_on(self, fitted: Fitted) -> bool:
        return not fitted.effects or fitted.place.level(self.model) ** 2 - 1.0 >= self.criteria.look

    def _at_noise(self, fitted: Fitted) -> bool:
        return fitted.place.level(self.model) ** 2 - 1.0 < self.criteria.at_noise

    def _wins(self, one: Fitted, other: Fitted) -> bool:
        """Whether a set is better than another by the margin."""
        dispersion = dispersion_of(self.model, one.place)
        gain = score(other, self.model, dispersion) - score(one, self.model, dispersion)
        return gain >= self.criteria.margin

    def _calibrated(self) -> Fitted:
        """The model as it came."""
        problem = Problem(self.model, NONE, caution=CAUTION)
        z = np.zeros(len(problem.parameters))
        states = np.zeros((len(self.model.counts), self.model.local_count(NONE)))
        place = fit(problem, problem.searched(problem.point(z, states)), steps=_CAREFUL).place
        return self._kept(place, converged=True)

    def _added(self, current: Fitted) -> list[Fitted]:
        """The set with one more effect, for the effects that lead the race, best first."""
        model, place = self.model, current.place
        problem = Problem(model, place.hypothesis, caution=CAUTION)
        careful = fit(problem, problem.adopted(place), steps=_SHORT).place if current.effects else place
        residual = problem.residuals(careful.z[None], careful.states[None])[0]
        self._library = model.hypotheses(residual)
        others = [h for name, of in self._library.items() if name not in place.hypothesis.names for h in of]
        return self._finished(race(model, careful, others, self.criteria), careful)

    def _finished(self, places: Sequence[Point], base: Point) -> list[Fitted]:
        """The leading places of a race fitted to the end, best first; far from the best one there is no rival."""
        found: list[Fitted] = []
        for place in places[: self.criteria.rivals]:
            if found and not self._in_time():
                break
            if found and self._at_noise(found[0]):
                bar = base.cost + _HALF_WAY * (found[0].place.cost - base.cost)
                if place.cost > bar:
                    continue
            found.append(self._fit(place))
            found.sort(key=self._plain)
        return found

    def _plain(self, fitted: Fitted) -> float:
        return fitted.place.cost + fitted.price

    def _fit(self, place: Point) -> Fitted:
        """A place fitted to the end, what is known of the machine losing its extra weight on the way."""
        problem = Problem(self.model, place.hypothesis, caution=_BETWEEN)
        place = fit(problem, problem.adopted(place), steps=_SHORT).place
        problem = Problem(self.model, place.hypothesis)
        result = fit(problem, problem.adopted(place), steps=_LONG, thorough=True)
        return self._kept(result.place, result.converged)

    def _kept(self, place: Point, converged: bool) -> Fitted:
        """A fit, or a better one of the same set that was made before."""
        key = _key(place.hypothesis)
        fitted = Fitted(place, converged, self._price(place.hypothesis))
        before = self._best.get(key)
        if before is None or place.cost < before.place.cost:
            self._best[key] = fitted
        return self._best[key]

    def _known(self, hypothesis: Hypothesis) -> Fitted | None:
        return self._best.get(_key(hypothesis))

    def _price(self, hypothesis: Hypothesis) -> float:
        samples = float(self.model.counts.sum())
        choices = [len(self._library.get(effect.name, (effect,))) for effect in hypothesis.effects]
        return len(hypothesis.parameters) * math.log(samples) + 2.0 * sum(math.log(m) for m in choices)

    def _pruned(self, fitted: Fitted) -> Fitted:
        """A set without the effects that it does not need any more."""
        while fitted.effects:
            without = [self._without(fitted, k) for k in range(len(fitted.effects))]
            needless = [one for one in without if not self._wins(fitted, one)]
            if not needless:
                break
            fitted = min(needless, key=self._plain)
        return fitted

    def _without(self, fitted: Fitted, k: int) -> Fitted:
        """The set without its k-th effect, from the machine that it had with it: a poor fit of the smaller set must not
        make an effect look needed."""
        made = self._smaller.get((id(fitted), k))
        if made is None:
            # kept with the set itself, so that no other one takes its identity
            made = self._smaller[id(fitted), k] = fitted, self._refitted_without(fitted, k)
        return made[1]

    def _refitted_without(self, fitted: Fitted, k: int) -> Fitted:
        place, effects = fitted.place, fitted.effects
        smaller = together(*effects[:k], *effects[k + 1 :])
        columns = len(self.model.parameters) + place.hypothesis.places(k)
        z, problem = np.delete(place.z, columns), Problem(self.model, smaller)
        states = self.model.states_for(smaller, place.states)
        result = fit(problem, problem.searched(problem.point(z, states)), steps=_LONG, thorough=True)
        before = self._known(smaller)
        if before is not None and before.place.cost < result.place.cost:
            result = fit(problem, problem.adopted(before.place), steps=_LONG, thorough=True)
        return self._kept(result.place, result.converged)

    def _exchanged(self, fitted: Fitted, rivals: Sequence[Fitted]) -> tuple[Fitted, tuple[tuple[Fitted, ...], ...]]:
        """The set, or a better one with another effect in the place of one of its own; and for each of its effects the
        sets with others instead."""
        for _ in range(self.criteria.most):
            instead = tuple(self._instead(fitted, k, rivals) for k in range(len(fitted.effects)))
            better = [one for others in instead for one in others if self._plain(one) < self._plain(fitted)]
            if not better:
                return fitted, instead
            fitted, rivals = min(better, key=self._plain), [fitted]
        return fitted, tuple(self._instead(fitted, k, rivals) for k in range(len(fitted.effects)))

    def _instead(self, fitted: Fitted, k: int, rivals: Sequence[Fitted]) -> tuple[Fitted, ...]:
        """Sets with another effect in the place of the k-th: those of its race, and what may look alike."""
        effects = fitted.effects
        kept = {_key(h) for j, h in enumerate(effects) if j != k}
        same = [one for one in rivals if len(one.effects) == len(effects) and kept <= {_key(h) for h in one.effects}]
        seen = {h.name for one in same for h in one.effects} | set(fitted.place.hypothesis.names)
        asked = [name for name in effects[k].alike if name not in seen and name in self._library]
        if len(effects) > 1 and k < len(effects) - 1:
            asked += [h.name for one in rivals for h in one.effects if h.name not in (*seen, *asked)]
        if asked and self._in_time():
            base = self._without(fitted, k).place
            problem = Problem(self.model, base.hypothesis, caution=CAUTION)
            hypotheses = [h for name in asked for h in self._library[name]]
            same += self._finished(race(self.model, problem.adopted(base), hypotheses, self.criteria), base)
        return tuple(sorted(same, key=self._plain))


def _key(hypothesis: Hypothesis) -> str:
    """What tells sets apart: their effects with their choices, in any order."""
    return " + ".join(sorted(f"{one.name} {sorted(one.fixed.items())}" for one in hypothesis.effects))
