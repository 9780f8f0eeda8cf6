"""What the chain leaves behind: report.json for programs, report.html for people, the machine with what was found.

In reading order:
    words    the answer in one sentence, numbers as a person writes them
    ranking  what competed with each finding, and none of these
    content  report.json
    picture  the machine with the places marked
    figures  missing torque, records, maps and levels as SVG
             with_table.yaml where what remains could be tabulated
    page     report.html from `page.html`, all inline
"""

from __future__ import annotations

import html
import json
import logging
from typing import Any

from discrepancy.chain import Outcome
from discrepancy.report.content import content
from discrepancy.report.words import headline, plain, to_do

_log = logging.getLogger(__name__)

__all__ = ["content", "headline", "plain", "report_files", "to_do"]


def report_files(outcome: Outcome) -> dict[str, str]:
    """Texts of all files by name."""
    whole = content(outcome)
    written = outcome.answer.written
    machine = dict(outcome.subject.files(outcome.answer.model, written.place))
    comments = "".join(f"# {remark}\n" for remark in written.remarks)
    files = {
        "report.json": json.dumps(whole, indent=1, ensure_ascii=False) + "\n",
        "report.html": _page(outcome, whole),
        **{name: comments + text for name, text in machine.items()},
        **_with_table(outcome),
    }
    return {name: plain(text) for name, text in files.items()}


def _page(outcome: Outcome, whole: dict[str, Any]) -> str:
    """The page for people. Where it cannot be drawn, a page that says so: what was found must not be lost by it."""
    try:
        from discrepancy.report import page

        return page.page(outcome, whole)
    except Exception as error:
        _log.exception("the page could not be drawn")
        why = html.escape(f"{type(error).__name__}: {error}")
        return f"<!doctype html><p>The page could not be drawn ({why}). All findings stand in report.json.</p>\n"


def _with_table(outcome: Outcome) -> dict[str, str]:
    """The machine with what remains taken up as a table, as a file of its own: only its owner decides to use it."""
    table = outcome.table
    if table is None:
        return {}
    try:
        machine = outcome.subject.files(outcome.answer.model, table.place)["machine.yaml"]
    except Exception as error:
        _log.exception("the table could not be written as a machine")
        return {"with_table.yaml": f"# It could not be written ({type(error).__name__}: {error}).\n"}
    form, calibration = table.form, outcome.answer.calibration
    ends = " and ".join(f"from {axis.low:.4g} to {axis.high:.4g}" for axis in form.axes)
    said = [
        f"{form.hypothesis.name} is a table over the {form.over}, not a law.",
        f"Its places lie {ends}; those that no record passed stay at nothing.",
    ]
    if outcome.answer.written.held_back:
        said.append("All else is the calibrated machine, which machine.yaml holds back.")
    if calibration.bounds_hit:
        said.append(f"Held at the bound of what is believable: {', '.join(calibration.bounds_hit)}.")
    return {"with_table.yaml": "".join(f"# {one}\n" for one in said) + machine}
