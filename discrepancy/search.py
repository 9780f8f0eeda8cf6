"""Floating selection of the set of effects that a model lacks: add, drop, exchange, each time everything fitted anew.

All sets are compared by one score (`selection`). An effect enters by the race for starts, or two do where none wins
alone. It stays while leaving it out costs the margin and no other effect that has led a race does better in its place:
the first of two effects that act at once is often a wrong one that imitates both (sequential floating selection; Pudil,
Novovičová and Kittler, Pattern Recognition Letters 15 (1994) 1119).
"""

from __future__ import annotations

import itertools
import logging
import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.fits import Fits
from discrepancy.model import NONE, Hypothesis, Model
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import Race, first_of_each, race, restarted
from discrepancy.selection import Fitted, Selection, key_of, more_than, scores, standings

_log = logging.getLogger(__name__)

_HALF_WAY = 0.5
"""Share of the margin below which a set that was fitted to the end is not worth a better start."""

_HALF = 0.5
"""Share of what is left that an effect must close so that no wide race looks for a better one."""

Suggest = Callable[[Fits], Sequence[Point]]
"""Places from which sets that somebody else thinks right may be fitted."""

_FOR_SEARCH = 0.5
"""Share of the time given after which no further effect is looked for: what an answer needs takes the rest."""


class Search:
    """Floating selection on one model's records.

    Parameters
    ----------
    model : Model
        Of which the search sees a part, `Criteria.searched`.
    criteria : Criteria
    suggest : callable
        Gives places of sets that are compared with what the search selects.
    end : float, optional
        Processor time at which no further effect is looked for, where the time given has begun before.
    """

    def __init__(
        self, model: Model, criteria: Criteria, suggest: Suggest = lambda fits: (), end: float | None = None
    ) -> None:
        self.whole, self.model, self.criteria = model, model.part(criteria.searched), criteria
        self._suggest = suggest
        self.fits = Fits(model, self.model)
        self._races: dict[tuple[str, str], Race] = {}
        self._asked: dict[tuple[str, str], set[str]] = {}
        # a fitted set is its own key, by identity
        self._anew: dict[tuple[Fitted, int], Point] = {}
        self._barred: frozenset[str] = frozenset()
        given = math.inf if criteria.seconds is None else criteria.seconds
        self.end = time.process_time() + _FOR_SEARCH * given if end is None else end

    def noise_left(self) -> tuple[float, float]:
        """The noise that the model as it came leaves, over that which was estimated."""
        place = self.fits.begun.place
        return self.model.with_all_samples().noise_left(self._left(place))

    def run(self, barred: Collection[str] = ()) -> Selection:
        """The set selected, of effects that are not `barred`."""
        self._barred = frozenset(barred)
        self._races.clear()
        self._asked.clear()
        current = self.fits.begun
        tried: list[Fitted] = []
        while self.in_time() and len(current.effects) < self.criteria.most and self._looks_on(current):
            tried = self._added(current)
            grown = self._grown(current, tried)
            hard = self._leaves(current, self.criteria.much) and not self._closes_half(grown, current)
            if hard and self.in_time():
                tried = self._of_each([*tried, *self._added(current, wide=True)])
                other = self._grown(current, tried)
                grown = self._ranked([grown, other])[0] if other is not current else grown
            _log.debug("%s: %s after %s", current.name, grown.name, ", ".join(one.effects[-1].name for one in tried))
            if grown is current:
                break
            current, tried = grown, []
        current = self._suggested(current if current.effects else self.fits.fit(current.place))
        current, instead = self._compared(current)
        without = tuple(self.fits.without(current, k) for k in range(len(current.effects)))
        base = self.fits.known(NONE) or self.fits.fit(self.fits.begun.place)
        return Selection(
            base, current, without, instead, tuple(tried), self.in_time(), self.model, self.criteria.margin
        )

    def _suggested(self, fitted: Fitted) -> Fitted:
        """The set, or one that was suggested and is clearly better: the search may have stopped short of it."""
        for place in self._suggest(self.fits):
            if self.in_time() and not self._barred.intersection(place.hypothesis.names):
                other = self.fits.fit(place)
                fitted = other if self.wins(other, fitted, _HALF_WAY) else fitted
        return fitted

    def _compared(self, fitted: Fitted) -> tuple[Fitted, tuple[tuple[Fitted, ...], ...]]:
        """The set with those that have another effect in the place of one of its own, what is alike included; one of
        them where it stands clearly better."""
        for more in reversed(range(self.criteria.most + 1)):
            instead = tuple(self._instead(fitted, k, alike=True) for k in range(len(fitted.effects)))
            sets = [fitted, *itertools.chain(*instead)]
            told = standings(sets, self.model, self.criteria.margin)
            if not more or told[0] - min(told) < _HALF_WAY * self.criteria.margin:
                break
            fitted = sets[told.index(min(told))]
        return fitted, instead

    def _grown(self, current: Fitted, tried: Sequence[Fitted]) -> Fitted:
        """The first of the sets with one more effect, or else of those with two, that wins after floating; the set as
        it is where none does. Two effects may hide each other, so that neither wins alone."""
        for more in (tried, self._pairs(current, tried) if self._leaves(current, self.criteria.much) else ()):
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
                if self.in_time() and self.wins(one, current, 0.0):
                    yield from self._added(one)[:1]

    def in_time(self) -> bool:
        """Whether the time given is not over."""
        return time.process_time() < self.end

    def _looks_on(self, fitted: Fitted) -> bool:
        strained = fitted.place.strain(self.model) >= self.criteria.strain
        return not fitted.effects or strained or self._leaves(fitted, self.criteria.at_noise)

    def _leaves(self, fitted: Fitted, least: float) -> bool:
        """Whether a set leaves so much in mean square above the noise, over the noise's."""
        return fitted.place.level(self.model) ** 2 / self.model.tolerated - 1.0 >= least

    def _closes_half(self, grown: Fitted, current: Fitted) -> bool:
        """Whether a set leaves less than half of what another leaves above the noise, what is known of the machine
        weighing as in a race: with its own weight the machine takes up most of what is missing."""
        levels = (self.fits.careful(one).level(self.model) for one in (grown, current))
        left, before = (level**2 / self.model.tolerated - 1.0 for level in levels)
        return left < _HALF * before

    def wins(self, one: Fitted, other: Fitted, share: float = 1.0) -> bool:
        """Whether a set is better than another by the margin, or by a share of it."""
        own, others = scores((one, other), self.model)
        return others - own >= share * self.criteria.margin

    def _ranked(self, sets: Sequence[Fitted]) -> list[Fitted]:
        """Sets by their scores, the best first."""
        by_score = dict(zip(sets, scores(sets, self.model), strict=True)) if sets else {}
        return sorted(by_score, key=by_score.__getitem__)

    def _of_each(self, sets: Sequence[Fitted]) -> list[Fitted]:
        """Sets by their scores, the best first, the best of each alone."""
        return first_of_each(self._ranked(sets), lambda one: key_of(one.place.hypothesis))

    def _added(self, current: Fitted, *, wide: bool = False) -> list[Fitted]:
        """The set with one more effect, for the effects that lead the race, best first; those of a wide race, and those
        that win something, begin anew where their fit stopped short."""
        found = self._finished(self._raced(current, wide=wide))
        if found and (wide or self.wins(found[0], current, _HALF_WAY)):
            return self._ranked([self._restarted(one, current) if self._short(one) else one for one in found])
        return found

    def _short(self, fitted: Fitted) -> bool:
        """Whether the fit of a set seems to have stopped short: it leaves much, or has bent the machine and leaves more
        than the noise."""
        bent = fitted.place.bent(self.model) >= self.criteria.bent
        return self._leaves(fitted, self.criteria.at_noise if bent else self.criteria.much)

    def _restarted(self, fitted: Fitted, base: Fitted) -> Fitted:
        """The set, or a better fit of it: what was fitted before bends towards what it lacks, and keeps the effect that
        it has more than a base from its size."""
        if not self.in_time():
            return fitted
        k = fitted.place.hypothesis.names.index(more_than(fitted, base))
        if (fitted, k) not in self._anew:
            place = restarted(self.model, fitted.place, k, self.criteria, self.in_time)
            self._anew[fitted, k] = self.fits.own(place)
        return self.fits.fit(self._anew[fitted, k]) if self.in_time() else fitted

    def _raced(self, base: Fitted, instead: str = "", *, wide: bool = False) -> Race:
        """The set with one more effect of the library, or of those that have led a race so far where it is to be
        `instead` of one."""
        key, careful = (key_of(base.place.hypothesis), instead), self.fits.careful(base)
        whole = None if wide else self._led((key[0], ""), careful)
        if whole is not None:
            return whole.without(instead)
        before = self._led(key, careful)
        own = {instead, *base.place.hypothesis.names, *self._barred}
        leaders = {name for one in self._races.values() for name in one.names[: self.criteria.fits]}
        more = leaders - own - self._asked.setdefault(key, set())
        if before is not None and instead and not more:
            return before
        library = self._listed(careful).items()
        others = [h for name, mine in library if (name in more if instead else name not in own) for h in mine]
        raced = Race(careful.cost, race(self.model, careful, others, self.criteria, wide=wide, in_time=self.in_time))
        self._asked[key].update(more)
        self._races[key] = raced if before is None else raced.beside(before)
        return raced if wide else self._races[key]

    def _led(self, key: tuple[str, str], careful: Point) -> Race | None:
        """A race that was run from a set: what led from a place of it that was clearly poorer leads no more."""
        raced = self._races.get(key)
        if raced is not None and raced.start - careful.cost > careful.dispersion(self.model):
            del self._races[key]
            self._asked.pop(key, None)
            return None
        return raced

    def _finished(self, raced: Race, best: Fitted | None = None) -> list[Fitted]:
        """The leading places of a race fitted to the end, best first; those that win less than half of what the leading
        one does, or a set that is known, are no rivals."""
        known = [self.fits.careful(best)] if best else []
        leading = min((place.cost for place in (*raced.places[:1], *known)), default=math.inf)
        found: list[Fitted] = []
        for place in raced.places[: self.criteria.rivals]:
            if (best or found) and not (self.in_time() and raced.rival(place, leading)):
                continue
            found = self._ranked([*found, self.fits.fit(place)])
        return found

    def _floated(self, fitted: Fitted) -> Fitted:
        """The set after what it does not need is dropped, what does worse than another effect is exchanged, and what
        was fitted before the others came begins anew, until none of it helps."""
        for _ in range(2 * self.criteria.most):
            better = self._needless(fitted) or self._exchanged(fitted) or self._all_anew(fitted)
            if not better:
                break
            fitted = better[0]
        return fitted

    def _needless(self, fitted: Fitted) -> list[Fitted]:
        """The set without one of the effects that it does not need, the best first."""
        without = (self.fits.without(fitted, k) for k in range(len(fitted.effects)))
        return self._ranked([one for one in without if not self.wins(fitted, one)])

    def _all_anew(self, fitted: Fitted) -> list[Fitted]:
        """A clearly better fit of the set where it leaves much and one of its effects begins anew: what came first was
        fitted to what the others explain."""
        for k in range(len(fitted.effects)) if self._leaves(fitted, self.criteria.much) else ():
            better = self._restarted(fitted, self.fits.without(fitted, k))
            if self.wins(better, fitted, _HALF_WAY):
                return [better]
        return []

    def _exchanged(self, fitted: Fitted) -> list[Fitted]:
        """Sets that score better with another effect in the place of one, the best first."""
        others = [one for k in range(len(fitted.effects)) for one in self._instead(fitted, k)]
        ranked = self._ranked([fitted, *others])
        return ranked[: ranked.index(fitted)]

    def _instead(self, fitted: Fitted, k: int, *, alike: bool = False) -> tuple[Fitted, ...]:
        """Sets with another effect in the place of the k-th, the best first: of those that have led a race so far and,
        if asked, those that are known to look alike, whatever they promise."""
        effect, base = fitted.effects[k], self.fits.without(fitted, k)
        found = self._finished(self._raced(base, effect.name), fitted) if self.in_time() else []
        near = (more_than(one, base) for one in found if not self.wins(fitted, one))
        names = {*base.place.hypothesis.names, *self._barred, *near}
        alikes = [name for name in effect.alike if alike and name not in names]
        if alikes:
            # what does the same does it beside all else as it is, also along a line that the effect has taken up
            beside = self.fits.left_out(fitted, k)
            library = self._listed(beside)
            asked = [h for name in alikes for h in library.get(name, ())]
            # without them a family would be told as one effect: they are fitted though time may have run out
            leading = race(self.model, beside, asked, self.criteria)[: self.criteria.rivals]
            found += [self.fits.fit(self.fits.alike(place, beside, fitted)) for place in leading]
        return tuple(first_of_each(self._ranked(found), lambda one: more_than(one, base)))

    def _listed(self, place: Point) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library, with what stands out of all samples at a place."""
        return self.model.hypotheses(self._left(place))

    def _left(self, place: Point) -> np.ndarray:
        """Residuals (w, n) of all samples of the windows that are searched."""
        return Problem(self.model.with_all_samples(), place.hypothesis).left(place)
