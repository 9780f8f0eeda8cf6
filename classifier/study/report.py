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

REPORT_HTML, VERDICTS_MD = "report.html", "verdicts.md"


def write_report(lab: Lab, findings: Iterable[Finding]) -> Path:
    """Write the page of these findings into the study's folder, which needs no other file, and their verdicts and
    numbers as Markdown; give the page back.
    """
    values = {
        "sections": [_section(finding, lab) for finding in findings],
        "level": round(100 * LEVEL),
        "size": lab.size,
        "seeds": lab.seeds,
        "quick": lab.size.trainings < 10,
        "versions": json.loads((lab.folder / STUDY_JSON).read_text(encoding="utf-8"))["versions"],
    }
    loader, strict = jinja2.FileSystemLoader(Path(__file__).parent), jinja2.StrictUndefined
    for name in (REPORT_HTML, VERDICTS_MD):
        templates = jinja2.Environment(loader=loader, autoescape=name == REPORT_HTML, undefined=strict)
        text = templates.get_template(f"{name}.j2").render(values)
        (lab.folder / name).write_text(text, encoding="utf-8")
    return lab.folder / REPORT_HTML


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
