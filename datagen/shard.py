"""Shards: rows to Parquet files and back, with the schema of `datagen.schema`.

`read_shards(folder)` gives all records of a data set as one matrix with their table.

Plain lists, byte-stream split, zstd at level 1 and row groups of 256 records were chosen by measuring; the table of
sizes and speeds stands in docs/explanation/files.md.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from datagen.schema import COLUMNS, FORMAT, KINDS, RECORD, SAMPLED, SCHEMA_VERSION, Column, schema
from datagen.store import MANIFEST, ORDER, REJECTED
from indexer_cli.places import Place, open_place
from indexer_env.errors import IndexerError, SignalError
from indexer_records.channels import by_channel, channels_of

GROUP_RECORDS = 256
GROUP_SAMPLES = 2**22
"""Records and samples in one row group, at most: what a reader has to hold at once, 17 MB."""

COMPRESSION = "zstd"
COMPRESSION_LEVEL = 1

_PARQUET_VERSION = "2.6"


@dataclass(frozen=True, eq=False)
class Records:
    """A data set in memory.

    Attributes
    ----------
    records : numpy.ndarray, shape (n, samples), float32
        The samples, in the unit of the table's column `unit`; (n, channels, samples) for records of several channels.
    table : pyarrow.Table
        Every other column of `datagen.schema`, n rows in the order of the items.
    manifest : dict
        The data set's manifest.json.
    """

    records: np.ndarray
    table: pa.Table
    manifest: dict[str, Any]

    def __len__(self) -> int:
        return len(self.records)

    def row(self, index: int) -> dict[str, Any]:
        """One row as a mapping of column names, the record among them."""
        return {**self.table.slice(index, 1).to_pylist()[0], RECORD: self.records[index]}

    def subset(self, name: str) -> Records:
        """The rows of one subset: calibration, control or validation."""
        chosen = np.array([value == name for value in self.table.column("subset").to_pylist()], dtype=bool)
        return Records(self.records[chosen], self.table.filter(pa.array(chosen)), self.manifest)


def to_table(rows: Sequence[Mapping[str, Any]], records: np.ndarray) -> pa.Table:
    """Rows and their records, shape (n, samples), as an Arrow table with the full schema; a column that rows of
    their kind need not have is null where it is left out."""
    samples = np.ascontiguousarray(records, dtype=np.float32)
    layout = schema()
    offsets = np.arange(0, samples.size + 1, samples.shape[1], dtype=np.int32)
    arrays: list[pa.Array] = []
    for field in layout:
        if field.name == RECORD:
            arrays.append(pa.ListArray.from_arrays(pa.array(offsets), pa.array(samples.ravel()), type=field.type))
        else:
            arrays.append(pa.array(_values(rows, COLUMNS[field.name]), type=field.type))
    return pa.Table.from_arrays(arrays, schema=layout)


def _values(rows: Sequence[Mapping[str, Any]], column: Column) -> list[Any]:
    """A column's value in each row; KeyError where a row of its kind must have it and has not."""
    name, optional = column.name, {kind: column.may_be_null(kind) for kind in KINDS}
    return [row.get(name) if optional[row["kind"]] else row[name] for row in rows]


def parquet_bytes(table: pa.Table) -> bytes:
    """A table of records as the bytes of a shard."""
    sink = pa.BufferOutputStream()
    write_parquet(table, sink)
    return sink.getvalue().to_pybytes()


def write_parquet(table: pa.Table, path: Path | pa.NativeFile) -> None:
    """Write a table of records; the same table gives the same bytes."""
    pq.write_table(
        table,
        path,
        version=_PARQUET_VERSION,
        compression=COMPRESSION,
        compression_level=COMPRESSION_LEVEL,
        use_dictionary=[name for name in table.column_names if name not in SAMPLED],  # pyright: ignore[reportArgumentType]
        column_encoding={f"{name}.list.element": "BYTE_STREAM_SPLIT" for name in SAMPLED if name in table.column_names},
        row_group_size=_group_size(table),
    )


def _group_size(table: pa.Table) -> int:
    longest = pc.max(pc.list_value_length(table.column(RECORD))).as_py() or 1  # type: ignore[attr-defined]
    return max(1, min(GROUP_RECORDS, GROUP_SAMPLES // longest))


def read_manifest(folder: str | Path | Place) -> dict[str, Any]:
    """The manifest of a data set in a folder or behind a URL.

    Raises
    ------
    SignalError
        No such folder, no data set, an unfinished one, a damaged manifest, or one of another schema version.
    StoreError
        The folder cannot be read.
    """
    place = open_place(folder)
    content = place.read(MANIFEST)
    if content is None:
        if place.read(ORDER) is not None:
            remedy = "run the command that began it again, which goes on where it stopped"
            raise SignalError(f"{place} holds an unfinished data set; {remedy}.")
        rule = f"is no folder that holds a data set (no {MANIFEST})"
        raise SignalError(f"{place} {rule}; give a folder that indexer generate or indexer ingest wrote (out=FOLDER).")
    try:
        manifest = json.loads(content)
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise SignalError(f"{place}/{MANIFEST} is damaged ({error}); generate the data set again.") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise SignalError(
            f"{place}/{MANIFEST} is not the manifest of a data set; give a folder that indexer generate or indexer "
            "ingest wrote (out=FOLDER)."
        )
    if manifest.get("schema_version") != SCHEMA_VERSION:
        raise SignalError(
            f"{place} must have schema version {SCHEMA_VERSION}, got {manifest.get('schema_version')}; "
            "generate the data set again with this version of the package."
        )
    return manifest


def iterate_shards(folder: str | Path | Place) -> Iterator[pa.Table]:
    """The tables of a data set's shards, one at a time in the order of the items, so that memory stays that
    of one.

    Raises
    ------
    SignalError
        As `read_manifest`; a shard that is missing, cut short, damaged or of another schema.
    """
    place = open_place(folder)
    for entry in read_manifest(place)["shards"]:
        yield _read_shard(place, entry["name"], entry["bytes"])


def read_shards(path: str | Path | Place) -> Records:
    """All records of a data set in memory, from its folder or URL: 33 kB a record of 8200 samples.

    Raises
    ------
    SignalError
        As `iterate_shards`; a data set without a record, or with records of different lengths.
    """
    tables = list(iterate_shards(path))
    if not tables:
        raise SignalError(f"{path} holds no record, all items were rejected; see rejected.parquet for the reasons.")
    table = pa.concat_tables(tables)
    records = records_of(table, str(path))
    return Records(records, table.drop_columns([RECORD]), read_manifest(path))


def records_of(table: pa.Table, owner: str) -> np.ndarray:
    """The records of a table with all columns as one array, shape (n, samples) or (n, channels, samples) float32.

    Raises
    ------
    SignalError
        Records of different lengths or numbers of channels, or unequal channels.
    """
    matrix = record_matrix(table.column(RECORD), owner)
    counts = {len(channels_of(text)) for text in table.column("source_channel").unique().to_pylist()}
    if len(counts) != 1:
        got = f"{min(counts)} to {max(counts)} channels"
        raise SignalError(f"{owner} must hold records of one number of channels, got {got}.")
    channels = counts.pop()
    if matrix.shape[1] % channels:
        raise SignalError(
            f"{owner} must hold equally many samples of each of {channels} channels, got {matrix.shape[1]} in all."
        )
    return by_channel(matrix, channels)


def record_matrix(column: pa.ChunkedArray, owner: str) -> np.ndarray:
    """The records of a column as one matrix, shape (n, samples of all channels) float32, without a copy where Arrow
    holds them in one piece, as it does those of a row group.

    Raises
    ------
    SignalError
        Records of different lengths, or none.
    """
    # A piece at a time: Arrow counts the samples of one piece in 32 bits.
    pieces = [piece for piece in column.chunks if len(piece)]
    if not pieces:
        raise SignalError(f"{owner} must hold a record, got none.")
    lengths = np.unique(np.concatenate([np.diff(piece.offsets.to_numpy()) for piece in pieces]))
    if len(lengths) != 1:
        raise SignalError(f"{owner} must hold records of one length, got {lengths.min()} to {lengths.max()} samples.")
    matrices = [piece.flatten().to_numpy().reshape(len(piece), int(lengths[0])) for piece in pieces]
    return matrices[0] if len(matrices) == 1 else np.concatenate(matrices)


@contextlib.contextmanager
def open_shard(place: Place, name: str) -> Iterator[pq.ParquetFile]:
    """A shard to be read by row groups and columns.

    Raises
    ------
    SignalError
        It is missing or, when opened or while the block lasts, found to be damaged.
    """
    if place.size(name) is None:
        raise SignalError(f"{place}/{name} is missing but listed in the manifest; generate the data set again.")
    try:
        # Not pq.read_table: it would make a column of a folder that is named key=value.
        with place.open(name) as content, pq.ParquetFile(content) as file:
            yield file
    except (pa.ArrowException, OSError) as error:
        if isinstance(error, IndexerError):
            raise
        cause = str(error).splitlines()[0]
        raise SignalError(f"{place}/{name} is damaged ({cause}); generate the data set again.") from None


def read_rows(folder: str | Path | Place, items: Sequence[int]) -> list[dict[str, Any]]:
    """The rows of these items, each a mapping of column names with its record as a list.

    Raises
    ------
    SignalError
        As `open_shard`; an item that was rejected or that the data set does not have.
    """
    place = open_place(folder)
    manifest = read_manifest(place)
    rows = []
    for item in items:
        holders = [entry for entry in manifest["shards"] if entry["first_item"] <= item <= entry["last_item"]]
        found = [row for entry in holders for row in _rows_of(place, entry["name"], item)]
        if not found:
            rule = f"an item that has a record, 0 to {manifest['count'] - 1} without those of {REJECTED}"
            raise SignalError(f"item must be {rule}, got {item} of {place}.")
        rows += found
    return rows


def _rows_of(place: Place, name: str, item: int) -> list[dict[str, Any]]:
    """The row of an item in a shard, alone in a list, or an empty list."""
    with open_shard(place, name) as file:
        for group in range(file.num_row_groups):
            items = file.read_row_group(group, ["item"]).column(0).to_numpy()
            if item in items:
                return file.read_row_group(group).slice(int(np.flatnonzero(items == item)[0]), 1).to_pylist()
    return []


def _read_shard(place: Place, name: str, size: int) -> pa.Table:
    found = place.size(name)
    if found is not None and found != size:
        raise SignalError(
            f"{place}/{name} must have {size} bytes, got {found}; it was cut or changed, generate the data set again."
        )
    with open_shard(place, name) as file:
        table = file.read()
    if not table.schema.equals(schema()):
        different = sorted(set(COLUMNS).symmetric_difference(table.column_names)) or ["the type of a column"]
        raise SignalError(
            f"{place}/{name} does not follow schema version {SCHEMA_VERSION} ({different[0]}); "
            "generate the data set again."
        )
    return table
