"""One page for all claims: each figure beside what the paper says, the verdict and the numbers behind it."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from classifier.study.claims import CLAIMS, Claim
from classifier.study.lab import Lab
from classifier.study.verdicts import LEVEL, Outcome, Verdict
from classifier.study.work import FIGURE_PNG, STUDY_JSON, Finding, findings

REPORT_HTML = "report.html"


def write_report(lab: Lab) -> Path:
    """Write the page of all claims that have been done in the study's folder; it needs no other file."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    page = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    page.globals["badge"] = _badge
    found = findings(CLAIMS.values(), lab.folder)
    text = page.get_template("report.html.j2").render(
        claims=[_section(CLAIMS[key], finding, lab) for key, finding in found.items()],
        level=round(100 * LEVEL),
        size=lab.size,
        seeds=lab.seeds,
        quick=lab.size.trainings < 10,
        versions=json.loads((lab.folder / STUDY_JSON).read_text(encoding="utf-8"))["versions"],
    )
    path = lab.folder / REPORT_HTML
    path.write_text(text, encoding="utf-8")
    return path


def _section(claim: Claim, finding: Finding, lab: Lab) -> Mapping[str, Any]:
    picture = base64.b64encode((lab.folder / claim.key / FIGURE_PNG).read_bytes()).decode()
    told = {setting.key: _told(finding.outcomes[setting.key], setting.words) for setting in claim.settings
            if setting.key in finding.outcomes}  # fmt: skip
    main = [setting for setting in claim.settings if setting.main]
    return {
        "key": claim.key,
        "title": claim.title,
        "where": claim.where,
        "says": claim.says,
        "choices": claim.choices,
        "verdict": finding.verdict,
        "picture": picture,
        "main": [told[setting.key] for setting in main],
        "others": [told[setting.key] for setting in claim.settings if setting.key in told and not setting.main],
        "trainings": finding.trainings,
        "minutes": finding.minutes,
        "commands": [setting.recipe.command(lab.seed) for setting in main],
    }


def _told(outcome: Outcome, words: str) -> dict[str, Any]:
    statements = [
        {
            "says": one.says,
            "short": one.says.partition(" (")[0],
            "rule": one.rule,
            "found": one.found,
            "holds": one.holds,
        }
        for one in outcome.statements
    ]
    return {"setting": outcome.setting, "words": words, "verdict": outcome.verdict, "statements": statements}


def _badge(verdict: Verdict) -> Markup:
    return Markup('<span class="v {}">{}</span>').format(str(verdict).replace(" ", "-"), str(verdict))
