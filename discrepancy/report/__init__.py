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

import json

from discrepancy.chain import Outcome
from discrepancy.report.content import content
from discrepancy.report.words import headline, to_do

__all__ = ["content", "headline", "report_files", "to_do"]


def report_files(outcome: Outcome) -> dict[str, str]:
    """Texts of all files by name."""
    from discrepancy.report.page import page

    whole = content(outcome)
    written = outcome.answer.written
    machine = dict(outcome.subject.files(outcome.answer.model, written.place))
    comments = "".join(f"# {remark}\n" for remark in written.remarks)
    return {
        "report.json": json.dumps(whole, indent=1, ensure_ascii=False) + "\n",
        "report.html": page(outcome, whole),
        **machine,
        "machine.yaml": comments + machine["machine.yaml"],
        **_with_table(outcome),
    }


def _with_table(outcome: Outcome) -> dict[str, str]:
    """The machine with what remains taken up as a table, as a file of its own: only its owner decides to use it."""
    table = outcome.table
    if table is None:
        return {}
    machine = outcome.subject.files(outcome.answer.model, table.place)["machine.yaml"]
    held = " and ".join(f"between {axis.low:.4g} and {axis.high:.4g}" for axis in table.form.axes)
    comment = f"# {table.form.hypothesis.name} is a table, not a law: it holds {held}, where it was read off.\n"
    return {"with_table.yaml": comment + machine}
