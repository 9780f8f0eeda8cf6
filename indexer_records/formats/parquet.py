"""Parquet files: every numeric column; the unit from the field's metadata (key "unit") or the column's name.
Timestamps, such as an index of pandas, are time in s since the first of them."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from indexer_records.formats.gate import reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import Column, MeasuredTable, check_content, finite, split_title

_NAME = "Parquet"

_DECIMALS = {"s": 0, "ms": 3, "us": 6, "ns": 9}
"""Digits of a second that a tick of each unit is worth."""


def read(path: Path) -> MeasuredTable:
    """The columns of numbers and times; a null is no number."""
    with reading(path, _NAME), pq.ParquetFile(path, page_checksum_verification=True) as file:
        # A text of any length may stand once for all rows: what is no number is never unpacked.
        names = [field.name for field in file.schema_arrow if _is_number(field.type) or _is_clock(field.type)]
        check_content(path, 8 * file.metadata.num_rows * len(names), columns=len(names))
        table = file.read(columns=names)
        table.validate(full=True)
    columns = []
    for title, field, chunks in zip(table.column_names, table.schema, table.columns, strict=True):
        name, unit = split_title(title)
        if _is_clock(field.type):
            seconds = partial(_seconds, chunks, path, name)
            columns.append(Column(name, "s", table.num_rows, seconds, _DECIMALS[field.type.unit], clock=True))
            continue
        if field.metadata and b"unit" in field.metadata:
            unit = field.metadata[b"unit"].decode(errors="replace")
        columns.append(Column(name, unit, table.num_rows, partial(_numbers, chunks, path, name)))
    return MeasuredTable(path, tuple(columns), row_word="row")


def _is_number(kind: pa.DataType) -> bool:
    return pa.types.is_floating(kind) or pa.types.is_integer(kind)


def _is_clock(kind: pa.DataType) -> bool:
    return pa.types.is_timestamp(kind) or pa.types.is_duration(kind)


def _seconds(chunks: pa.ChunkedArray, path: Path, name: str) -> np.ndarray:
    # Whole ticks: since 1970 there are too many for a float64.
    ticks = chunks.cast(pa.int64())
    since = pc.subtract(ticks, ticks[0]).cast(pa.float64(), safe=False)  # type: ignore[attr-defined]
    return finite(np.array(since.to_numpy()) / 10.0 ** _DECIMALS[chunks.type.unit], path, name, "row", 0)


def _numbers(chunks: pa.ChunkedArray, path: Path, name: str) -> np.ndarray:
    # A long integer may lose its last digits in float64: Arrow would refuse the whole column for it.
    return finite(np.array(chunks.cast(pa.float64(), safe=False).to_numpy()), path, name, "row", 0)


FORMAT = Format(_NAME, (".parquet", ".pq"), lambda head: head.startswith(b"PAR1"), read)
