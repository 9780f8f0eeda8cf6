"""Data sets as PyTorch sees them: shuffled batches streamed from the shards, or single records by their place.

    stream = RecordStream("data/table2", columns=("code",), subset="calibration")
    for epoch in range(10):
        stream.set_epoch(epoch)
        for batch in stream:
            batch["record"], batch["code"]  # (256, samples) and (256, outputs), float32

The stream makes whole batches itself, `threads` windows at once. In a DataLoader with worker processes it stands with
``batch_size=None``; that is slower, as every batch then crosses from one process to another in memory of its own.
Numbers come as tensors (null: NaN), texts as lists of str, and `code` as 0.0 and 1.0 of shape (n, outputs).
"""

from __future__ import annotations

import contextlib
import itertools
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import torch
from torch.utils.data import Dataset, IterableDataset, default_collate, get_worker_info

from datagen.campaign import SUBSETS
from datagen.schema import COLUMNS, RECORD, SAMPLED
from datagen.shard import open_shard, read_manifest, record_matrix
from indexer_cli.places import Place, open_place
from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import SignalError, refuse

T = TypeVar("T")

Batch = dict[str, Any]
"""`record`, shape (n, samples) float32, and n values of each column asked for."""


class RecordStream(IterableDataset[Batch]):
    """All records of a data set once an epoch, as shuffled batches.

    The shards are put in random order and their records cut into windows of `window` records; each window is read a
    row group at a time and shuffled whole; records of far apart places meet in a batch where a window spans several
    shards. The batches of an epoch follow from `seed`, epoch and sizes alone: more threads give the same ones in the
    same order, worker processes of a DataLoader in another. Only the last of them may be shorter. A window takes 67 MB
    at 2048 records of 8200 samples; each thread fills one while another is cut into batches.

    Parameters
    ----------
    folder : path or URL
        The data set.
    columns : sequence of str
        Columns that a batch holds beside `record`, e.g. ("code",) or ("fault_backlash", "item").
    subset : str or None
        calibration, control or validation; None: all records.
    batch_size : int
        Records in a batch, >= 1.
    window : int
        Records shuffled together, a multiple of `batch_size`.
    seed : int
        Of the shuffling, >= 0.
    threads : int
        Windows read at once, >= 1; worker processes of a DataLoader read one each.

    Raises
    ------
    ParameterError
        An argument breaks its rule.
    SignalError
        `folder` holds no data set or none of the subset's records; while reading: a damaged shard, or records of
        different lengths.
    """

    def __init__(
        self,
        folder: str | Path | Place,
        columns: Sequence[str] = ("code",),
        subset: str | None = None,
        *,
        batch_size: int = 256,
        window: int = 2048,
        seed: int = 0,
        threads: int = 2,
    ) -> None:
        check_integer("RecordStream", "batch_size", batch_size, low=1)
        check_integer("RecordStream", "threads", threads, low=1)
        check_integer("RecordStream", "seed", seed, low=0)
        check_integer("RecordStream", "window", window, low=batch_size)
        if window % batch_size:
            raise refuse("RecordStream", "window", f"a multiple of batch_size ({batch_size})", window)
        self._rows = _Rows(folder, columns, subset)
        self._batch_size, self._window, self._seed, self._threads = batch_size, window, seed, threads
        # Shared memory, so that workers that outlive an epoch see the next one's number.
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()

    def __len__(self) -> int:
        """Batches in an epoch."""
        return -(-len(self._rows) // self._batch_size)

    def set_epoch(self, epoch: int) -> None:
        """Say which epoch comes next; without it every epoch has the same batches."""
        check_integer("RecordStream", "epoch", epoch, low=0)
        self._epoch.fill_(epoch)

    def __iter__(self) -> Iterator[Batch]:
        worker = get_worker_info()
        number, workers = (worker.id, worker.num_workers) if worker else (0, 1)
        epoch = int(self._epoch)
        shards = np.random.default_rng((self._seed, epoch)).permutation(len(self._rows.shards))
        windows = range(-(-len(self._rows) // self._window))[number::workers]
        threads = 1 if worker else min(self._threads, len(windows))
        ahead = threads if threads > 1 else 0
        buffers = itertools.cycle(
            np.empty((min(self._window, len(self._rows)), self._rows.samples), dtype=np.float32)
            for _ in range(ahead + 1)
        )

        def fill(place: int, buffer: np.ndarray) -> tuple[int, np.ndarray, pa.Table]:
            return place, buffer, self._fill(buffer, shards, place * self._window)

        with contextlib.closing(_ahead(fill, zip(windows, buffers, strict=False), ahead)) as filled:
            for place, buffer, table in filled:
                # The stream of (seed, epoch, 0) is that of (seed, epoch), which the shards' order is drawn from.
                yield from self._batches(table, buffer, np.random.default_rng((self._seed, epoch, place + 1)))

    def _fill(self, buffer: np.ndarray, shards: np.ndarray, begin: int) -> pa.Table:
        """Read the window that begins at this place of the epoch: the records into the buffer, the other columns as a
        table."""
        tables: list[pa.Table] = []
        filled = passed = 0
        for shard in shards:
            rows = self._rows.rows[shard]
            first, last = max(begin - passed, 0), max(begin + self._window - passed, 0)
            passed += len(rows)
            for table, records in self._rows.read(shard, rows[first:last]) if first < len(rows) and last else ():
                buffer[filled : filled + len(records)] = records
                filled += len(records)
                tables.append(table)
        return pa.concat_tables(tables).combine_chunks()

    def _batches(self, table: pa.Table, buffer: np.ndarray, order: np.random.Generator) -> Iterator[Batch]:
        records = torch.from_numpy(buffer).unbind() if get_worker_info() else buffer
        columns = {name: values_of(table.column(name), name) for name in self._rows.columns}
        shuffled = order.permutation(len(table))
        for first in range(0, len(table), self._batch_size):
            places = shuffled[first : first + self._batch_size]
            yield {
                RECORD: _stacked(records, places),
                **{name: _taken(values, places) for name, values in columns.items()},
            }


class RecordTable(Dataset[Batch]):
    """The records of a data set by their place: for samplers, single looks and small data sets.

    A record costs the reading of its row group; a DataLoader asks for whole batches, which cost each row group that
    they touch once. `RecordStream` is faster wherever records are shuffled. Parameters and errors are as there.
    """

    def __init__(
        self, folder: str | Path | Place, columns: Sequence[str] = ("code",), subset: str | None = None
    ) -> None:
        self._rows = _Rows(folder, columns, subset)
        self._ends = np.cumsum([len(rows) for rows in self._rows.rows])

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> Batch:
        return self.__getitems__([index])[0]

    def __getitems__(self, indices: Sequence[int]) -> list[Batch]:
        """The records at these places; what a DataLoader calls for a batch."""
        wanted = np.asarray(indices, dtype=np.int64)
        if wanted.size and not -len(self) <= wanted.min() <= wanted.max() < len(self):
            raise IndexError(f"a place must be in 0 to {len(self) - 1}, got {indices}")
        wanted = wanted % len(self)
        places, back = np.unique(wanted, return_inverse=True)
        shards = np.searchsorted(self._ends, places, side="right")
        found = [row for shard in np.unique(shards) for row in self._singles(shard, places[shards == shard])]
        return [found[place] for place in back]

    def _singles(self, shard: int, places: np.ndarray) -> Iterator[Batch]:
        rows = self._rows.rows[shard]
        for table, records in self._rows.read(shard, rows[places - (self._ends[shard] - len(rows))]):
            columns = {name: values_of(table.column(name), name) for name in self._rows.columns}
            for place, record in enumerate(records):
                yield {RECORD: torch.tensor(record), **{name: values[place] for name, values in columns.items()}}


class _Rows:
    """The rows of a data set that were asked for, in the order of the items."""

    def __init__(self, folder: str | Path | Place, columns: Sequence[str], subset: str | None) -> None:
        for name in columns:
            check_choice("data set", "columns", name, [name for name in COLUMNS if name != RECORD])
        if subset is not None:
            check_choice("data set", "subset", subset, SUBSETS)
        self.place = open_place(folder)
        self.columns = list(columns)
        shards = read_manifest(self.place)["shards"]
        self.shards = [entry["name"] for entry in shards]
        self.rows = [self._chosen(entry, subset) for entry in shards]
        if not len(self):
            raise SignalError(f"{folder} must hold at least one record of the {subset or 'whole'} set, got none.")
        first = next(number for number, rows in enumerate(self.rows) if len(rows))
        _, records = next(self.read(first, self.rows[first][:1]))
        self.samples = records.shape[1]

    def __len__(self) -> int:
        return sum(map(len, self.rows))

    def _chosen(self, entry: dict[str, Any], subset: str | None) -> np.ndarray:
        """Rows of a shard that belong to the subset."""
        if subset is None:
            return np.arange(entry["rows"])
        with open_shard(self.place, entry["name"]) as file:
            return np.flatnonzero(np.array(file.read(["subset"]).column(0).to_pylist()) == subset)

    def read(self, shard: int, rows: np.ndarray) -> Iterator[tuple[pa.Table, np.ndarray]]:
        """These rows of a shard, ascending, a row group at a time: the columns asked for and the records."""
        name = self.shards[shard]
        with open_shard(self.place, name) as file:
            end = 0
            for group in range(file.num_row_groups):
                begin, end = end, end + file.metadata.row_group(group).num_rows
                low, high = np.searchsorted(rows, (begin, end))
                if low == high:
                    continue
                table = file.read_row_group(group, [RECORD, *self.columns], use_threads=False)
                records = record_matrix(table.column(RECORD), name)
                table = table.drop_columns([RECORD])
                if high - low < end - begin:
                    inside = rows[low:high] - begin
                    table, records = table.take(pa.array(inside)), records[inside]
                yield table, records


def _ahead(function: Callable[..., T], arguments: Iterable[tuple[Any, ...]], threads: int) -> Generator[T]:
    """Results in order, each being worked on by a thread while those before it are used; without threads when asked."""
    if not threads:
        yield from itertools.starmap(function, arguments)
        return
    pool, waiting = ThreadPoolExecutor(threads, thread_name_prefix="records"), iter(arguments)
    try:
        running = deque(pool.submit(function, *each) for each in itertools.islice(waiting, threads))
        while running:
            result = running.popleft().result()
            running.extend(pool.submit(function, *each) for each in itertools.islice(waiting, 1))
            yield result
    finally:
        pool.shutdown(cancel_futures=True)


def values_of(column: pa.ChunkedArray, name: str) -> torch.Tensor | list[str]:
    """A column as a tensor, null as NaN; texts as a list, but codes as 0.0 and 1.0, shape (n, outputs)."""
    if name == "code":
        codes = column.to_pylist()
        bits = np.frombuffer("".join(codes).encode("ascii"), dtype=np.uint8) - ord("0")
        return torch.from_numpy(bits.reshape(len(codes), -1).astype(np.float32))
    if pa.types.is_string(column.type):
        return column.to_pylist()
    if name in SAMPLED:
        if column.null_count:
            raise refuse("data set", "columns", "signals that every record has", name, f"generate it with {name}")
        return torch.from_numpy(record_matrix(column, name).copy())
    # A copy: Arrow's own memory is read-only, of which PyTorch warns.
    return torch.from_numpy(column.to_numpy().copy())


def _stacked(records: np.ndarray | tuple[torch.Tensor, ...], places: np.ndarray) -> torch.Tensor:
    """The records at these places as one tensor of its own memory."""
    if isinstance(records, np.ndarray):
        return torch.from_numpy(np.take(records, places, axis=0))
    # In a worker process this copies straight into memory that the training process shares.
    return default_collate([records[place] for place in places])


def _taken(values: torch.Tensor | list[str], places: np.ndarray) -> torch.Tensor | list[str]:
    return values[torch.from_numpy(places)] if isinstance(values, torch.Tensor) else [values[at] for at in places]
