"""Floating selection of the set of effects that a model lacks: add, drop, exchange, each time everything fitted anew.

All sets are compared by one score (`selection`). An effect enters by the race for starts, or two do where none wins
alone. It stays while leaving it out costs the margin and no other effect that has led a race does better in its place:
the first of two effects that act at once is often a wrong one that imitates both (sequential floating selection; Pudil,
Novovičová and Kittler, Pattern Recognition Letters 15 (1994) 1119).
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.fit import crossed, fit
from discrepancy.model import NONE, Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import CAUTION, race, restarted
from discrepancy.selection import Fitted, Selection, fitted_set, key_of, more_than, scores

_log = logging.getLogger(__name__)

_CAREFUL, _SHORT, _LONG = 15, 6, 60
"""Steps of a fit that may lack what matters most, of one on the way, and of one that is compared."""

_BETWEEN = 10.0
"""Weight of the machine's priors between the race's and their own."""

_HALF_WAY = 0.5
"""Share of the best effect's gain below which another one, after its few steps in the race, is no rival; and of the
margin below which a set that was fitted to the end is not worth a better start."""


_FOR_SEARCH = 0.5
"""Share of the time given after which no further fit begins: the one under way and the judgement take the rest."""


class Search:
    """Floating selection on one model's records.

    Parameters
    ----------
    model : Model
        Of which the search sees a part, `Criteria.searched`.
    criteria : Criteria
    """

    def __init__(self, model: Model, criteria: Criteria) -> None:
        self.whole, self.model, self.criteria = model, model.part(criteria.searched), criteria
        self._library = model.hypotheses()
        self._best: dict[str, Fitted] = {}
        self._smaller: dict[tuple[int, int], tuple[Fitted, Fitted]] = {}
        self._races: dict[tuple[str, str], list[Point]] = {}
        self._barred: frozenset[str] = frozenset()
        given = math.inf if criteria.seconds is None else criteria.seconds
        self._end = time.process_time() + _FOR_SEARCH * given

    def run(self, barred: Collection[str] = ()) -> Selection:
        """The set selected, of effects that are not `barred`."""
        self._barred = frozenset(barred)
        self._races.clear()
        current = self._calibrated()
        tried: list[Fitted] = []
        while self.in_time() and len(current.effects) < self.criteria.most and self._looks_on(current):
            tried = self._added(current)
            grown = self._grown(current, tried)
            if grown is current and self._leaves(current, self.criteria.much):
                tried = self._ranked([*tried, *self._added(current, wide=True)])
                grown = self._grown(current, tried)
            _log.debug("%s: %s after %s", current.name, grown.name, ", ".join(one.effects[-1].name for one in tried))
            if grown is current:
                break
            # where it is the same set, better fitted, what led from the poorer place leads no more
            self._races.pop((key_of(grown.place.hypothesis), ""), None)
            current, tried = grown, []
        without = tuple(self.without(current, k) for k in range(len(current.effects)))
        instead = tuple(self._instead(current, k, alike=True) for k in range(len(current.effects)))
        base = self._known(NONE) or current
        return Selection(base, current, without, instead, tuple(tried), self.in_time(), self.model)

    def _grown(self, current: Fitted, tried: Sequence[Fitted]) -> Fitted:
        """The first of the sets with one more effect, or else of those with two, that wins after floating; the set as
        it is where none does. Two effects may hide each other, so that neither wins alone."""
        more: Iterable[Fitted]
        hard = self._leaves(current, self.criteria.much)
        for more in (tried, self._pairs(current, tried) if hard else ()):
            for one in more:
                if self.wins(one, current, _HALF_WAY * (len(one.effects) - len(current.effects))):
                    grown = self._floated(one)
                    if self.wins(grown, current):
                        return grown
        return current

    def _pairs(self, current: Fitted, tried: Sequence[Fitted]) -> Iterator[Fitted]:
        """Sets with two more effects: the leading one of each set with one more that pays for its parameters."""
        if len(current.effects) + 2 <= self.criteria.most:
            for one in tried:
                if self.wins(one, current, 0.0):
                    yield from self._added(one)[:1]

    def on_all(self, fitted: Fitted) -> Fitted:
        """A set fitted to all windows of all records."""
        if self.whole is self.model:
            return fitted
        place, problem = fitted.place, Problem(self.whole, fitted.place.hypothesis)
        states = np.zeros((len(self.whole.counts), place.states.shape[1]))
        result = fit(problem, problem.searched(problem.point(place.z, states)), steps=_SHORT)
        return fitted_set(self.whole, crossed(problem, result.place), fitted.converged, fitted.price)

    def in_time(self) -> bool:
        """Whether the time given is not over."""
        return time.process_time() < self._end

    def _looks_on(self, fitted: Fitted) -> bool:
        return not fitted.effects or self._leaves(fitted, self.criteria.at_noise)

    def _leaves(self, fitted: Fitted, least: float) -> bool:
        """Whether a set leaves so much in mean square above the noise, over the noise's."""
        return fitted.place.level(self.model) ** 2 / self.model.tolerated - 1.0 >= least

    def wins(self, one: Fitted, other: Fitted, share: float = 1.0) -> bool:
        """Whether a set is better than another by the margin, or by a share of it."""
        own, others = scores((one, other), self.model)
        return others - own >= share * self.criteria.margin

    def _ranked(self, sets: Sequence[Fitted]) -> list[Fitted]:
        """Sets by their scores, the best first."""
        by_score = dict(zip(sets, scores(sets, self.model), strict=True)) if sets else {}
        return sorted(by_score, key=by_score.__getitem__)

    def _calibrated(self) -> Fitted:
        """The model as it came."""
        problem = Problem(self.model, NONE, caution=CAUTION)
        z = np.zeros(len(problem.parameters))
        states = np.zeros((len(self.model.counts), self.model.local_count(NONE)))
        place = fit(problem, problem.searched(problem.point(z, states)), steps=_CAREFUL).place
        # its priors weigh more than those of any score, so that it is no optimum of one
        return self._kept(place, converged=True, optimum=False)

    def _added(self, current: Fitted, *, wide: bool = False) -> list[Fitted]:
        """The set with one more effect, for the effects that lead the race, best first."""
        found = self._finished(current, self._raced(current, wide=wide), None)
        if found and self._leaves(found[0], self.criteria.much) and self.wins(found[0], current, _HALF_WAY):
            return self._ranked([self._restarted(one) for one in found])
        return found

    def _restarted(self, fitted: Fitted) -> Fitted:
        """The set, or a better fit of it: what was fitted before bends towards what it lacks, and keeps the last effect
        from its size."""
        place = restarted(self.model, fitted.place, self.criteria)
        return self._fit(place) if self.in_time() and place.cost < fitted.place.cost else fitted

    def _raced(self, base: Fitted, instead: str = "", *, wide: bool = False) -> list[Point]:
        """The set with one more effect of the library, or of those that have led a race so far where it is to be
        `instead` of one: the best place of each that leads the race, best first."""
        key = key_of(base.place.hypothesis)
        known = None if wide else self._races.get((key, "")) or self._races.get((key, instead))
        if known is None:
            careful = self._careful(base)
            library = self._listed(careful)
            leaders = {place.hypothesis.names[-1] for places in self._races.values() for place in places}
            asked = [name for name in library if name in leaders or not instead]
            own = {instead, *base.place.hypothesis.names, *self._barred}
            others = [h for name in asked if name not in own for h in library[name]]
            known = self._races[key, instead] = race(
                self.model, careful, others, self.criteria, wide=wide, in_time=self.in_time
            )
        return [place for place in known if place.hypothesis.names[-1] != instead]

    def _careful(self, fitted: Fitted) -> Point:
        """The set's place where what is known of the machine has the weight that it has in a race."""
        problem = Problem(self.model, fitted.place.hypothesis, caution=CAUTION)
        place = problem.adopted(fitted.place)
        return fit(problem, place, steps=_SHORT).place if fitted.effects else place

    def _finished(self, base: Fitted, places: Sequence[Point], best: Fitted | None) -> list[Fitted]:
        """The leading places of a race fitted to the end, best first; those that, after their few steps, win less than
        half of what the best set wins over the base are no rivals."""
        found: list[Fitted] = []
        for place in places[: self.criteria.rivals]:
            against = best or next(iter(found), None)
            if against is not None and not (self.in_time() and self._rivals(place, against, base)):
                continue
            found = self._ranked([*found, self._fit(place)])
        return found

    def _rivals(self, place: Point, best: Fitted, base: Fitted) -> bool:
        """Whether a place of a race wins half of what the best set does."""
        raced = Fitted(place, False, self._price(place.hypothesis), best.dispersion)
        own, least, most = scores((raced, best, base), self.model)
        return most - own >= _HALF_WAY * (most - least)

    def _fit(self, place: Point) -> Fitted:
        """A place fitted to the end, what is known of the machine losing its extra weight on the way."""
        known = self._known(place.hypothesis)
        if known is not None and known.place.cost <= place.cost:
            return known
        problem = Problem(self.model, place.hypothesis, caution=_BETWEEN)
        place = fit(problem, problem.adopted(place), steps=_SHORT).place
        problem = Problem(self.model, place.hypothesis)
        result = fit(problem, problem.adopted(place), steps=_LONG, thorough=True)
        return self._kept(result.place, result.converged)

    def _kept(self, place: Point, converged: bool, *, optimum: bool = True) -> Fitted:
        """A fit, or a better one of the same set that was made before."""
        key = key_of(place.hypothesis)
        before = self._best.get(key)
        if before is None or place.cost < before.place.cost:
            price = self._price(place.hypothesis)
            self._best[key] = fitted_set(self.model, place, converged, price, optimum=optimum)
        return self._best[key]

    def _known(self, hypothesis: Hypothesis) -> Fitted | None:
        return self._best.get(key_of(hypothesis))

    def _price(self, hypothesis: Hypothesis) -> float:
        samples = float(self.model.counts.sum())
        choices = [len(self._library.get(effect.name, (effect,))) for effect in hypothesis.effects]
        return len(hypothesis.parameters) * math.log(samples) + 2.0 * sum(math.log(m) for m in choices)

    def _floated(self, fitted: Fitted) -> Fitted:
        """The set after what it does not need is dropped and what does worse than another effect is exchanged, until
        neither helps."""
        for _ in range(2 * self.criteria.most):
            better = self._needless(fitted) or self._exchanged(fitted)
            if not better:
                break
            fitted = better[0]
        return fitted

    def _needless(self, fitted: Fitted) -> list[Fitted]:
        """The set without one of the effects that it does not need, the best first."""
        without = (self.without(fitted, k) for k in range(len(fitted.effects)))
        return self._ranked([one for one in without if not self.wins(fitted, one)])

    def _exchanged(self, fitted: Fitted) -> list[Fitted]:
        """Sets that score better with another effect in the place of one, the best first."""
        others = [one for k in range(len(fitted.effects)) for one in self._instead(fitted, k)]
        ranked = self._ranked([fitted, *others])
        return ranked[: ranked.index(fitted)]

    def without(self, fitted: Fitted, k: int) -> Fitted:
        """The set without its k-th effect, from the machine that it had with it: a poor fit of the smaller set must not
        make an effect look needed."""
        made = self._smaller.get((id(fitted), k))
        if made is None:
            # kept with the set itself, so that no other one takes its identity
            made = self._smaller[id(fitted), k] = fitted, self._refitted_without(fitted, k)
        return made[1]

    def _left_out(self, fitted: Fitted, k: int) -> Point:
        """The set's place without its k-th effect, all else as it is but for the windows' start states."""
        place, effects = fitted.place, fitted.effects
        smaller = together(*effects[:k], *effects[k + 1 :])
        columns = len(self.model.parameters) + place.hypothesis.places(k)
        problem = Problem(self.model, smaller)
        states = self.model.states_for(smaller, place.states)
        return problem.searched(problem.point(np.delete(place.z, columns), states))

    def _refitted_without(self, fitted: Fitted, k: int) -> Fitted:
        begun = self._left_out(fitted, k)
        smaller = begun.hypothesis
        problem = Problem(self.model, smaller)
        result = fit(problem, begun, steps=_LONG, thorough=True)
        before = self._known(smaller)
        if before is not None and before.information is None and before.place.cost < result.place.cost:
            result = fit(problem, problem.adopted(before.place), steps=_LONG, thorough=True)
        return self._kept(result.place, result.converged)

    def _instead(self, fitted: Fitted, k: int, *, alike: bool = False) -> tuple[Fitted, ...]:
        """Sets with another effect in the place of the k-th, the best first: of those that have led a race so far and,
        if asked, those that are known to look alike, whatever they promise."""
        effect, base = fitted.effects[k], self.without(fitted, k)
        if not self.in_time():
            return ()
        found = self._finished(base, self._raced(base, effect.name), fitted)
        near = (more_than(one, base) for one in found if not self.wins(fitted, one))
        names = {*base.place.hypothesis.names, *self._barred, *near}
        alikes = [name for name in effect.alike if alike and name not in names]
        if alikes:
            # what does the same does it beside all else as it is, also along a line that the effect has taken up
            beside = self._left_out(fitted, k)
            library = self._listed(beside)
            asked = [h for name in alikes for h in library.get(name, ())]
            leading = race(self.model, beside, asked, self.criteria, in_time=self.in_time)
            found += [self._fit(place) for place in leading[: self.criteria.rivals] if self.in_time()]
        best: dict[str, Fitted] = {}
        for one in self._ranked(found):
            best.setdefault(more_than(one, base), one)
        return tuple(best.values())

    def _listed(self, place: Point) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library, with what stands out of all samples at a place."""
        full = Problem(self.model.with_all_samples(), place.hypothesis)
        return self.model.hypotheses(full.left(place))
