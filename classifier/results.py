"""Results of comparisons: one number a row, and their means with intervals over the seeds."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy import stats

from indexer_env.checks import check_choice
from indexer_env.errors import refuse

CONFIDENCE = 0.95
"""Share of repetitions of the whole comparison whose interval would hold the true mean."""

RESULT_FILES = ("results.parquet", "table.md", "config.json")
"""What `write_results` leaves in a folder."""


@dataclass(frozen=True)
class Row:
    """One number.

    study   which comparison
    data    the data set it was measured on
    method  what was measured
    metric  what the number is, with its unit where it has one
    seed    of data and training
    value   the number
    x       where it stands on an axis, for curves; NaN: nowhere
    """

    study: str
    data: str
    method: str
    metric: str
    seed: int
    value: float
    x: float = math.nan


def chosen_methods(command: str, given: object, known: Sequence[str]) -> tuple[str, ...]:
    """The methods that a command is to compare; null stands for all.

    Raises ParameterError for what is no list of known names.
    """
    if given is None:
        return tuple(known)
    if not isinstance(given, list) or not given:
        raise refuse(command, "methods", f"null or a list of some of {', '.join(known)}", given)
    for name in given:
        check_choice(command, "methods", name, known)
    return tuple(dict.fromkeys(given))


def to_table(rows: Iterable[Row]) -> pa.Table:
    """Rows as an Arrow table, a column for each of their fields."""
    return pa.Table.from_pylist([asdict(row) for row in rows])


def write_results(folder: Path, rows: Iterable[Row], text: str, config: Mapping[str, Any]) -> None:
    """Write the rows, what is said of them and the configuration that gave them into an existing folder."""
    table, words, settings = (folder / name for name in RESULT_FILES)
    pq.write_table(to_table(rows), table)
    words.write_text(text, encoding="utf-8")
    settings.write_text(json.dumps(config, indent=1) + "\n", encoding="utf-8")


class Mean(NamedTuple):
    """Mean over the seeds, the ends of its interval by Student's t, and the number of seeds that it is over.

    The interval says where the mean over all seeds lies, not where one training would; NaN for a single seed.
    """

    value: float
    low: float
    high: float
    seeds: int

    def text(self, digits: int) -> str:
        """Such as ``1.2 ± 0.3``."""
        if not np.isfinite(self.high):
            return f"{self.value:.{digits}f}"
        return f"{self.value:.{digits}f} ± {self.high - self.value:.{digits}f}"


def mean(values: Sequence[float]) -> Mean:
    """Mean of one value per seed; values that are NaN (not defined for this seed) do not count."""
    known = np.array([value for value in values if not np.isnan(value)])
    if len(known) == 0:
        return Mean(*[float("nan")] * 3, seeds=0)
    centre = float(known.mean())
    if len(known) == 1:
        return Mean(centre, float("nan"), float("nan"), 1)
    reach = stats.t.ppf((1 + CONFIDENCE) / 2, len(known) - 1) * known.std(ddof=1) / np.sqrt(len(known))
    return Mean(centre, centre - float(reach), centre + float(reach), len(known))


def means(rows: Iterable[Row]) -> dict[tuple[str, str, str], Mean]:
    """Mean over the seeds by (data, method, metric), in the order in which the rows come."""
    found: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        found.setdefault((row.data, row.method, row.metric), []).append(row.value)
    return {key: mean(values) for key, values in found.items()}


def differences(rows: Iterable[Row], metric: str, reference: str) -> list[Row]:
    """A metric of every method minus that of the reference on the same data and seed: what all methods share, such as a
    hard data set, drops out.
    """
    chosen = [row for row in rows if row.metric == metric]
    base = {(row.data, row.seed): row.value for row in chosen if row.method == reference}
    return [
        replace(row, metric=f"{metric} minus {reference}", value=row.value - base[row.data, row.seed])
        for row in chosen
        if row.method != reference and (row.data, row.seed) in base
    ]


def markdown(rows: Sequence[Row], metrics: Sequence[tuple[str, int]]) -> str:
    """A table with a line for each data set and method and a column for each metric with its number of decimals."""
    found = means(rows)
    heads = ["data", "method", *(metric for metric, _ in metrics)]
    lines = [" | ".join(heads), " | ".join(["---", "---", *["---:"] * len(metrics)])]
    shown = {metric for metric, _ in metrics}
    for data, method in dict.fromkeys((data, method) for data, method, metric in found if metric in shown):
        cells = [
            found[key].text(digits) if (key := (data, method, metric)) in found else "" for metric, digits in metrics
        ]
        lines.append(" | ".join([data, method, *cells]))
    return "".join(f"| {line} |\n" for line in lines)
