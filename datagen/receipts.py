"""The receipt of a shard: what it holds and what its items came to, written after it.

A shard without a receipt does not count and is made again; the receipts of all shards together are the manifest and
the table of rejected items.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from datagen.campaign import SUBSETS
from datagen.schema import rejected_schema
from datagen.store import ORDER, RUN, as_json, read_json, receipt_name
from indexer_cli.places import Place, StoreError
from indexer_cli.places.base import GO_ON

_REJECTED_TOGETHER = 4096
"""Rejected items in one row group, about."""


@dataclass(frozen=True)
class Receipt:
    """What became of the items of one shard.

    Attributes
    ----------
    number : int
        Which shard.
    order : str
        Fingerprint of the order it belongs to (`Order.fingerprint`).
    items : int
        Items, rejected ones included.
    shard : mapping or None
        The manifest's entry: name, rows, first_item, last_item, bytes, sha256; None where every item was rejected.
    classes, subsets : mapping
        Records of each class name and each subset.
    not_settled : int
        Records whose warm-up was not settled.
    rejected : sequence of mapping
        Rows of rejected.parquet.
    """

    number: int
    order: str
    items: int
    shard: Mapping[str, Any] | None
    classes: Mapping[str, int]
    subsets: Mapping[str, int]
    not_settled: int
    rejected: Sequence[Mapping[str, Any]]

    @property
    def name(self) -> str:
        """Its path inside the data set."""
        return receipt_name(self.number)

    def content(self) -> bytes:
        """Its file."""
        return as_json(dataclasses.asdict(self))


def earlier_receipts(place: Place, order: str) -> list[Receipt]:
    """The receipts of an interrupted run whose shards are there as they were written; everything else that was left,
    half-written files among it, is taken out."""
    held = place.names()
    valid = [receipt for name in held if (receipt := _read(place, name, order)) and _shard_is_there(place, receipt)]
    kept = {ORDER, RUN, *(receipt.name for receipt in valid), *(entry["name"] for entry in _entries(valid))}
    place.delete([name for name in held if name not in kept])
    return valid


def _read(place: Place, name: str, order: str) -> Receipt | None:
    if not name.startswith(receipt_name(0).partition("-")[0]):
        return None
    content = read_json(place, name)
    # Of another order after an interrupted overwrite=true.
    return Receipt(**content) if content and content.get("order") == order else None


def _shard_is_there(place: Place, receipt: Receipt) -> bool:
    shard = receipt.shard
    return shard is None or place.intact(shard["name"], shard["bytes"], shard["sha256"])


def _entries(receipts: Sequence[Receipt]) -> list[Mapping[str, Any]]:
    return [receipt.shard for receipt in receipts if receipt.shard is not None]


class Tally:
    """All that the manifest says of the shards, gathered as their receipts come in, in any order."""

    def __init__(self) -> None:
        self.numbers: set[int] = set()
        self.shards: dict[int, Mapping[str, Any]] = {}
        self.classes: Counter[str] = Counter()
        self.subsets: Counter[str] = Counter()
        self.items = self.not_settled = self.rejected = 0
        self.with_rejected: set[int] = set()

    def add(self, receipt: Receipt) -> None:
        """Count a receipt; its rejected items are not kept, since there may be any number of them."""
        self.numbers.add(receipt.number)
        if receipt.shard is not None:
            self.shards[receipt.number] = receipt.shard
        self.classes.update(receipt.classes)
        self.subsets.update(receipt.subsets)
        self.items += receipt.items
        self.not_settled += receipt.not_settled
        self.rejected += len(receipt.rejected)
        if receipt.rejected:
            self.with_rejected.add(receipt.number)

    def summary(self, classes: Sequence[str]) -> dict[str, Any]:
        """The counts as the manifest has them."""
        return {
            "records": self.subsets.total(),
            "rejected": self.rejected,
            "not_settled": self.not_settled,
            "classes": {name: self.classes[name] for name in classes},
            "subsets": {name: self.subsets[name] for name in SUBSETS},
            "shards": [self.shards[number] for number in sorted(self.shards)],
        }

    def rejected_table(self, place: Place) -> bytes:
        """rejected.parquet from the receipts in `place`, in the order of the items, without a row where nothing was
        rejected."""
        sink, waiting = pa.BufferOutputStream(), []
        with pq.ParquetWriter(sink, rejected_schema()) as writer:
            for number in sorted(self.with_rejected):
                content = read_json(place, receipt_name(number))
                if content is None:
                    raise StoreError(f"{place}/{receipt_name(number)} has gone; {GO_ON}.")
                waiting += content["rejected"]
                if len(waiting) >= _REJECTED_TOGETHER:
                    writer.write_table(pa.Table.from_pylist(waiting, schema=rejected_schema()))
                    waiting = []
            if waiting:
                writer.write_table(pa.Table.from_pylist(waiting, schema=rejected_schema()))
        return sink.getvalue().to_pybytes()
