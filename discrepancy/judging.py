"""What records held out say of each effect of a set: evidence, and grade by grade.

An effect that does not hold is left out, the least one first, and the others are judged anew without it: beside one
that takes a part of what they explain they would seem to close little.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from discrepancy.criteria import Criteria
from discrepancy.dispersion import dispersion_of
from discrepancy.estimates import Estimate, Estimates, FoundEffect, estimates_of
from discrepancy.fits import Fits
from discrepancy.form import Form, beside
from discrepancy.grades import GRADES, NAMED, Evidence, graded
from discrepancy.held_out import adapted, chance, closed, counted, excess, held_places, steadily, unrepeated
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.selection import Fitted, Selection
from indexer_env.units import behind_number

Elsewhere = Callable[[Model, Point, Point, str], str]
"""What explains better than an effect what a place without it leaves, in words."""


@dataclass(frozen=True)
class Judged:
    """One effect of the set that was selected.

    Attributes
    ----------
    k : int
        Its place in the set.
    found : FoundEffect
    evidence : Evidence
    grade, why : str
    """

    k: int
    found: FoundEffect
    evidence: Evidence
    grade: str
    why: str


class Judge:
    """The records held out, and what sets of effects leave of them.

    Parameters
    ----------
    fits : Fits
        Those of the search.
    selection : Selection
    held_out : Model
    criteria : Criteria
    forms : sequence of Form
        Tables to which laws over their variables are held.
    elsewhere : callable or None
        What explains an effect's part better, as of `Subject.elsewhere`.
    """

    def __init__(
        self, fits: Fits, selection: Selection, held_out: Model, criteria: Criteria, forms: Sequence[Form] = (),
        elsewhere: Elsewhere | None = None,
    ) -> None:  # fmt: skip
        self.fits, self.selection, self.held_out, self.criteria = fits, selection, held_out, criteria
        self.forms = {form.hypothesis.name: form for form in forms}
        self._elsewhere = elsewhere
        self.base, self.best = fits.on_all(selection.base), fits.on_all(selection.best)
        self.held: dict[str, Point] = {}
        self._costs: dict[str, float] = {}
        self._adapted: dict[str, Point] = {}
        self._tables: dict[str, Point] = {}
        self._causes: dict[int, str] = {}
        self._estimates: dict[Fitted, Estimates] = {}
        # the machine without effects first: its fit tells the speed, at which an effect that turns has its phase
        self._hold([self.base, self.best, *map(fits.on_all, selection.without)])
        best = self.held[self.best.name]
        # noise that was taken for more than the best set leaves is no more than that
        noise = min(1.0, best.level(held_out) ** 2)
        scatter = unrepeated([(fits.whole, self.best.place), (held_out, best)])
        self.floor = max(held_out.tolerated - 1.0 + noise, scatter, 1e-6)  # not 0 where a model is exact

    def estimates(self, whole: Fitted) -> Estimates:
        """Numbers of a set that was fitted to all windows."""
        if whole not in self._estimates:
            self._estimates[whole] = estimates_of(self.fits.whole, whole.place)
        return self._estimates[whole]

    def judged(self) -> tuple[list[Judged], Fitted]:
        """All effects of the set with their grades, and the set of those that are named, fitted to all windows. One of
        which too little is known for a name explains its part as long as the others are judged."""
        found: dict[int, Judged] = {}
        inside = self.selection.best
        kept = list(range(len(inside.effects)))
        while kept:
            rows = self._judged_beside(inside, kept, {k: row.evidence.most for k, row in found.items()})
            found |= {row.k: row for row in rows}
            failed = [row for row in rows if row.grade not in NAMED]
            if not failed:
                break
            least = min(failed, key=lambda row: (-GRADES.index(row.grade), row.evidence.closes))
            inside, kept = self._left_out(inside, kept.index(least.k))
        for row in [found[k] for k in kept]:
            grade, why = graded(row.evidence, self.criteria)
            if grade not in NAMED:
                found[row.k] = dataclasses.replace(row, grade=grade, why=why)
                inside, kept = self._left_out(inside, kept.index(row.k))
        whole = self.fits.on_all(inside)
        self._hold([whole])
        return [found[k] for k in sorted(found)], whole

    def _left_out(self, inside: Fitted, i: int) -> tuple[Fitted, list[int]]:
        """A set without its i-th effect, and the places of its effects in the best one: it may have been found in
        another order."""
        inside = self.fits.without(inside, i)
        return inside, [self.best.place.hypothesis.names.index(name) for name in inside.place.hypothesis.names]

    def _judged_beside(self, inside: Fitted, kept: Sequence[int], before: Mapping[int, float]) -> list[Judged]:
        """The effects of a set that was fitted to the part searched, however well their sizes are known. `before` they
        closed so much beside others that were left out: what no effect of the library does hides what they close."""
        whole = self.fits.on_all(inside)
        smaller = [self.fits.on_all(self.fits.without(inside, i)) for i in range(len(kept))]
        self._hold([whole, *smaller])
        numbers, rows, criteria = self.estimates(whole), [], dataclasses.replace(self.criteria, span=None)
        place, others = self._there(whole), [self._there(one) for one in smaller]
        pulled = [one.place.strain(self.fits.whole) - whole.place.strain(self.fits.whole) for one in smaller]
        dispersion = dispersion_of(self.held_out, place)
        against = self.held_out, self.floor, 1.0 - self.criteria.closes, dispersion
        unsure = chance(self.held_out, self.floor, dispersion)
        names = inside.place.hypothesis.names
        gaps = {name: excess(place, other, *against) for name, other in zip(names, others, strict=True)}
        for k, effect, other, eases in zip(kept, inside.effects, others, pulled, strict=True):
            found = numbers.effect(effect.name, tuple(effect.fixed.items()))
            evidence = self._evidence(k, found, place, other, gaps, eases, unsure)
            evidence = dataclasses.replace(evidence, before=before.get(k, 0.0))
            grade, why = graded(evidence, criteria)
            if grade in NAMED:
                missed, over = self._missed(k, effect)
                elsewhere = self._found_elsewhere(k) if evidence.closes < 1.0 - self.criteria.law else ""
                evidence = dataclasses.replace(evidence, missed=missed, over=over, elsewhere=elsewhere)
                grade, why = graded(evidence, criteria)
            rows.append(Judged(k, found, evidence, grade, why))
        return rows

    def _alike(self, k: int, name: str) -> Iterator[tuple[str, Hypothesis]]:
        """Effects, by name and with their choices, with which the set is as good, but those that become this one at a
        limit and so explain no less. Of those that are known to look alike one that leaves hardly more is as good: what
        differs may be what this effect's law errs by."""
        own = self.selection.best.effects[k]
        for one in self.selection.instead[k]:
            other = self.selection.other(one, k)
            effect = next(effect for effect in one.effects if effect.name == other)
            hardly = other in own.alike and self.selection.share(one, k) < self.criteria.slight
            if (hardly or self.selection.gap(one) < self.criteria.margin) and name not in effect.limits:
                yield other, effect

    def _missed(self, k: int, effect: Hypothesis) -> tuple[float, str]:
        """Share of what a free function closes that the law of the k-th effect, or of one that the records cannot tell
        from it, leaves, both beside the whole set: what stands in for something else takes up its part of it; and the
        function's variable."""
        laws = (effect, *(one for _, one in self._alike(k, effect.name)))
        # a table stands at one joint, and says nothing of a law at another one
        joints = {name: form.hypothesis.fixed.get("joint", 0.0) for name, form in self.forms.items()}
        over = [one.over for one in laws if joints.get(one.over) == one.fixed.get("joint", 0.0)]
        forms = {name: self.forms[name] for name in over}
        return max(((self._missed_by_table(k, form), form.over) for form in forms.values()), default=(0.0, ""))

    def _found_elsewhere(self, k: int) -> str:
        """What explains better than the k-th effect what the whole set without it leaves."""
        if self._elsewhere is None:
            return ""
        if k not in self._causes:
            without = self.fits.on_all(self.selection.without[k])
            name = self.best.effects[k].name
            self._causes[k] = self._elsewhere(self.fits.whole, self.best.place, without.place, name)
        return self._causes[k]

    def _missed_by_table(self, k: int, form: Form) -> float:
        # what does not repeat is in all three, and so in none of their differences
        best, without = self.held[self.best.name], self.held[self.selection.without[k].name]
        kept = counted(best, without, self.held_out, 1.0 - self.criteria.closes)
        left, open_, with_table = (float(place.squares[kept].sum()) for place in (best, without, self._tabulated(form)))
        return max(left - with_table, 0.0) / max(open_ - with_table, 1e-9)

    def _tabulated(self, form: Form) -> Point:
        """The whole set with a table beside it on the records held out, where a table that fits noise gains nothing."""
        name = form.hypothesis.name
        if name not in self._tables:
            place = beside(self.fits.whole, self.best.place, form)
            self._tables[name] = held_places([place], self.held_out, [self.held[self.best.name]])[0]
        return self._tables[name]

    def _hold(self, sets: Iterable[Fitted]) -> None:
        """Physics of sets on the records held out, each trying the start states that others found there. One that was
        fitted better since it was held is held anew."""
        new: dict[str, Point] = {}
        for one in sets:
            if one.place.cost < self._costs.get(one.name, math.inf):
                new[one.name], self._costs[one.name] = one.place, one.place.cost
        places = held_places(list(new.values()), self.held_out, list(self.held.values()))
        for name, place in self.held.items() if places else ():
            pooled = Problem(self.held_out, place.hypothesis, frozen=True).pooled(place, places)
            if pooled.cost < place.cost:
                self.held[name] = pooled
                self._adapted.pop(name, None)
        for name, place in zip(new, places, strict=True):
            self.held[name] = place
            self._adapted.pop(name, None)

    def _there(self, whole: Fitted) -> Point:
        """A set on the records held out: its effects as they are, the machine's own parameters fitted. What the records
        fitted do not tell of the machine would else count against an effect, and what bends it there for one."""
        if whole.name not in self._adapted:
            self._adapted[whole.name] = adapted(self.held[whole.name], self.held_out)
        return self._adapted[whole.name]

    def _evidence(
        self, k: int, found: FoundEffect, place: Point, other: Point, gaps: Mapping[str, tuple[float, float]],
        eases: float, unsure: float,
    ) -> Evidence:  # fmt: skip
        left, open_ = gaps[found.name]
        closes = {name: without - beside for name, (beside, without) in gaps.items()}
        largest = max(closes, key=closes.__getitem__)
        size = found.parameters[0]
        return Evidence(
            closes=closed(open_, left),
            unsure=min(unsure / open_, 1.0) if open_ > 0.0 else 0.0,
            remains=math.sqrt(1.0 + left / self.floor),
            better=steadily(place, other, self.held_out, 1.0 - self.criteria.closes, self.criteria),
            size=_words(size),
            zero=not found.untold and not found.shown,
            untold=found.untold,
            span=found.span,
            bound=found.bound,
            alike=tuple(name for name, _ in self._alike(k, found.name)),
            share=max(closes[found.name], 0.0) / max(closes[largest], 1e-300),
            largest=largest,
            eases=eases,
        )  # fmt: skip


def _words(e: Estimate) -> str:
    return f"{e.name} {e.value:.3g}{behind_number(e.unit)}, {e.low:.3g} to {e.high:.3g}"
