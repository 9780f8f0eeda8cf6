"""The leaderboard: results of the benchmark, of whatever methods and folders, as one page.

python -m indexer_experiments.compare.leaderboard results/benchmark results/mine > leaderboard.md
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from classifier.results import RESULT_FILES, Row, means
from indexer_env.errors import IndexerError, refuse
from indexer_experiments.compare.baselines import LEARNING, NAMING, WRONG
from indexer_experiments.compare.measure import METRICS
from indexer_experiments.tables import table

COLUMNS = (*METRICS, (LEARNING, 1), (NAMING, 2))


def read(folders: Sequence[str]) -> list[Row]:
    """Rows of the benchmark in result folders of ``indexer compare study=benchmark``.

    Raises ParameterError for a folder without such results, and for a method that two of them measured.
    """
    rows: list[Row] = []
    for folder in folders:
        path = Path(folder) / RESULT_FILES[0]
        try:
            found = [Row(**row) for row in pq.read_table(path).to_pylist()]
        except (OSError, pa.ArrowInvalid, TypeError):
            found = []
        found = [row for row in found if row.study == "benchmark"]
        if not found:
            raise refuse("leaderboard", "folders", "results of indexer compare study=benchmark", folder)
        twice = {row.method for row in rows} & {row.method for row in found}
        if twice:
            raise refuse("leaderboard", "folders", "results of different methods", f"{min(twice)} in {folder} again")
        rows += found
    return rows


def page(rows: Sequence[Row]) -> str:
    """A table for each split, the method that misnames fewest records first."""
    found = means(rows)
    parts = []
    for split in dict.fromkeys(row.data for row in rows):
        methods = dict.fromkeys(row.method for row in rows if row.data == split)
        ranked = sorted(methods, key=lambda method: found[split, method, WRONG].value)
        lines = [
            [method, *(found[split, method, metric].text(digits) for metric, digits in COLUMNS)] for method in ranked
        ]
        parts.append(f"## Split by {split.replace('_', ' ')}\n\n{table(['method', *dict(COLUMNS)], lines)}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    try:
        if len(sys.argv) < 2:
            raise refuse("leaderboard", "folders", "one folder of results or more", "none")
        print(page(read(sys.argv[1:])), end="")
    except IndexerError as error:
        sys.exit(f"error: {error}")
