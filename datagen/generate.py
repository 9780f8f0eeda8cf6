"""From an order to a data set in a folder or behind a URL: shards are made side by side and published one by one, each
with a receipt, so memory stays that of the few in work and a stopped run loses no more than these.

Nothing is written before the first shard with a record has been made, so an order that cannot be carried out leaves the
folder as it was. Items that have no record are rows of rejected.parquet with the reason. The same order into the same
folder goes on where it was stopped; the manifest comes last, from the receipts of all shards, and is the same whoever
made them, in whatever order and after however many interruptions.
"""

from __future__ import annotations

import contextlib
import json
import logging
import time
from pathlib import Path
from typing import Any

from datagen.card import write_card
from datagen.example import write_example
from datagen.executors import Executor, LocalExecutor
from datagen.make_shard import MakeShard, Shard
from datagen.order import Order
from datagen.progress import Advance, progress
from datagen.receipts import Tally, earlier_receipts
from datagen.rows import made_with
from datagen.run_log import RunLog
from datagen.schema import FORMAT, SCHEMA_VERSION
from datagen.store import MANIFEST, REJECTED, State, check_ours, clear, finish, making, read_json, standing
from indexer_cli.places import Place, open_place
from indexer_cli.places.base import GO_ON
from indexer_env.device import cuda_of
from indexer_env.errors import ParameterError

_log = logging.getLogger(__name__)


def generate(
    order: Order, out: str | Path, *, overwrite: bool = False, executor: Executor | None = None
) -> dict[str, Any]:
    """Generate a data set into the folder or URL `out` and return its manifest.

    Where `out` holds the same order unfinished the run goes on; where it holds it finished nothing is done, or with
    `overwrite` all is made anew.

    Raises
    ------
    ParameterError
        The order as a whole cannot be simulated, its device is not here, or none of its items can be; a single item
        that cannot is recorded in rejected.parquet.
    StoreError
        `out` holds something else (see `datagen.store.standing`), is being written to or cannot be written.
    ExecutorError
        The executor cannot be had or has broken down.
    KeyboardInterrupt
        Stopped from the keyboard; its text says what is done and how to go on.
    """
    began, executor = time.monotonic(), executor or LocalExecutor()
    if executor.here:
        cuda_of("datagen", order.device)  # a device that is not here is refused before anything is made
    place, marked = open_place(out), head(order)
    state = standing(place, marked, overwrite)
    if state is State.FINISHED:
        _log.info("%s holds this data set already, nothing is left to do", place)
        with place.exclusive():
            clear(place)  # of a run that was stopped between its last two steps
        return read_json(place, MANIFEST) or {}
    with progress("simulating", order.count, "records") as advance:
        first = _until_a_record(order, marked, executor, advance) if state is State.FREE else []
        with making(place, marked, overwrite):
            run = RunLog(place, executor.describe(), began)
            manifest = _filled(order, marked, place, executor, first, run, advance)
            write_card(place, manifest, run.content())
            clear(place)
    return manifest


def head(order: Order) -> dict[str, Any]:
    """What the manifest says before anything is made; it marks the folder of an unfinished data set as this order's."""
    mapping = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "campaign": order.campaign.name,
        "seed": order.seed,
        "count": order.count,
        "versions": made_with(),
        "config": dict(order.config),
        "order_sha256": order.fingerprint,
    }
    # As it is read back: a tuple is a list there.
    return json.loads(json.dumps(mapping))


def _until_a_record(order: Order, marked: dict[str, Any], executor: Executor, advance: Advance) -> list[Shard]:
    """The shards up to the first with a record; an order without one is a mistake in the order."""
    made: list[Shard] = []
    for number in range(order.shards):
        made += executor.map(MakeShard(order, marked, threads=executor.threads(1)), [number])
        advance(made[-1].receipt.items)
        if made[-1].receipt.shard is not None:
            return made
    first = made[0].receipt.rejected[0]
    raise ParameterError(
        f"datagen must be given an order with at least one item that can be simulated, got none of {order.count}; "
        f"item {first['item']}: {first['reason']}"
    )


def _filled(
    order: Order,
    marked: dict[str, Any],
    place: Place,
    executor: Executor,
    first: list[Shard],
    run: RunLog,
    advance: Advance,
) -> dict[str, Any]:
    """The manifest of the folder once it has all shards: those that it had, the `first` ones, and the rest."""
    tally = Tally()
    for receipt in earlier_receipts(place, order.fingerprint):
        tally.add(receipt)
    earlier = tally.items
    if earlier:
        advance(earlier, earlier=True)
    try:
        for shard in first:
            # behind a URL another run of the same order may have made it in the meantime
            if shard.receipt.number not in tally.numbers:
                tally.add(shard.publish(place))
        _make_the_rest(order, marked, place, executor, tally, advance)
        advance.now("writing the example and the card")
        write_example(order, place)
        place.publish(REJECTED, tally.rejected_table(place))
        manifest = {**marked, **tally.summary(order.campaign.classes())}
        check_ours(place, marked)
        finish(place, manifest)
    except KeyboardInterrupt:
        run.end(tally.items - earlier)
        done = f"{tally.items} of {order.count} items are done and kept in {place}"
        raise KeyboardInterrupt(f"{done}; {GO_ON}") from None
    run.end(tally.items - earlier)
    return manifest


def _make_the_rest(
    order: Order, marked: dict[str, Any], place: Place, executor: Executor, tally: Tally, advance: Advance
) -> None:
    """Have the shards made and published that the tally lacks, and count them in."""
    missing = [number for number in range(order.shards) if number not in tally.numbers]
    task_publishes = executor.here or place.shared
    task = MakeShard(order, marked, place if task_publishes else None, executor.threads(len(missing)))
    with contextlib.closing(executor.map(task, missing)) as made:
        for shard in made:
            if not task_publishes:
                check_ours(place, marked)
                shard.publish(place)
            tally.add(shard.receipt)
            advance(shard.receipt.items)
