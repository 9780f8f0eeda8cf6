"""One page for all claims: a table that is read in a minute, and each figure with the numbers behind it."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import jinja2

from indexer_experiments.study import verdicts
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.verdicts import LEVEL
from indexer_experiments.study.work import STUDY_JSON, Finding

REPORT_HTML, VERDICTS_MD = "report.html", "verdicts.md"

QUICK = 5
"""Trainings of each kind below which a study only shows that it runs."""


def write_report(lab: Lab, findings: Iterable[Finding]) -> Path:
    """Write the page of these findings into the study's folder, which needs no other file, and their verdicts and
    numbers as Markdown; give the page back.
    """
    values = {
        "sections": [_section(finding, lab) for finding in findings],
        "level": round(100 * LEVEL),
        "rule": " ".join((verdicts.__doc__ or "").split("The rule. ")[1].split()),
        "size": lab.size,
        "seeds": lab.seeds,
        "quick": lab.size.trainings < QUICK,
        "versions": json.loads((lab.folder / STUDY_JSON).read_text(encoding="utf-8"))["versions"],
    }
    loader, strict = jinja2.FileSystemLoader(Path(__file__).parent), jinja2.StrictUndefined
    for name in (REPORT_HTML, VERDICTS_MD):
        templates = jinja2.Environment(loader=loader, autoescape=name == REPORT_HTML, undefined=strict)
        templates.globals["conjunction"] = verdicts.conjunction
        text = templates.get_template(f"{name}.j2").render(values)
        (lab.folder / name).write_text(text, encoding="utf-8")
    return lab.folder / REPORT_HTML


def _section(finding: Finding, lab: Lab) -> dict[str, Any]:
    picture = io.BytesIO()
    finding.picture().savefig(picture, format="png")
    settings = {setting.key: setting for setting in finding.claim.settings}
    return {
        "claim": finding.claim,
        "verdict": finding.verdict,
        "deciding": verdicts.deciding(finding.main),
        "elsewhere": finding.elsewhere,
        "picture": base64.b64encode(picture.getvalue()).decode(),
        "main": finding.main,
        "settings": [(settings[key], lines) for key, lines in finding.lines.items()],
        "minutes": finding.minutes,
        "commands": finding.claim.settings[0].commands(lab.seed),
    }
