"""What is said of each effect of a set: its grade, by one table of rules, the first that applies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from discrepancy.criteria import Criteria
from indexer_cli.words import joined

ESTABLISHED, FAMILY, STANDS_IN, DISMISSED = "established", "family", "stands in", "dismissed"

GRADES = (ESTABLISHED, FAMILY, STANDS_IN, DISMISSED)
"""established: it is missing; family: one of several effects is, which no record here can tell apart; stands in: it
closes a part of the gap for something that the library does not know; dismissed: it earns nothing on records held out.
"""

NAMED = (ESTABLISHED, FAMILY)
"""Grades that give a name."""


@dataclass(frozen=True)
class Evidence:
    """What the records say of one effect of a set, beside the others.

    Attributes
    ----------
    closes : float
        Share of the gap on records held out that it closes beside the others, of what repeats.
    remains : float
        What the whole set leaves on records held out, rms over what does not repeat.
    better : float
        Share that it makes better of what it changes, by more than noise, in windows held out; the least over records.
    size : str
        Its size with the interval, in words.
    zero : bool
        Whether the interval of its size holds the value that stands for no effect.
    bound : str
        The parameter that is held at a bound of what is possible, with its value; "" where none is.
    alike : tuple of str
        Other effects with which the set is as good, within the margin.
    share : float
        Mean square that it closes on the records held out over that of the effect of the set that closes most.
    largest : str
        That effect.
    eases : float
        By how much less the worst number that was stated of a record is pulled with it [standard deviations].
    missed : float
        Share of what a free function of its variable closes that its law leaves; 0 where it has no such variable.
    over : str
        That variable.
    untold : bool
        Whether no interval of its size can be told.
    span : float
        Factor between the ends of that interval, both taken from no effect.
    elsewhere : str
        What explains better than it what is left without it; "" where nothing does, or where it leaves at most
        `Criteria.law` of the gap, as no cause could close more.
    unsure : float
        Standard deviation of the mean square of what does not repeat, over the gap that is there without it.
    before : float
        Largest share that it closed beside others that were left out since.
    """

    closes: float
    remains: float
    better: float
    size: str
    zero: bool
    bound: str
    alike: tuple[str, ...]
    share: float = 1.0
    largest: str = ""
    eases: float = 0.0
    missed: float = 0.0
    over: str = ""
    untold: bool = False
    span: float = 1.0
    elsewhere: str = ""
    unsure: float = 0.0
    before: float = 0.0

    @property
    def most(self) -> float:
        """The largest share that it closes beside any others: what no effect of the library does may hide it."""
        return max(self.closes, self.before)


@dataclass(frozen=True)
class Rule:
    """One row of the table.

    Attributes
    ----------
    name : str
    grade : str
        One of GRADES.
    applies : callable
        Whether it does, given evidence and criteria.
    says : callable
        The sentence, given evidence and criteria.
    """

    name: str
    grade: str
    applies: Callable[[Evidence, Criteria], bool]
    says: Callable[[Evidence, Criteria], str]


def _at_noise(e: Evidence, c: Criteria) -> bool:
    return e.remains**2 - 1.0 < c.at_noise


RULES = (
    Rule(
        "size zero", DISMISSED,
        lambda e, c: e.zero,
        lambda e, c: f"The interval of its size ({e.size}) holds zero.",
    ),
    Rule(
        "closes nothing", DISMISSED,
        lambda e, c: e.most < c.hint,
        lambda e, c: f"It closes {_percent(e.closes)} of the gap on records held out; a hint needs {_percent(c.hint)}.",
    ),
    Rule(
        "size unknown", STANDS_IN,
        lambda e, c: e.untold,
        lambda e, c: (
            "With it the least step of a parameter leads to another motion, so no interval of its size can be told."
        ),
    ),
    Rule(
        "at a bound", STANDS_IN,
        lambda e, c: bool(e.bound),
        lambda e, c: f"Held at the bound of what is possible: {e.bound}. So it stands in for another effect.",
    ),
    Rule(
        "closes a part", STANDS_IN,
        lambda e, c: e.most < c.closes,
        lambda e, c: (
            f"It closes {_percent(e.closes)} of the gap on records held out, where a name needs {_percent(c.closes)}, "
            f"and with it {e.remains:.1f} times the noise would remain."
        ),
    ),
    Rule(
        "gap too small", STANDS_IN,
        lambda e, c: e.unsure > 1.0 - c.closes,
        lambda e, c: (
            f"The gap that it closes is so small that chance may make {_percent(e.unsure)} of it, where a name may "
            f"leave {_percent(1.0 - c.closes)} of a gap: more or longer records would tell."
        ),
    ),
    Rule(
        "not steady", STANDS_IN,
        lambda e, c: e.better <= 0.5 and not _at_noise(e, c),
        lambda e, c: (
            f"In one record {_percent(e.better)} of what it changes becomes better, where a name needs more than half."
        ),
    ),
    Rule(
        "slight", STANDS_IN,
        lambda e, c: e.share < c.slight and e.eases < c.strain,
        lambda e, c: (
            f"It closes {100.0 * e.share:.2g} % of what {e.largest} closes (mean squares), where a name needs "
            f"{100.0 * c.slight:.2g} %: the law of that one may err by as much."
        ),
    ),
    Rule(
        "another law", STANDS_IN,
        lambda e, c: e.missed > c.law,
        lambda e, c: (
            f"Its law leaves {_percent(e.missed)} of what a table over the {e.over} closes, where a name may leave "
            f"{_percent(c.law)}: something follows that variable, but not by this law alone."
        ),
    ),
    Rule(
        "another cause", STANDS_IN,
        lambda e, c: bool(e.elsewhere),
        lambda e, c: f"Without it {e.elsewhere} explains the records better than it does.",
    ),
    Rule(
        "size vague", STANDS_IN,
        lambda e, c: c.span is not None and e.span > c.span,
        lambda e, c: f"Its size ({e.size}) is known within a factor of {e.span:.2g}, where a name needs {c.span:g}.",
    ),
    Rule(
        "family", FAMILY,
        lambda e, c: bool(e.alike),
        lambda e, c: f"These records cannot tell it from {joined(e.alike, 'or')}.",
    ),
    Rule(
        "established", ESTABLISHED,
        lambda e, c: True,
        lambda e, c: (
            f"It closes {_percent(e.closes)} of the gap on records to which its size was not fitted"
            + (f", {_percent(e.before)} beside effects that were left out." if e.before > e.closes else ".")
        ),
    ),
)  # fmt: skip
"""Grades, the first row that applies; the last one always does."""


def graded(evidence: Evidence, criteria: Criteria) -> tuple[str, str]:
    """Grade of an effect and the sentence that says why."""
    rule = next(rule for rule in RULES if rule.applies(evidence, criteria))
    return rule.grade, rule.says(evidence, criteria)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
