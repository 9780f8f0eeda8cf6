"""Ways to store the same records as Parquet: bytes a record, and records a second written and read by one core."""

from __future__ import annotations

import io
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.report import Row, number, with_table
from benchmarks.stored import data_set
from datagen.schema import RECORD
from datagen.shard import COMPRESSION, COMPRESSION_LEVEL, GROUP_RECORDS, iterate_shards

PAGE = Path(__file__).parent.parent / "docs" / "explanation" / "files.md"
ALLOWED = 1.10
"""Bytes over those of zstd at its highest level."""


@dataclass(frozen=True)
class Way:
    """How a table is written; the defaults are those of `datagen.shard`."""

    compression: str = COMPRESSION
    level: int | None = COMPRESSION_LEVEL
    split: bool = True
    group: int = GROUP_RECORDS
    lists: str = "plain"

    def __str__(self) -> str:
        level = "" if self.level is None else f" {self.level}"
        split = "byte-stream split" if self.split else "plain encoding"
        return f"{self.lists} list, {split}, {self.compression}{level}, row groups of {self.group}"


CHOSEN, BEST = Way(), Way(level=22)
WAYS = (
    CHOSEN, Way(lists="fixed-size"), Way(lists="large"), Way(group=64), Way(group=512), Way(split=False),
    Way(compression="none", level=None, split=False), Way(compression="lz4", level=None),
    Way(level=3), Way(level=9), Way(level=19), BEST,
)  # fmt: skip


def measure(*, quick: bool) -> list[Row]:
    """A row for records without noise and one for those of the bench's sensor; their numbers hold every way."""
    rows = []
    for sensor in ("ideal", "bench"):
        table = next(iter(iterate_shards(data_set(sensor, 32 if quick else 512))))
        ways = (CHOSEN, BEST) if quick else WAYS
        found = {way: _measured(table, way, repeats=1 if quick else 3) for way in ways}
        own, best = found[CHOSEN]["bytes"] / 1000, found[BEST]["bytes"] / 1000
        ratio = own / best
        rows.append(
            Row(
                f"bytes a record of 8200 samples over those of zstd 22, sensor {sensor}",
                f"≤ {ALLOWED:g}",
                f"{ratio:.3f} ({own:.2f} kB of {best:.2f} kB)",
                ratio <= ALLOWED,
                {str(way): told for way, told in found.items()},
            )
        )
    if not quick:
        PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8"), page_table(rows)), encoding="utf-8")
    return rows


def page_table(rows: list[Row]) -> str:
    """The table of docs/explanation/files.md."""
    lines = ["| list, encoding, compression, row group | " + " | | | ".join(("no noise", "bench's sensor")) + " | | |"]
    lines.append("|---|" + "---:|" * 6)
    lines.append("| | " + " | ".join(("kB a record", "written/s", "read/s") * 2) + " |")
    for way in rows[0].numbers:
        told = [row.numbers[way] for row in rows]
        cells = [f"{one['bytes'] / 1000:.2f} | {number(one['written'])} | {number(one['read'])}" for one in told]
        lines.append(f"| {'**' + way + '**' if way == str(CHOSEN) else way} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _measured(table: pa.Table, way: Way, repeats: int) -> dict[str, Any]:
    table = _with_lists(table, way.lists)
    written, content = min((_write(table, way) for _ in range(repeats)), key=lambda found: found[0])
    read = min(_read(content) for _ in range(repeats))
    rows = len(table)
    return {"bytes": len(content) / rows, "written": rows / written, "read": rows / read}


def _with_lists(table: pa.Table, lists: str) -> pa.Table:
    if lists == "plain":
        return table
    samples = len(table.column(RECORD)[0])
    kind = pa.list_(pa.float32(), samples) if lists == "fixed-size" else pa.large_list(pa.float32())
    return table.set_column(table.column_names.index(RECORD), RECORD, table.column(RECORD).cast(kind))


def _write(table: pa.Table, way: Way) -> tuple[float, bytes]:
    """Processor time [s] and bytes; writing takes one thread."""
    sink, begin = io.BytesIO(), time.thread_time()
    pq.write_table(
        table,
        sink,
        version="2.6",
        compression=way.compression,
        compression_level=way.level,
        use_dictionary=[name for name in table.column_names if name != RECORD],  # pyright: ignore[reportArgumentType]
        column_encoding={f"{RECORD}.list.element": "BYTE_STREAM_SPLIT" if way.split else "PLAIN"},
        row_group_size=way.group,
    )
    return time.thread_time() - begin, sink.getvalue()


def _read(content: bytes) -> float:
    """Processor time [s] of reading the records alone, in one thread."""
    with pq.ParquetFile(pa.BufferReader(content)) as file:
        begin = time.thread_time()
        for group in range(file.num_row_groups):
            file.read_row_group(group, [RECORD], use_threads=False)
        return time.thread_time() - begin
