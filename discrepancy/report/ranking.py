"""What competed with each finding, with a row for "none of these"."""

from __future__ import annotations

from dataclasses import dataclass

from discrepancy.explain import Explanation
from discrepancy.finding import Finding
from discrepancy.grades import FAMILY
from discrepancy.next_measurement import apart

NONE_OF_THESE = "none of these"


@dataclass(frozen=True)
class Row:
    """One row of a ranking.

    Attributes
    ----------
    name : str
    probability : float or None
        That this is missing; the rows' add up to 1. None where nothing was found.
    behind : float or None
        By how much its set scores worse than the best one, in units of twice a log-likelihood.
    why : str
    """

    name: str
    probability: float | None
    behind: float | None
    why: str


@dataclass(frozen=True)
class Ranking:
    """What competed for one place in the set.

    Attributes
    ----------
    beside : tuple of str
        The other effects of the set, which all rows have in common.
    rows : tuple of Row
    """

    beside: tuple[str, ...]
    rows: tuple[Row, ...]


def rankings(answer: Explanation) -> tuple[Ranking, ...]:
    """One for each finding; where there is none, one of what came nearest."""
    if answer.findings:
        return tuple(_of(answer, finding) for finding in answer.findings)
    selection = answer.selection
    rows = [
        Row(apart(one, answer.best), None, selection.gap(one), "tried, and not enough better to be taken")
        for one in selection.tried
    ]
    why = (
        "the model as it came is enough" if answer.verdict == "nothing missing" else "no effect of the library suffices"
    )
    return (Ranking((), (*rows, Row(NONE_OF_THESE, None, 0.0, why))),)


def _of(answer: Explanation, finding: Finding) -> Ranking:
    names = answer.best.place.hypothesis.names
    k = names.index(finding.effects[0].name)
    members = {effect.name for effect in finding.effects[1:]} if finding.grade == FAMILY else set()
    rows = [Row(finding.name, finding.probability, 0.0, finding.why)]
    others = [rival for rival in finding.rivals if rival.name not in members]
    rows += [Row(rival.name, rival.probability, rival.behind, "fitted in its place") for rival in others]
    nothing = max(finding.inside - sum(row.probability or 0.0 for row in rows), 0.0)
    gap = answer.selection.gap(answer.selection.without[k])
    rows.append(Row("no effect in its place", nothing, gap, "left out"))
    rows.append(Row(NONE_OF_THESE, 1.0 - finding.inside, None, "what is missing is not in the library"))
    return Ranking(tuple(name for name in names if name != names[k]), tuple(rows))
