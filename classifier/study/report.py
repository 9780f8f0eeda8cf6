"""One page for all claims: each figure beside what the paper says, the verdict and the numbers behind it."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import jinja2

from classifier.study.lab import Lab
from classifier.study.verdicts import LEVEL
from classifier.study.work import STUDY_JSON, Finding

REPORT_HTML = "report.html"


def write_report(lab: Lab, findings: Iterable[Finding]) -> Path:
    """Write the page of these findings into the study's folder; it needs no other file."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    page = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    text = page.get_template("report.html.j2").render(
        sections=[_section(finding, lab) for finding in findings],
        level=round(100 * LEVEL),
        size=lab.size,
        seeds=lab.seeds,
        quick=lab.size.trainings < 10,
        versions=json.loads((lab.folder / STUDY_JSON).read_text(encoding="utf-8"))["versions"],
    )
    path = lab.folder / REPORT_HTML
    path.write_text(text, encoding="utf-8")
    return path


def _section(finding: Finding, lab: Lab) -> dict[str, Any]:
    picture = io.BytesIO()
    finding.picture().savefig(picture, format="png")
    return {
        "claim": finding.claim,
        "verdict": finding.verdict,
        "picture": base64.b64encode(picture.getvalue()).decode(),
        "main": [(setting, finding.outcomes[setting.key]) for setting in finding.main],
        "others": [(setting, finding.outcomes[setting.key]) for setting in finding.others],
        "trainings": finding.trainings,
        "minutes": finding.minutes,
        "commands": dict.fromkeys(setting.recipe.command(lab.seed) for setting in finding.main),
    }
