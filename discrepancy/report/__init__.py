"""What the chain leaves behind: report.json for programs, report.html for people, the extended machine.

In reading order:
    words    the verdict in one sentence, numbers as a person writes them
    content  report.json
    figures  records, maps, levels and ranking as SVG
    page     report.html from `page.html`, all inline
"""

from __future__ import annotations

import json

from discrepancy.chain import Outcome
from discrepancy.report.content import content
from discrepancy.report.words import headline

__all__ = ["content", "headline", "report_files"]


def report_files(outcome: Outcome) -> dict[str, str]:
    """Texts of all files by name."""
    from discrepancy.report.page import page

    whole = content(outcome)
    return {
        "report.json": json.dumps(whole, indent=1, ensure_ascii=False) + "\n",
        "report.html": page(outcome, whole),
        **outcome.subject.files(outcome.after.model, outcome.after.place),
    }
