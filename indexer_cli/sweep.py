"""What became of the jobs of a sweep (`-m`), as one table: job -> what it was given -> what came out."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from indexer_cli.arguments import copied_from
from indexer_cli.places import StoreError, is_url
from indexer_cli.places.local import LocalPlace, whole_file
from indexer_cli.words import stop_for

TABLE = "sweep.csv"
"""Name of the table, in the folder of the sweep."""

_ROWS, _BEGUN = ".sweep", "begun"
"""Folder of the rows while a sweep runs, and a file in it that is as old as the sweep's first job."""


def outcome(results: Mapping[str, Any] | None = None, reason: str = "") -> dict[str, Any]:
    """What a job hands to Hydra: its results by name, or the sentence that says why it failed."""
    return {"results": dict(results or {}), "reason": reason}


class SweepTable(Callback):
    """Hydra's callback that keeps the row of each job, in whatever process it runs, and the table with it: where a
    launcher gives up after a job that failed, the table holds all that ended.

    A sweep whose `out` is a URL has no folder here and leaves no table. Else the folder is its own while it runs.
    """

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Lock the folder and forget the rows of an earlier sweep. Without a usable folder Hydra refuses the sweep
        right after this.

        Raises SystemExit where another sweep runs there; Hydra would make a mere warning of an exception.
        """
        self._lock = contextlib.ExitStack()
        with contextlib.suppress(OmegaConfBaseException):
            if is_url(config.get("out")):
                return
            try:
                self._lock.enter_context(LocalPlace(_folder(config)).exclusive())
            except StoreError as error:
                stop_for(str(error))
            shutil.rmtree(_folder(config) / _ROWS, ignore_errors=True)

    def __getstate__(self) -> dict[str, Any]:
        """What a launcher hands to other processes: the lock stays here."""
        return {}

    def on_job_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Note when the sweep began."""
        if config.hydra.mode is not RunMode.MULTIRUN or is_url(config.get("out")):
            return
        rows = _folder(config) / _ROWS
        rows.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            (rows / _BEGUN).touch(exist_ok=False)

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Keep the row of a job."""
        if config.hydra.mode is not RunMode.MULTIRUN or is_url(config.get("out")):
            return
        folder = _folder(config)
        given = dict(override.lstrip("+~").split("=", 1) for override in config.hydra.overrides.task if "=" in override)
        given = {key: copied_from(key, told, config.hydra.searchpath) or told for key, told in given.items()}
        value = job_return._return_value
        said = value if isinstance(value, dict) and value.keys() == outcome().keys() else outcome(reason=str(value))
        row = {"job": config.hydra.job.num, "given": given, **said}
        with whole_file(folder / _ROWS / f"{row['job']}.json") as temporary:
            temporary.write_text(json.dumps(row, default=str), encoding="utf-8")
        if all(row["reason"] for row in _rows(folder)) and _stands(folder):
            return  # a sweep of which no job is done takes no earlier results away
        # Jobs may end at the same time in several processes: until the table holds every row that is there.
        while (rows := _rows(folder)) and (write_table(rows, folder / TABLE) or rows != _rows(folder)):
            pass

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Say where the table is."""
        folder = _folder(config)
        if rows := _rows(folder):
            failed = sum(bool(row["reason"]) for row in rows)
            said = f"{len(rows)} {'job' if len(rows) == 1 else 'jobs'}, {failed} failed"
            left = f"; {folder / TABLE} is that of an earlier sweep" if _stands(folder) else f": {folder / TABLE}"
            shutil.rmtree(folder / _ROWS, ignore_errors=True)
            print(f"{said}{left}")
            jobs = {str(row["job"]) for row in rows}
            if others := sorted(path.name for path in folder.glob("[0-9]*") if path.name not in jobs):
                print(f"of an earlier sweep, and in no row of the table: {', '.join(others)} in {folder}")
        self._lock.close()


def _stands(folder: Path) -> bool:
    """Whether the table of an earlier sweep is there, and none of this one."""
    return (folder / TABLE).is_file() and not of_this_sweep(folder, folder / TABLE)


def of_this_sweep(folder: Path, file: Path) -> bool:
    """Whether a file was written since the first job of the sweep in a folder began, and not by an earlier sweep."""
    begun = folder / _ROWS / _BEGUN
    return not begun.exists() or file.stat().st_mtime_ns >= begun.stat().st_mtime_ns


def _folder(config: DictConfig) -> Path:
    return Path(config.hydra.sweep.dir)


def _rows(folder: Path) -> list[dict[str, Any]]:
    rows = [json.loads(path.read_text(encoding="utf-8")) for path in (folder / _ROWS).glob("*.json")]
    return sorted(rows, key=lambda row: row["job"])


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows {job, given, results, reason} as CSV: of what was given, what differs from job to job."""
    keys = dict.fromkeys(key for row in rows for key in row["given"])
    varied = [key for key in keys if len({row["given"].get(key) for row in rows}) > 1]
    results = dict.fromkeys(name for row in rows for name in row["results"])
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow(["job", *varied, "outcome", *results, "reason"])
    for row in rows:
        given = [row["given"].get(key, "") for key in varied]
        values = [row["results"].get(name, "") for name in results]
        table.writerow([row["job"], *given, "failed" if row["reason"] else "done", *values, row["reason"]])
    with whole_file(path, shared=True) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8", newline="")
