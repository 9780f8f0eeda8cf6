"""From an order to a data set on disk: simulated, sensed and written a shard at a time, so memory stays that
of one shard.

Nothing is written before the first shard with a record has been simulated, so an order that cannot be
carried out leaves the folder as it was. Items that have no record are rows of rejected.parquet with the reason.
The manifest comes last: without it there is no data set.
"""

from __future__ import annotations

import contextlib
import itertools
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from datagen.campaign import SUBSETS, Campaign
from datagen.example import write_example
from datagen.order import Order
from datagen.produce import Produced, produce
from datagen.progress import Advance, progress
from datagen.rows import version_columns
from datagen.schema import FORMAT, SCHEMA_VERSION, rejected_schema
from datagen.shard import to_table, write_parquet
from datagen.store import REJECTED, check_free, finish, making, sha256, shard_name, whole_file
from indexer_env.errors import ParameterError


def generate(order: Order, out: str | Path, *, overwrite: bool = False) -> dict[str, Any]:
    """Generate a data set into the folder `out` and return its manifest.

    Raises
    ------
    ParameterError
        The order as a whole cannot be simulated, or none of its items can; a single item that cannot is
        recorded in rejected.parquet.
    StoreError
        `out` holds something (see `datagen.store.check_free`), is being written to or cannot be written.
    """
    folder = Path(out)
    check_free(folder, overwrite)
    tally = _Tally()
    shards: list[dict[str, Any]] = []
    with progress("simulating", order.count, "records") as advance:
        chunks = _chunks(order, advance)
        beginning = _until_a_record(chunks, order)
        with making(folder, _head(order), overwrite):
            with _rejects(folder) as rejects:
                for number, (rows, records, rejected) in enumerate(itertools.chain(beginning, chunks)):
                    tally.add(rows, rejected)
                    if rejected:
                        rejects.write_table(pa.Table.from_pylist(rejected, schema=rejected_schema()))
                    if rows:
                        shards.append(_write_shard(folder, shard_name(number), rows, records))
            write_example(order, folder)
            manifest = {**_head(order), **tally.summary(order.campaign), "shards": shards}
            finish(folder, manifest)
    return manifest


def _chunks(order: Order, advance: Advance) -> Iterator[Produced]:
    for first in range(0, order.count, order.shard_items):
        indices = range(first, min(first + order.shard_items, order.count))
        yield produce(order, [order.campaign.item(index, order.base, order.seed) for index in indices])
        advance(len(indices))


def _until_a_record(chunks: Iterator[Produced], order: Order) -> list[Produced]:
    """The chunks up to the first with a record; an order without one is a mistake in the order."""
    taken: list[Produced] = []
    for chunk in chunks:
        taken.append(chunk)
        if chunk[0]:
            return taken
    first = taken[0][2][0]
    raise ParameterError(
        f"datagen must be given an order with at least one item that can be simulated, got none of {order.count}; "
        f"item {first['item']}: {first['reason']}"
    )


@contextlib.contextmanager
def _rejects(folder: Path) -> Iterator[pq.ParquetWriter]:
    """The table of rejected items; it stands in every data set, without a row where nothing was rejected."""
    with whole_file(folder / REJECTED) as temporary, pq.ParquetWriter(temporary, rejected_schema()) as writer:
        yield writer


def _write_shard(folder: Path, name: str, rows: list[dict[str, Any]], records: np.ndarray) -> dict[str, Any]:
    with whole_file(folder / name) as temporary:
        write_parquet(to_table(rows, records), temporary)
        entry = {
            "name": name,
            "rows": len(rows),
            "first_item": rows[0]["item"],
            "last_item": rows[-1]["item"],
        }
        return {**entry, "bytes": temporary.stat().st_size, "sha256": sha256(temporary)}


def _head(order: Order) -> dict[str, Any]:
    versions = version_columns()
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "campaign": order.campaign.name,
        "seed": order.seed,
        "count": order.count,
        "versions": {name.removesuffix("_version"): versions[name] for name in versions if name != "schema_version"},
        "config": dict(order.config),
    }


class _Tally:
    """Counts of records and rejected items, kept as they pass."""

    def __init__(self) -> None:
        self.classes: Counter[str] = Counter()
        self.subsets: Counter[str] = Counter()
        self.rejected = 0
        self.unsettled = 0

    def add(self, rows: list[dict[str, Any]], rejected: list[dict[str, Any]]) -> None:
        self.classes.update(row["class_name"] for row in rows)
        self.subsets.update(row["subset"] for row in rows)
        self.rejected += len(rejected)
        self.unsettled += sum(not row["warmup_settled"] for row in rows)

    def summary(self, campaign: Campaign) -> dict[str, Any]:
        return {
            "records": self.subsets.total(),
            "rejected": self.rejected,
            "not_settled": self.unsettled,
            "classes": {name: self.classes[name] for name in campaign.classes()},
            "subsets": {name: self.subsets[name] for name in SUBSETS},
        }
