"""What records say of the effects that a model lacks: a search, the grades of what it found, and what remains."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from discrepancy.criteria import Criteria
from discrepancy.estimates import Calibration
from discrepancy.finding import Finding, finding_of
from discrepancy.form import Form
from discrepancy.grades import DISMISSED, GRADES, NAMED, STANDS_IN
from discrepancy.held_out import closed
from discrepancy.judging import Elsewhere, Judge
from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.search import Search, Suggest
from discrepancy.selection import Fitted, Selection
from discrepancy.written import Written, written
from indexer_env.errors import refuse

_QUIETER = 0.8
"""Share of the noise that was estimated below which what the calibrated model leaves is believed instead: where a
record was quiet, the machine was not, and rang on."""

VERDICTS = ("found", "nothing missing", "only a remainder")
"""found: an effect is established, or a family of them; nothing missing: the calibrated model is at the noise; only a
remainder: something is left to which no effect of the library gives a name."""


@dataclass(frozen=True)
class Remains:
    """What is left beside all that was found.

    Attributes
    ----------
    level : float
        rms over the noise as stated or estimated, on records held out.
    noise : float
        rms of what does not repeat, over the same noise: where the two differ, the noise was taken for too small, or
        something acts that is not locked to the machine.
    looks_like : str
        The effect of the library that would lessen it most, though not enough; "" where none does.
    """

    level: float
    noise: float
    looks_like: str

    @property
    def times_noise(self) -> float:
        """rms over what does not repeat."""
        return self.level / self.noise


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the records are explained by.

    Attributes
    ----------
    verdict : str
        One of VERDICTS.
    findings : tuple of Finding
        Established effects, families and what stands in, in that order.
    remains : Remains
    base, best : Fitted
        The model as it came, and the set with everything that was selected.
    accepted : Fitted
        The set of what is established, of a family its best member.
    held : mapping of str to Point
        Places on the records held out by the sets' names.
    before, after : float
        Level (rms over noise) on the records held out, of the model as it came and with what is accepted.
    calibration : Calibration
        The machine's parameters with what is accepted.
    written : Written
        The machine that is left behind.
    selection : Selection
    criteria : Criteria
    model, held_out : Model
        With the noise that the calibrated model shows, where that is clearly less than what was estimated.
    noise_share : float
        That noise over the estimated one; 1 where it was left.
    """

    verdict: str
    findings: tuple[Finding, ...]
    remains: Remains
    base: Fitted
    best: Fitted
    accepted: Fitted
    held: dict[str, Point]
    before: float
    after: float
    calibration: Calibration
    written: Written
    selection: Selection
    criteria: Criteria
    model: Model
    held_out: Model
    noise_share: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that are accepted."""
        return self.accepted.place.hypothesis.names

    @property
    def left(self) -> float:
        """Mean square above the noise, over the noise's, that what is accepted leaves on the records held out."""
        return (self.after / self.remains.noise) ** 2 - 1.0

    @property
    def within_noise(self) -> bool:
        """Whether it leaves no more than the noise, and what is tolerated, though another set may leave less."""
        return self.after**2 <= self.held_out.tolerated

    @property
    def at_noise(self) -> bool:
        """Whether what is accepted leaves nothing to explain on the records held out."""
        return self.within_noise or self.left < self.criteria.at_noise

    @property
    def closed_share(self) -> float:
        """Share of the gap on the records held out that what is accepted closes; NaN where there was none."""
        floor = self.remains.noise**2
        gap = self.before**2 - floor
        return closed(gap, self.after**2 - floor) if gap > 0.0 else math.nan


def explain(
    model: Model, held_out: Model, criteria: Criteria | None = None, forms: Sequence[Form] = (),
    elsewhere: Elsewhere | None = None, suggest: Suggest = lambda fits: (),
) -> Explanation:  # fmt: skip
    """Find the effects that a model lacks, by its records and records held out (the same model, other conditions).

    A law over a variable that `forms` can tabulate is named only where the table closes hardly more, and an effect only
    where nothing `elsewhere` explains its part better (`Subject.elsewhere`). Sets that others `suggest` are compared
    with what the search selects.
    """
    if not model.parameters:
        raise refuse("Model", "parameters", "one or more", (), "an offset that is known to be 0 will do")
    criteria = criteria or Criteria()
    # The normal equations are small: on a busy machine the threads of a matrix library wait for each other, 30 times as
    # long as one takes.
    with threadpool_limits(limits=1, user_api="blas"):
        search = Search(model, criteria, suggest)
        share, colour = search.noise_left()
        if share < _QUIETER:
            model, held_out = (one.with_noise(share, colour) for one in (model, held_out))
        if criteria.tolerance is not None:
            model, held_out = (one.tolerating(criteria.tolerance) for one in (model, held_out))
        if model is not search.whole:
            search = Search(model, criteria, suggest, search.end)
        answer = _searched(search, held_out, forms, elsewhere)
        return dataclasses.replace(answer, noise_share=share) if share < _QUIETER else answer


def _searched(search: Search, held_out: Model, forms: Sequence[Form], elsewhere: Elsewhere | None) -> Explanation:
    """What a search finds, or a second one without the effects that a bound holds or that the records held out dismiss,
    where much is left."""
    criteria = search.criteria
    answer, instead_of = _answer(search, search.run(), held_out, forms, elsewhere)
    if instead_of and answer.left >= criteria.much and search.in_time():
        # they stand in for others, perhaps of the library, that then explain as much
        selection = search.run(barred=instead_of)
        if not search.wins(answer.selection.best, selection.best):
            other, _ = _answer(search, selection, held_out, forms, elsewhere)
            return other if other.after < answer.after else answer
    return answer


def _answer(
    search: Search, selection: Selection, held_out: Model, forms: Sequence[Form], elsewhere: Elsewhere | None
) -> tuple[Explanation, list[str]]:
    """What a set that was selected explains, and its effects that a bound holds or the records held out dismiss."""
    model, criteria = search.whole, search.criteria
    judge = Judge(search.fits, selection, held_out, criteria, forms, elsewhere)
    judged, accepted = judge.judged()
    told = sorted((one for one in judged if one.grade != DISMISSED), key=lambda one: GRADES.index(one.grade))
    findings = tuple(finding_of(selection, judge, one) for one in told)
    held, best, base = judge.held, judge.best, judge.base
    remains = Remains(
        held[best.name].level(held_out), math.sqrt(judge.floor), _looks_like(selection, findings, criteria)
    )
    estimates = judge.estimates(accepted)
    calibration = estimates.calibration(len(model.parameters))
    after = held[accepted.name].level(held_out)
    left = after**2 / judge.floor - 1.0
    named = [one.found for one in judged if one.grade in NAMED]
    answer = Explanation(
        _verdict(findings, left, criteria, above=after**2 / held_out.tolerated - 1.0), findings, remains, base, best,
        accepted, held, held[base.name].level(held_out), after, calibration,
        written(model, estimates, held_out, held[accepted.name], judge.floor, criteria, named), selection, criteria,
        model, held_out,
    )  # fmt: skip
    instead_of = [one for one in judged if one.grade == DISMISSED or (one.grade == STANDS_IN and one.evidence.bound)]
    return answer, [one.found.name for one in instead_of]


def _verdict(findings: Sequence[Finding], left: float, criteria: Criteria, *, above: float = 0.1) -> str:
    """By what is accepted, which leaves so much `above` the noise, and `left` above what does not repeat either: what
    was dismissed explains nothing. Within the noise nothing is missing, though a hint may explain a part of it; where
    `much` is left something is, though it does not repeat."""
    if any(finding.grade in NAMED for finding in findings):
        return "found"
    nothing = above <= 0.0 or (not findings and left < criteria.at_noise and above < criteria.much)
    return "nothing missing" if nothing else "only a remainder"


def _looks_like(selection: Selection, findings: Sequence[Finding], criteria: Criteria) -> str:
    """The leading effect that was not enough: what stands in, else what the last round would have added."""
    hints = [finding.name for finding in findings if finding.grade not in NAMED]
    if hints:
        return hints[0]
    if not selection.tried:
        return ""
    leading, level = selection.tried[0], selection.best.place.level(selection.model)
    tolerated = selection.model.tolerated
    open_, left = (one**2 / tolerated - 1.0 for one in (level, leading.place.level(selection.model)))
    has = selection.best.place.hypothesis.names
    added = [effect.name for effect in leading.effects if effect.name not in has]
    return added[-1] if added and open_ - left > criteria.hint * open_ > 0.0 else ""
