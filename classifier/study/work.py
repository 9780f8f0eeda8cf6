"""Working through claims: each is done once, its results kept in a folder of its own."""

from __future__ import annotations

import json
import textwrap
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from classifier.study.claims import Claim
from classifier.study.claims.base import Rows
from classifier.study.lab import Lab
from classifier.study.verdicts import Outcome, Verdict, overall
from classifier.style import style
from datagen.output_folder import output_folder
from datagen.places import StoreError
from datagen.versions import versions_of
from indexer_env.errors import refuse

STUDY_JSON = "study.json"
FINDING_JSON, RESULTS_PARQUET, FIGURE_PNG = "finding.json", "results.parquet", "figure.png"
CLAIM_FILES = (FINDING_JSON, RESULTS_PARQUET, FIGURE_PNG)
"""All that a claim's folder holds."""


@dataclass(frozen=True)
class Finding:
    """What was found about one claim.

    outcomes   under each of its settings, by key
    verdict    of the main settings together
    trainings  networks trained
    minutes    of processor time
    """

    outcomes: dict[str, Outcome]
    verdict: Verdict
    trainings: int
    minutes: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {**asdict(self), "outcomes": [outcome.to_dict() for outcome in self.outcomes.values()]}

    @classmethod
    def from_dict(cls, body: Mapping[str, Any]) -> Finding:
        """Inverse of `to_dict`."""
        outcomes = [Outcome.from_dict(outcome) for outcome in body["outcomes"]]
        own = {outcome.setting: outcome for outcome in outcomes}
        return cls(own, Verdict(body["verdict"]), body["trainings"], body["minutes"])


def open_study(lab: Lab) -> None:
    """Make the study's folder, or see that it is one of the same size and seed. Raises ParameterError, StoreError."""
    marked = {"size": asdict(lab.size), "seed": lab.seed}
    mark = lab.folder / STUDY_JSON
    if mark.is_file():
        held = json.loads(mark.read_text(encoding="utf-8"))
        if {key: held.get(key) for key in marked} != marked:
            rule = "a new folder, an empty one or that of a study of the same size and seed"
            raise refuse("study", "out", rule, str(lab.folder), "it holds one of another size or seed; name another")
        return
    if lab.folder.is_dir() and any(lab.folder.iterdir()):
        rule, remedy = "a new folder, an empty one or that of an earlier study", "it holds other files; name another"
        raise refuse("study", "out", rule, str(lab.folder), remedy)
    try:
        lab.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"out {lab.folder} cannot be made ({error.strerror}); choose another folder.") from None
    marked["versions"] = versions_of(("indexer-diagnosis", "numpy", "scipy", "torch"))
    mark.write_text(json.dumps(marked, indent=1) + "\n", encoding="utf-8")


def stored(claim: Claim, folder: Path) -> Finding | None:
    """What an earlier run found about a claim, None where it has not been done."""
    path = folder / claim.key / FINDING_JSON
    return Finding.from_dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else None


def work_on(claim: Claim, lab: Lab) -> Finding:
    """Do a claim under its settings and write results, picture and finding."""
    began = time.process_time()
    settings = [setting for setting in claim.settings if setting.main or lab.size.others]
    rows = {setting.key: claim.collect(lab, setting) for setting in settings}
    outcomes = {key: Outcome(key, claim.judge(own)) for key, own in rows.items()}
    verdict = overall([outcomes[setting.key].verdict for setting in settings if setting.main])
    trainings = sum(_networks(own) for own in rows.values())
    finding = Finding(outcomes, verdict, trainings, (time.process_time() - began) / 60)
    with output_folder(lab.folder / claim.key, CLAIM_FILES) as folder:
        pq.write_table(pa.Table.from_pylist([row for own in rows.values() for row in own]), folder / RESULTS_PARQUET)
        _picture(claim, rows).savefig(folder / FIGURE_PNG)
        body = json.dumps(finding.to_dict(), indent=1, ensure_ascii=False)
        (folder / FINDING_JSON).write_text(body + "\n", encoding="utf-8")
    return finding


def _networks(rows: Rows) -> int:
    """Networks behind the rows, which tell them apart by data set, variant and number."""
    if "networks" in rows[0]:
        return sum({(row["data_seed"], row["variant"]): row["networks"] for row in rows}.values())
    return len({(row["data_seed"], row.get("variant"), row["network"]) for row in rows})


def _picture(claim: Claim, rows: Mapping[str, Rows]) -> Figure:
    """The claim's figure under each main setting: side by side where it has one panel, else one row each."""
    main = [setting for setting in claim.settings if setting.main]
    with style():
        many = claim.panels > 1
        figure = Figure(figsize=(11, 3.6 * len(main)) if many else (11, 4.2), layout="constrained")
        parts = (
            figure.subfigures(len(main), 1, squeeze=False) if many else figure.subfigures(1, len(main), squeeze=False)
        )
        for part, setting in zip(parts.flatten(), main, strict=True):
            axes = part.subplots(1, claim.panels, squeeze=False).flatten()
            part.suptitle(textwrap.fill(f"{setting.key}: {setting.words}", 95 if many else 62), fontsize=9)
            claim.draw(list(axes), rows[setting.key])
    return figure


def findings(claims: Iterable[Claim], folder: Path) -> dict[str, Finding]:
    """What has been found so far, by claim."""
    found = ((claim.key, stored(claim, folder)) for claim in claims)
    return {key: finding for key, finding in found if finding is not None}
