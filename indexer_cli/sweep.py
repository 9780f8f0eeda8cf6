"""What became of the jobs of a sweep (`-m`), as one table: job -> what it was given -> what came out."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig

TABLE = "sweep.csv"
"""Name of the table, in the folder of the sweep."""

_ROWS = ".sweep"


def outcome(results: Mapping[str, Any] | None = None, reason: str = "") -> dict[str, Any]:
    """What a job hands to Hydra: its results by name, or the sentence that says why it failed."""
    return {"results": dict(results or {}), "reason": reason}


class SweepTable(Callback):
    """Hydra's callback that keeps a row of each job, in whatever process it runs, and writes the table in the end.

    A sweep whose `out` is a URL has no folder here and leaves no table.
    """

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Keep the row of a job."""
        if config.hydra.mode is not RunMode.MULTIRUN:
            return
        given = dict(override.lstrip("+~").split("=", 1) for override in config.hydra.overrides.task if "=" in override)
        value = job_return._return_value
        said = value if isinstance(value, dict) and value.keys() == outcome().keys() else outcome(reason=str(value))
        row = {"job": config.hydra.job.num, "given": given, **said}
        rows = Path(config.hydra.sweep.dir) / _ROWS
        rows.mkdir(parents=True, exist_ok=True)
        (rows / f"{row['job']}.json").write_text(json.dumps(row, default=str), encoding="utf-8")

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Write the table."""
        folder = Path(config.hydra.sweep.dir)
        rows = [json.loads(path.read_text(encoding="utf-8")) for path in (folder / _ROWS).glob("*.json")]
        shutil.rmtree(folder / _ROWS, ignore_errors=True)
        if folder == Path() or not rows:
            return
        write_table(sorted(rows, key=lambda row: row["job"]), folder / TABLE)
        failed = sum(bool(row["reason"]) for row in rows)
        print(f"{len(rows)} jobs, {failed} failed: {folder / TABLE}")


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows {job, given, results, reason} as CSV: of what was given, what differs from job to job."""
    keys = dict.fromkeys(key for row in rows for key in row["given"])
    varied = [key for key in keys if len({row["given"].get(key) for row in rows}) > 1]
    results = dict.fromkeys(name for row in rows for name in row["results"])
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["job", *varied, "outcome", *results, "reason"])
        for row in rows:
            given = [row["given"].get(key, "") for key in varied]
            values = [row["results"].get(name, "") for name in results]
            table.writerow([row["job"], *given, "failed" if row["reason"] else "done", *values, row["reason"]])
