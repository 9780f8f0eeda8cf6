"""Working through claims: each is done once, its results kept in a folder of its own."""

from __future__ import annotations

import functools
import json
import textwrap
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from classifier.study.claims import Claim
from classifier.study.claims.base import Rows
from classifier.study.lab import Lab
from classifier.study.settings import Setting
from classifier.study.verdicts import Outcome, Verdict, overall
from classifier.style import style
from datagen.output_folder import output_folder
from datagen.places import StoreError
from datagen.versions import versions_of
from indexer_env.errors import refuse

STUDY_JSON = "study.json"
RESULTS_PARQUET, FIGURE_PNG = "results.parquet", "figure.png"
CLAIM_FILES = (RESULTS_PARQUET, FIGURE_PNG)
"""All that a claim's folder holds."""

_MINUTES = b"processor_minutes"


@dataclass(frozen=True, eq=False)
class Finding:
    """What was found about one claim; all of it follows from the rows.

    rows     by setting
    minutes  of processor time that they took
    """

    claim: Claim
    rows: dict[str, Rows]
    minutes: float

    @functools.cached_property
    def outcomes(self) -> dict[str, Outcome]:
        """Statements and verdict under each setting."""
        return {key: Outcome(key, self.claim.judge(own)) for key, own in self.rows.items()}

    @property
    def main(self) -> list[Setting]:
        """The settings on which the verdict rests."""
        return [setting for setting in self.claim.settings if setting.main]

    @property
    def others(self) -> list[Setting]:
        """The settings that show what it hangs on, where they have been studied."""
        return [setting for setting in self.claim.settings if setting.key in self.rows and not setting.main]

    @property
    def verdict(self) -> Verdict:
        """That of the main settings together."""
        return overall([self.outcomes[setting.key].verdict for setting in self.main])

    @property
    def trainings(self) -> int:
        """Networks trained."""
        return sum(_networks(own) for own in self.rows.values())

    def picture(self) -> Figure:
        """The claim's figure under each main setting: side by side where it has one panel, else one row each."""
        many = self.claim.panels > 1
        with style():
            count = len(self.main)
            figure = Figure(figsize=(11, 3.6 * count) if many else (4.3 * count, 3.9), layout="constrained")
            parts = figure.subfigures(*((count, 1) if many else (1, count)), squeeze=False).flatten()
            for part, setting in zip(parts, self.main, strict=True):
                axes = part.subplots(1, self.claim.panels, squeeze=False).flatten()
                part.suptitle(textwrap.fill(f"{setting.key}: {setting.words}", 95 if many else 50), fontsize=9)
                self.claim.draw(list(axes), self.rows[setting.key])
        return figure


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
    path = folder / claim.key / RESULTS_PARQUET
    if not path.is_file():
        return None
    table = pq.read_table(path)
    rows: dict[str, Rows] = {}
    for row in table.to_pylist():
        rows.setdefault(row["setting"], []).append(row)
    return Finding(claim, rows, float((table.schema.metadata or {})[_MINUTES]))


def work_on(claim: Claim, lab: Lab) -> Finding:
    """Do a claim under its settings; keep its results and its picture."""
    began = time.process_time()
    settings = [setting for setting in claim.settings if setting.main or lab.size.others]
    rows = {setting.key: claim.collect(lab, setting) for setting in settings}
    finding = Finding(claim, rows, (time.process_time() - began) / 60)
    table = pa.Table.from_pylist([row for own in rows.values() for row in own])
    table = table.replace_schema_metadata({_MINUTES: str(finding.minutes)})
    with output_folder(lab.folder / claim.key, CLAIM_FILES) as folder:
        pq.write_table(table, folder / RESULTS_PARQUET)
        finding.picture().savefig(folder / FIGURE_PNG)
    return finding


def _networks(rows: Rows) -> int:
    """Networks behind the rows, which tell them apart by data set, variant and number or count them."""
    if "networks" in rows[0]:
        return sum({(row["data_seed"], row["variant"]): row["networks"] for row in rows}.values())
    return len({(row["data_seed"], row.get("variant"), row["network"]) for row in rows})
