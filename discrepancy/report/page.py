"""report.html: one file that opens offline, the verdict first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2

from discrepancy.chain import Outcome
from discrepancy.findings import Ranked
from discrepancy.model import NONE
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
        beside=answer.names[:-1],
        screened=_screened(outcome),
        calibration=answer.calibration,
        gap=gap,
        closed=None if gap.closed_share is None else percents(gap.closed_share),
        following=outcome.next[:_MOST_NEXT],
        enough=ENOUGH,
        where=outcome.where,
        extended=bool(outcome.effects),
    )


def _ranking(outcome: Outcome) -> list[tuple[Ranked, str]]:
    """Each hypothesis compared in the last round, with why it won or was ruled out."""
    return [(row, _why(row, outcome)) for row in outcome.answer.ranking]


def _why(row: Ranked, outcome: Outcome) -> str:
    answer = outcome.answer
    best = answer.ranking[0].score
    if outcome.effects and row.name in answer.rounds[-1].names:
        return "explains the records best" if row.score == best else "explains them as well"
    if answer.verdict == "none":
        of_none = next(one.score for one in answer.ranking if one.name == NONE.name)
        if row.name == NONE.name:
            return "is enough"
        if row.score < of_none:
            return f"gains {of_none - row.score:.0f} in twice the log-likelihood, too little for a name"
    elif row.score == best:
        return f"comes nearest, but {answer.reason}"
    behind = f"{row.score - best:.0f} worse in twice the log-likelihood"
    return f"ruled out: {behind}{'' if row.name == NONE.name else ', its parameters and the search for it paid for'}"


def _screened(outcome: Outcome) -> list[str]:
    """Effects of the library that the scan ruled out before a full fit, in every round."""
    answer = outcome.answer
    fitted = {candidate.name for naming in (answer.first, *answer.rounds) for candidate in naming.candidates}
    return [name for name in outcome.subject.model.hypotheses() if name not in fitted]
