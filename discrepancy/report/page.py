"""report.html: one file that opens offline; what is missing, how sure, how large and where comes first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2

from discrepancy.chain import Outcome
from discrepancy.estimates import FoundEffect
from discrepancy.grades import NAMED
from discrepancy.report.figures import figures
from discrepancy.report.picture import picture
from discrepancy.report.ranking import rankings
from discrepancy.report.words import floor, percent, ranged, remains_more, times, to_do
from discrepancy.subjects.base import bounded

_TEMPLATE = "page.html"
_MOST_NEXT = 6

GRADE_WORDS = {
    "established": "None of the rules that hold a name back applies.",
    "family": "One of these is missing; no record here tells which.",
    "stands in": "A hint and not a name: it closes a part of the gap for something that the library does not know.",
}
"""What each grade means to a reader."""


def page(outcome: Outcome, content: dict[str, Any]) -> str:
    """The page, given the outcome and its `content`."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"percent": percent, "number": bounded}
    answer, subject = outcome.answer, outcome.subject
    findings = [
        (finding, [(effect, _sizes(effect, outcome), subject.meaning(effect.name)) for effect in finding.effects])
        for finding in answer.findings
    ]
    return environment.get_template(_TEMPLATE).render(
        content=content,
        answer=answer,
        findings=findings,
        grade_words=GRADE_WORDS,
        kind=subject.kind,
        picture=_picture(outcome),
        figures=figures(outcome),
        rankings=rankings(answer),
        calibration=[(e, subject.shop(e.name, (e.value, e.low, e.high))) for e in answer.calibration.estimates],
        gap=outcome.gap,
        table=content["table"],
        times=times(answer.after),
        remains_more=remains_more(outcome),
        floor=floor(outcome),
        to_do=to_do(outcome),
        following=outcome.next[:_MOST_NEXT],
        where=outcome.where,
        left=outcome.left,
        extended=outcome.extended,
    )


def _sizes(effect: FoundEffect, outcome: Outcome) -> list[tuple[str, str, str]]:
    """Each parameter's name, SI value with its interval, and the same in the shop's unit."""
    rows = []
    for e in effect.parameters:
        shop = outcome.subject.shop(f"{effect.name}.{e.name}", (e.value, e.low, e.high))
        rows.append((e.name, ranged(e), shop))
    return rows + [(name, f"{value:.4g}", "") for name, value in effect.choices]


def _picture(outcome: Outcome) -> str:
    """The machine with its places marked; "" for a machine that is not drawn."""
    part, answer = outcome.subject.part, outcome.answer
    marked = {part(e.name) for f in answer.findings if f.grade in NAMED for e in f.effects} - {""}
    hints = {e.name for f in answer.findings if f.grade not in NAMED for e in f.effects}
    if remains_more(outcome) and answer.remains.looks_like:
        hints.add(answer.remains.looks_like)
    hinted = {part(name) for name in hints} - marked - {""}
    drawn = any(part(name) for name in answer.model.hypotheses())
    return picture(sorted(marked), sorted(hinted)) if drawn else ""
