"""Working through claims: each is done once, setting by setting, its results kept in a folder of its own."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from classifier.style import style
from datagen.versions import versions_of
from indexer_cli.output_folder import output_folder
from indexer_cli.places import StoreError
from indexer_cli.places.local import whole_file
from indexer_env.errors import ParameterError, refuse
from indexer_experiments.study.claims import Claim
from indexer_experiments.study.claims.base import Rows
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import Setting
from indexer_experiments.study.verdicts import Line, Verdict, conjunction

STUDY_JSON = "study.json"
RESULTS_PARQUET, FIGURE_PNG = "results.parquet", "figure.png"
CLAIM_FILES = (RESULTS_PARQUET, FIGURE_PNG)
"""All that a claim's folder holds."""

_MINUTES = b"processor_minutes"


@dataclass(frozen=True, eq=False)
class Finding:
    """What was found about one claim; all of it follows from the rows.

    rows     by setting, the main one first
    minutes  of processor time that they took
    """

    claim: Claim
    rows: dict[str, Rows]
    minutes: float

    @functools.cached_property
    def lines(self) -> dict[str, tuple[Line, ...]]:
        """The claim's lines under each setting that has been studied."""
        return {key: self.claim.judge(rows) for key, rows in self.rows.items()}

    @property
    def main(self) -> tuple[Line, ...]:
        """Those on which the verdict rests."""
        return next(iter(self.lines.values()))

    @property
    def verdict(self) -> Verdict:
        """That of the main setting."""
        return conjunction(self.main)

    @property
    def elsewhere(self) -> str:
        """One sentence: under which settings the verdict is another one; empty where no other has been studied."""
        others = {key: conjunction(lines) for key, lines in list(self.lines.items())[1:]}
        changed = {verdict: [f"“{key}”" for key, own in others.items() if own is verdict] for verdict in Verdict}
        told = [
            f"{verdict}: {', '.join(keys)}" for verdict, keys in changed.items() if keys and verdict != self.verdict
        ]
        if not others:
            return ""
        return f"Otherwise {'; '.join(told)}." if told else "The same under all other settings."

    def picture(self) -> Figure:
        """The claim's figure under the main setting."""
        with style():
            size = (11, 3.6) if self.claim.panels > 1 else (6.4, 3.9)
            figure = Figure(figsize=size, layout="constrained")
            axes = figure.subplots(1, self.claim.panels, squeeze=False).flatten()
            self.claim.draw(list(axes), next(iter(self.rows.values())))
        return figure


def open_study(lab: Lab) -> None:
    """Make the study's folder, or see that it is one of the same size, seed and versions.

    Raises ParameterError, StoreError.
    """
    versions = versions_of(("indexer-diagnosis", "numpy", "scipy", "torch"))
    marked: dict[str, Any] = {"size": asdict(lab.size), "seed": lab.seed, "versions": versions}
    mark = lab.folder / STUDY_JSON
    if mark.is_file():
        try:
            held = json.loads(mark.read_text(encoding="utf-8"))
        except ValueError:
            held = None
        if not isinstance(held, dict):
            rule = f"a folder whose {STUDY_JSON} is whole"
            raise refuse("study", "out", rule, str(lab.folder), "delete the folder, or name another")
        mine, others = _flat(marked), _flat(held)
        if other := [f"{key} {others.get(key)} instead of {mine[key]}" for key in mine if others.get(key) != mine[key]]:
            rule = "a new folder, an empty one or that of a study of the same size, seed and versions"
            remedy = f"it holds one with {', '.join(other)}; name another"
            raise refuse("study", "out", rule, str(lab.folder), remedy)
        return
    if lab.folder.is_dir() and any(lab.folder.iterdir()):
        rule, remedy = "a new folder, an empty one or that of an earlier study", "it holds other files; name another"
        raise refuse("study", "out", rule, str(lab.folder), remedy)
    try:
        lab.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"out {lab.folder} cannot be made ({error.strerror}); choose another folder.") from None
    with whole_file(mark) as temporary:
        temporary.write_text(json.dumps(marked, indent=1) + "\n", encoding="utf-8")


def _flat(marked: dict[str, Any]) -> dict[str, Any]:
    """What marks a study, by name: keys as typed, then the versions of packages."""
    size, versions = (part if isinstance(part := marked.get(key), dict) else {} for key in ("size", "versions"))
    return {**{f"size.{name}": value for name, value in size.items()}, "seed": marked.get("seed"), **versions}


def stored(claim: Claim, folder: Path) -> Finding | None:
    """What an earlier run found about a claim, None where it has not been done.

    Raises ParameterError where the file is damaged, or of settings that the claim does not have.
    """
    path = folder / claim.key / RESULTS_PARQUET
    if not path.is_file():
        return None
    rows: dict[str, Rows] = {}
    known = [setting.key for setting in claim.settings]
    remedy = f"delete {path.parent}, and the claim is worked on again"
    try:
        table = pq.read_table(path)
        for row in table.to_pylist():
            rows.setdefault(row["setting"], []).append(row)
        minutes = float((table.schema.metadata or {})[_MINUTES])
    except (pa.ArrowInvalid, OSError, KeyError, ValueError):
        rule = f"a folder in which {RESULTS_PARQUET} of each claim is whole"
        raise refuse("study", "out", rule, str(path), remedy) from None
    if list(rows)[:1] != known[:1] or not set(rows) <= set(known):
        named, there = (", ".join(f"“{key}”" for key in keys) or "none" for keys in (known, rows))
        rule = f"a folder whose results of {claim.key} are of its settings, {named}"
        raise ParameterError(f"study.out must be {rule}, got {there} in {path}; {remedy}.")
    return Finding(claim, rows, minutes)


def done(claim: Claim, lab: Lab) -> Finding | None:
    """What an earlier run found about a claim; None where a setting or the picture is missing.

    Raises as `stored`.
    """
    finding = stored(claim, lab.folder)
    if finding is None or not (lab.folder / claim.key / FIGURE_PNG).is_file():
        return None
    return finding if {setting.key for setting in asked(claim, lab)} <= set(finding.rows) else None


def asked(claim: Claim, lab: Lab) -> Sequence[Setting]:
    """The settings of a claim in this study, the main one first."""
    return claim.settings if lab.size.others else claim.settings[:1]


def work_on(claim: Claim, lab: Lab) -> Finding:
    """Do a claim under the settings of which nothing is stored; keep the results of each as they come, then the
    picture."""
    finding = stored(claim, lab.folder) or Finding(claim, {}, 0.0)
    for setting in asked(claim, lab):
        if setting.key in finding.rows:
            continue
        began = time.process_time()
        rows = claim.collect(lab if setting is claim.settings[0] else lab.for_others(), setting)
        minutes = finding.minutes + (time.process_time() - began) / 60
        finding = Finding(claim, {**finding.rows, setting.key: rows}, minutes)
        _keep(finding, lab.folder / claim.key)
    figure = finding.picture()
    with whole_file(lab.folder / claim.key / FIGURE_PNG) as picture:
        figure.savefig(picture, format="png")
    return finding


def _keep(finding: Finding, folder: Path) -> None:
    table = pa.Table.from_pylist([row for own in finding.rows.values() for row in own])
    table = table.replace_schema_metadata({_MINUTES: str(finding.minutes)})
    with output_folder(folder, CLAIM_FILES, overwrite=True) as fresh:
        pq.write_table(table, fresh / RESULTS_PARQUET)
