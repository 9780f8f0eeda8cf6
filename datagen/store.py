"""The files of a data set, and the rule for whom a folder belongs to.

A folder is free, unfinished or finished. `unfinished/order.json` stands from before the first shard until after the
last file of the finished data set: while it stands, the run that it describes may go on there and no other. Once it
has gone, the folder is a data set if it holds a manifest.
"""

from __future__ import annotations

import contextlib
import enum
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from indexer_cli.places import Place, StoreError, open_place
from indexer_cli.places.base import GO_ON, TEMPORARY

MANIFEST = "manifest.json"
RUN = "run.json"
"""When, on what and with how many interruptions: the only file besides the card that two runs do not share."""

CARD = "README.md"
CROISSANT = "croissant.json"
PICTURES = "pictures"

REJECTED = "rejected.parquet"
SHARD_FOLDER = "data"
"""Shards have a folder of their own, so that every tool that opens a folder of Parquet files finds records
only."""

UNFINISHED = "unfinished"
ORDER = f"{UNFINISHED}/order.json"

_OURS = ("example.csv", "example.json", REJECTED, RUN, CARD, CROISSANT, MANIFEST)


class State(enum.Enum):
    """What a folder is to a run that wants to write there."""

    FREE = "nothing there, or a data set that is to be replaced"
    UNFINISHED = "the same order, not yet carried out"
    FINISHED = "the same order, carried out, and not to be replaced"


def shard_name(number: int) -> str:
    """Path of a shard inside the data set, e.g. data/shard-00000.parquet."""
    return f"{SHARD_FOLDER}/shard-{number:05d}.parquet"


def receipt_name(number: int) -> str:
    """Path of a shard's receipt inside an unfinished data set."""
    return f"{UNFINISHED}/shard-{number:05d}.json"


def as_json(content: Mapping[str, Any]) -> bytes:
    """A mapping as the bytes of a JSON file."""
    return (json.dumps(content, indent=2) + "\n").encode()


def read_json(place: Place, name: str) -> dict[str, Any] | None:
    """A JSON file of ours; None where there is none, or one that was cut short or is no mapping."""
    content = place.read(name)
    try:
        read = json.loads(content) if content else None
    except (json.JSONDecodeError, UnicodeDecodeError):
        return None
    return read if isinstance(read, dict) else None


def standing(place: Place, head: Mapping[str, Any], overwrite: bool) -> State:
    """What the folder is to the run with this head, found without touching anything.

    Raises
    ------
    StoreError
        It holds another order, something other than one data set of ours, or one whose shards are not all there; or no
        folder can be there.
    """
    if overwrite or place.size(MANIFEST) is None:
        # a data set that is finished is only read
        place.check()
    held = place.names()
    if not held:
        return State.FREE
    ours = MANIFEST in held or ORDER in held
    if overwrite:
        _check_ours(place, held, ours)
    if ORDER in held:
        if key := _difference(read_json(place, ORDER) or {}, head):
            if overwrite:
                return State.FREE
            remedy = "repeat the command that began it, choose another folder, or add overwrite=true to replace it"
            raise StoreError(f"out {place} holds an unfinished data set of another order ({key}); {remedy}.")
        return State.UNFINISHED
    if overwrite:
        return State.FREE
    if ours and (manifest := read_json(place, MANIFEST)) is not None:
        if not (key := _difference({name: manifest.get(name) for name in head}, head)):
            _check_shards(place, manifest)
            return State.FINISHED
        raise StoreError(f"out {place} holds a data set of another order ({key}); add overwrite=true to replace it.")
    remedy = "add overwrite=true to replace it" if ours else "choose another folder"
    raise StoreError(f"out must be a new or empty folder, got {place} with {len(held)} files in it; {remedy}.")


@contextlib.contextmanager
def making(out: str | Path | Place, head: Mapping[str, Any], overwrite: bool, *, anew: bool = False) -> Iterator[Place]:
    """Keep a folder to this run while the block lasts: marked as a data set in the making, the one it is to replace
    taken out, what an earlier run of the same order has left still there or, with `anew`, taken out too.

    Raises
    ------
    StoreError
        As `standing`; another run is writing to the folder; it cannot be made; it holds this order, carried out.
    """
    place = open_place(out)
    with place.exclusive():
        state = standing(place, head, overwrite)
        if state is State.FINISHED:
            raise StoreError(f"out {place} holds the data set already; another run has just finished it.")
        if state is State.FREE or anew:
            held = [name for name in place.names() if name != ORDER]
            if held or place.size(ORDER) is not None:
                # The mark first: whatever is left when this is stopped is still known to be ours.
                place.publish(ORDER, as_json(head))
                place.delete(sorted(held, key=lambda name: (name != MANIFEST, name)))
            elif not place.claim(ORDER, as_json(head)):
                standing(place, head, overwrite)
        yield place


def check_ours(place: Place, head: Mapping[str, Any]) -> None:
    """Refuse to go on where the mark of this run has gone or is another's: the filesystem has vanished, or another run
    has replaced the data set.

    Raises
    ------
    StoreError
        It has.
    """
    if place.read(ORDER) != as_json(head):
        raise StoreError(
            f"{place}/{ORDER} has gone or is another run's; see that the filesystem is there, then {GO_ON}."
        )


def finish(place: Place, manifest: Mapping[str, Any]) -> None:
    """Publish the data set: from the manifest on it can be read.

    Raises
    ------
    StoreError
        A shard that the manifest lists is not there.
    """
    gone = {entry["name"] for entry in manifest["shards"]}.difference(place.names())
    if gone:
        raise StoreError(f"{place}/{min(gone)} has gone; see that the filesystem is there, then {GO_ON}.")
    place.publish(MANIFEST, as_json(manifest))


def clear(place: Place) -> None:
    """Take out what an unfinished data set has beside a finished one; the mark goes first, since a run that finds it
    would take a missing receipt for a missing shard."""
    left = [name for name in place.names() if name.startswith(f"{UNFINISHED}/")]
    if left:
        place.delete(sorted(left, key=lambda name: name != ORDER))


def _check_ours(place: Place, held: list[str], ours: bool) -> None:
    if not ours:
        raise StoreError(f"overwrite replaces data sets only, got {place} without a {MANIFEST}; choose another folder.")
    foreign = sorted(name for name in held if not _is_ours(name))
    if foreign:
        raise StoreError(
            f"overwrite replaces data sets only, got {place} with {foreign[0]!r} in it; move that file first."
        )


def _check_shards(place: Place, manifest: Mapping[str, Any]) -> None:
    for entry in manifest["shards"]:
        size = place.size(entry["name"])
        if size != entry["bytes"]:
            got = f"without {entry['name']}" if size is None else f"with {entry['name']} of {size} bytes"
            raise StoreError(
                f"out must hold each shard that its {MANIFEST} lists, this one of {entry['bytes']} bytes, "
                f"got {place} {got}; put it back, or add overwrite=true to make the data set anew."
            )


def _is_ours(name: str) -> bool:
    name = name.removesuffix(TEMPORARY)
    folder, _, file = name.rpartition("/")
    shard = file.startswith("shard-") and file.endswith((".parquet", ".json"))
    picture = folder == PICTURES and file.endswith(".png")
    return name in (*_OURS, ORDER) or (folder in (SHARD_FOLDER, UNFINISHED) and shard) or picture


def _difference(there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """The first key in which two orders differ, as the user writes it, with both values; empty where they agree."""
    a, b = _flattened(there), _flattened(here)
    differing = [key for key in {**b, **a} if a.get(key) != b.get(key)]
    if not differing:
        return ""
    key = min(differing, key=lambda key: not key.startswith("config."))
    return f"{key.removeprefix('config.')} is {a.get(key)!r} there and {b.get(key)!r} here"


def _flattened(mapping: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        if isinstance(value, Mapping) and value:
            flat.update(_flattened(value, f"{prefix}{key}."))
        else:
            flat[prefix + key] = value
    return flat
