"""Trainings as a table: one row a run, all runs of a sweep together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from classifier.dataset import SUBSETS
from classifier.train import Result
from indexer_cli.places.local import whole_file
from indexer_cli.sweep import of_this_sweep

RUNS = "results.parquet"
"""A run's one row in its own folder, and the rows of all runs in the folder of a sweep."""

_PLACES = ("out", "overwrite")


def row_of(result: Result, config: Mapping[str, Any], run: str, seconds: float) -> dict[str, Any]:
    """A run as plain values by column: its name, every setting by its dotted key, epochs, the scores of the kept
    network by subset, and how long it took [s]."""
    settings = {key: value for key, value in config.items() if key not in _PLACES}
    scores = {
        f"{subset}_{name}": value
        for subset in SUBSETS
        for name, value in result.score(subset).to_dict().items()
        if isinstance(value, float)
    }
    training, kept = result.training, result.kept
    return {
        "run": run,
        **dict(_flat(settings)),
        "epochs": int(training.epochs[kept]),
        "best_epoch": int(training.best_epoch[kept]),
        "stopped_by": training.stopped_by[kept],
        **scores,
        "parts": ", ".join(part.kind for part in result.model.parts),
        "left_out": "; ".join(f"{name}: {reason}" for name, reason in result.model.left_out.items()),
        "seconds": seconds,
        "manifest_sha256": str(result.model.provenance["data"].get("manifest_sha256", "")),
    }


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, ", ".join(map(str, value)) if isinstance(value, list) else value


def write_runs(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows as a Parquet file that appears whole or not at all; a column that a row lacks is null there."""
    columns = dict.fromkeys(name for row in rows for name in row)
    _replace(pa.table({name: [row.get(name) for row in rows] for name in columns}), path)


def collect(sweep: Path) -> int:
    """Write the rows of all runs of a sweep into one table in its folder; gives their number.

    Runs may end at the same time in several processes: a table is written again until it holds every run that is there.
    """
    while True:
        found = _rows(sweep)
        tables = [pq.read_table(path) for path in found]
        _replace(pa.concat_tables(tables, promote_options="permissive"), sweep / RUNS)
        if _rows(sweep) == found:
            return len(found)


def _rows(sweep: Path) -> list[Path]:
    found = (path for path in sweep.glob(f"*/{RUNS}") if of_this_sweep(sweep, path))
    return sorted(found, key=lambda path: (len(path.parent.name), path.parent.name))


def _replace(table: pa.Table, path: Path) -> None:
    with whole_file(path, shared=True) as temporary:
        pq.write_table(table, temporary)
