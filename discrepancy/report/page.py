"""report.html: one file that opens offline, the verdict first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2

from discrepancy.chain import Outcome
from discrepancy.next_measurement import ENOUGH
from discrepancy.report.figures import figures
from discrepancy.report.words import percent, percents, ranged

_TEMPLATE = "page.html"
_MOST_NEXT = 6

VERDICTS = {
    "named": "named", "none": "nothing missing", "ambiguous": "ambiguous", "unexplained": "unexplained",
    "not_converged": "not converged",
}  # fmt: skip


def page(outcome: Outcome, content: dict[str, Any]) -> str:
    """The page, given the outcome and its `content`."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"percent": percent, "number": lambda value: f"{value:.4g}"}
    answer, gap = outcome.answer, outcome.gap
    accepted = answer.found if outcome.effects else ()
    return environment.get_template(_TEMPLATE).render(
        content=content,
        verdict=VERDICTS[answer.verdict],
        kind=outcome.subject.kind,
        figures=figures(outcome),
        found=[
            (effect, [(e, ranged(e)) for e in effect.parameters], outcome.subject.meaning(effect.name))
            for effect in accepted
        ],
        ranking=_ranking(outcome),
        screened=_screened(outcome),
        calibration=answer.calibration,
        gap=gap,
        closed=None if gap.closed_share is None else percents(gap.closed_share),
        following=outcome.next[:_MOST_NEXT],
        enough=ENOUGH,
        where=outcome.where,
        extended=bool(outcome.effects),
    )


def _ranking(outcome: Outcome) -> list[tuple[Any, str]]:
    """Each hypothesis compared in the last round, with why it won or was ruled out."""
    rows = outcome.answer.ranking
    named = set(outcome.answer.rounds[-1].names) if outcome.effects else set()
    best = rows[0].score
    found = []
    for row in rows:
        if row.name in named:
            why = "explains the records best" if row.score == best else "explains them as well"
        elif row.score == best:
            why = f"comes nearest, but {outcome.answer.reason}" if outcome.answer.verdict != "none" else "is enough"
        else:
            why = f"ruled out: {row.score - best:.0f} worse in twice the log-likelihood, its parameters paid for"
        found.append((row, why))
    return found


def _screened(outcome: Outcome) -> list[str]:
    """Effects of the library that the scan ruled out before a full fit."""
    compared = {row.name for row in outcome.answer.ranking}
    return [name for name in outcome.after.model.hypotheses() if name not in compared]
