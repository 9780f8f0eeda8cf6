"""One shard from an order and its number: the unit of work of every executor."""

from __future__ import annotations

import hashlib
import platform
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from datagen.order import Order
from datagen.produce import produce
from datagen.receipts import Receipt
from datagen.rows import made_with
from datagen.shard import parquet_bytes, to_table
from datagen.store import check_ours, shard_name
from indexer_cli.places import Place, StoreError


@dataclass(frozen=True)
class Shard:
    """A shard that is made: its file and its receipt; no file where every item was rejected."""

    content: bytes | None
    receipt: Receipt

    def publish(self, place: Place) -> Receipt:
        """Write the file and then the receipt, which says that the file is there."""
        if self.receipt.shard is not None and self.content is not None:
            place.publish(self.receipt.shard["name"], self.content)
        place.publish(self.receipt.name, self.receipt.content())
        return self.receipt


def make_shard(order: Order, number: int, threads: int = 1) -> Shard:
    """Simulate, sense and encode the items of shard `number`.

    Neither the number of threads nor the other shards change a byte.

    Raises
    ------
    ParameterError
        The run or the sensor does not suit the items as a whole.
    """
    indices = order.items_of(number)
    items = [order.campaign.item(index, order.base, order.seed) for index in indices]
    rows, records, rejected = produce(order, items, threads=threads)
    content, entry = None, None
    if rows:
        content = parquet_bytes(to_table(rows, records))
        entry = {
            "name": shard_name(number),
            "rows": len(rows),
            "first_item": rows[0]["item"],
            "last_item": rows[-1]["item"],
            "bytes": len(content),
            "sha256": hashlib.sha256(content).hexdigest(),
        }
    receipt = Receipt(
        number=number,
        order=order.fingerprint,
        items=len(indices),
        shard=entry,
        classes=dict(Counter(row["class_name"] for row in rows)),
        subsets=dict(Counter(row["subset"] for row in rows)),
        not_settled=sum(not row["warmup_settled"] for row in rows),
        rejected=rejected,
    )
    return Shard(content, receipt)


@dataclass(frozen=True)
class MakeShard:
    """What an executor does for each number: make the shard and, where a place is given, publish it there.

    Attributes
    ----------
    order : Order
    head : mapping
        The mark of the run in its folder (`datagen.generate.head`), with the versions that all shards must share.
    place : Place or None
        None gives the file back to whoever asked, because it is not yet known to be wanted or is to stand on another
        machine.
    threads : int
        Of one shard.
    """

    order: Order
    head: Mapping[str, Any]
    place: Place | None = None
    threads: int = 1

    def __call__(self, number: int) -> Shard:
        here = made_with()
        if here != self.head["versions"]:
            name = next(name for name in here if here[name] != self.head["versions"][name])
            raise StoreError(
                f"every node must have {name} {self.head['versions'][name]} as the one that started the run, "
                f"got {here[name]} on {platform.node()}; install the same versions there."
            )
        shard = make_shard(self.order, number, self.threads)
        if self.place is None:
            return shard
        check_ours(self.place, self.head)
        return Shard(None, shard.publish(self.place))
