"""The cases through the search, and the rates at which it was right."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.drives.door import subject_of
from discrepancy.explain import explain
from indexer_experiments.challenge.drives.draw import ALSO, LIKE, WITH, Case

NAMED = ("established", "family")
"""Grades that give a name."""


@dataclass(frozen=True)
class Judged:
    """A case with what was said of it.

    Attributes
    ----------
    number : int
    hidden, unknown : tuple of str
    named : tuple of tuple of str
        Members of each finding that gives a name.
    hints : tuple of str
        Names of what only stands in.
    before, after, remains : float
        Levels on records held out.
    seconds : float
        Processor time.
    """

    number: int
    hidden: tuple[str, ...]
    unknown: tuple[str, ...]
    named: tuple[tuple[str, ...], ...]
    hints: tuple[str, ...]
    before: float
    after: float
    remains: float
    seconds: float

    @property
    def right(self) -> tuple[str, ...]:
        """Effects hidden that a finding names, each finding one of them."""
        for count in range(len(self.hidden), 0, -1):
            for some in itertools.combinations(self.hidden, count):
                for given in itertools.permutations(self.named, count):
                    if all(set(g) & {h, *ALSO.get(h, ())} for h, g in zip(some, given, strict=True)):
                        return some
        return ()

    @property
    def wrong(self) -> tuple[tuple[str, ...], ...]:
        """Findings with a name that is none of those hidden, nor of a law that describes a disturbance to 95 %."""
        described = {name for one in self.unknown for name in LIKE.get(one, ())}
        return tuple(members for members in self.unlisted if not set(members) & described)

    @property
    def unlisted(self) -> tuple[tuple[str, ...], ...]:
        """Findings with a name that is none of those hidden."""
        meant = {name for h in self.hidden for name in (h, *ALSO.get(h, ()))}
        meant |= {name for one in (*self.hidden, *self.unknown) for name in WITH.get(one, ())}
        return tuple(members for members in self.named if not set(members) & meant)


def judged(case: Case) -> Judged:
    """One case through the search."""
    begun = time.process_time()
    subject = subject_of(case.drive, case.records)
    answer = explain(subject.model, subject.held_out, forms=subject.forms())
    named = tuple(tuple(e.name for e in f.effects) for f in answer.findings if f.grade in NAMED)
    hints = tuple(f.name for f in answer.findings if f.grade not in NAMED)
    return Judged(
        case.number, case.hidden, case.unknown, named, hints, answer.before, answer.after, answer.remains.level,
        time.process_time() - begun,
    )  # fmt: skip


def table(results: Sequence[Judged]) -> str:
    """Rates in words."""
    some, none = [r for r in results if r.hidden], [r for r in results if not r.hidden]
    effects = sum(len(r.hidden) for r in some)
    one = [r for r in some if len(r.hidden) == 1]
    two = [r for r in some if len(r.hidden) == 2]
    seconds = np.array([r.seconds for r in results])
    rows = [
        f"cases {len(results)}: {len(none)} with nothing hidden, {len(one)} with one effect, {len(two)} with two",
        f"hidden effects named: {_share(sum(len(r.right) for r in some), effects)}",
        f"one hidden, named: {_share(sum(len(r.right) for r in one), len(one))}",
        f"two hidden, both named: {_share(sum(len(r.right) == 2 for r in two), len(two))}",
        *(
            f"a false name, {what} hidden: {_share(sum(bool(r.wrong) for r in those), len(those))}; with the names of "
            f"laws that describe a disturbance to 95 %: {sum(bool(r.unlisted) for r in those)}"
            for what, those in (("something", some), ("nothing", none))
        ),
        f"processor time: median {np.median(seconds):.1f} s, 95 % {np.quantile(seconds, 0.95):.1f} s",
    ]
    return "\n".join(rows)


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({100.0 * count / of:.0f} %)" if of else "none"
