"""One finding with its probability, and what it competes with."""

from __future__ import annotations

import math
from dataclasses import dataclass

from discrepancy.estimates import FoundEffect
from discrepancy.grades import FAMILY, NAMED
from discrepancy.judging import Judge, Judged
from discrepancy.selection import Selection


@dataclass(frozen=True)
class Rival:
    """An effect that was fitted in another one's place.

    Attributes
    ----------
    name : str
    behind : float
        By how much the set scores worse with it.
    probability : float
        That it is missing, and not the other one.
    """

    name: str
    behind: float
    probability: float


@dataclass(frozen=True)
class Finding:
    """One effect, or a family of them.

    Attributes
    ----------
    grade : str
        One of `grades.GRADES` but the last.
    effects : tuple of FoundEffect
        The effect with its size; of a family all members, the best first.
    probability : float
        That it, or one of the family, is missing.
    inside : float
        That what is missing in its place is in the library at all.
    closes : float
        Share of the gap on records held out that it closes beside the others.
    why : str
        The sentence of its grade.
    rivals : tuple of Rival
        Effects that were fitted in its place.
    """

    grade: str
    effects: tuple[FoundEffect, ...]
    probability: float
    inside: float
    closes: float
    why: str
    rivals: tuple[Rival, ...]

    @property
    def name(self) -> str:
        """Its effect's name; of a family the members'."""
        return " or ".join(effect.name for effect in self.effects)


_LISTED, _SHARPNESS, _HINTS = 8.0, 4.0, 1.0 / 6.0
"""Effects of the library over imitations among what gets a name, and how steeply the density of the shares that effects
close rises, 5 c⁴; imitations close any share alike. Of 31 names in 44 cases of the challenge's tuning half 30 were
right; in 908 of its judging half 511 of 518 that close 95 % or more, 75 of 77 from 85 %, 14 of 15 from 75 %. And the
share of what stands in that is in the library: 10 of 79 in the tuning half, 18 of 89 in the judging half; the share
that it closes tells nothing of that, those that closed little were right rather than others."""


def listed(closes: float, missed: float = 0.0, *, named: bool = True) -> float:
    """Probability that what closes a share of the gap is in the library, where its law leaves so much of what a free
    function of its variable closes: by the two laws' densities at the share that the law itself explains, or, where a
    rule holds its name back, by how often what stands in is."""
    if not named:
        return _HINTS
    odds = _LISTED * (_SHARPNESS + 1.0) * max(closes * (1.0 - missed), 0.0) ** _SHARPNESS
    return odds / (1.0 + odds)


def finding_of(selection: Selection, judge: Judge, one: Judged) -> Finding:
    """The finding; each set compared for its place has its posterior weight exp(-Δscore/2) of the probability that one
    of the library's effects is missing there."""
    k, closes = one.k, one.evidence.closes
    gaps = {other: selection.gap(other) for other in (*selection.instead[k], selection.without[k])}
    weights = {other: math.exp(-0.5 * max(gap, 0.0)) for other, gap in gaps.items()}
    inside = listed(one.evidence.most, one.evidence.missed, named=one.grade in NAMED)
    share = inside / (1.0 + sum(weights.values()))
    members = [m for m in selection.instead[k] if one.grade == FAMILY and selection.other(m, k) in one.evidence.alike]
    others = []
    for member in members:
        numbers = judge.estimates(judge.fits.on_all(member))
        effect = next(h for h in member.effects if h.name == selection.other(member, k))
        others.append(numbers.effect(effect.name, tuple(effect.fixed.items())))
    rivals = tuple(Rival(selection.other(r, k), gaps[r], share * weights[r]) for r in selection.instead[k])
    probability = share * (1.0 + sum(weights[member] for member in members))
    untried = "" if rivals or selection.complete else " The time allowed ran out before others were tried in its place."
    return Finding(one.grade, (one.found, *others), probability, inside, closes, f"{one.why}{untried}", rivals)
