"""Turns of measured files -> a data set on disk, a shard at a time."""

from __future__ import annotations

import hashlib
import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from datagen.campaign import SUBSETS, Label
from datagen.card import write_card
from datagen.ingest.cut import Seen, cut
from datagen.ingest.settings import CAMPAIGN, Settings
from datagen.ingest.sources import Source
from datagen.ingest.split import labels_of
from datagen.ingest.survey import check_channels, surveyed
from datagen.progress import Advance, progress
from datagen.rows import made_with
from datagen.schema import FORMAT, SCHEMA_VERSION, rejected_schema
from datagen.shard import parquet_bytes, to_table
from datagen.store import REJECTED, State, clear, finish, making, shard_name, standing
from indexer_cli.places import Place, StoreError, open_place
from indexer_env.errors import SignalError, refuse

Entry = tuple[Mapping[str, Any], np.ndarray | None]
"""A row with its record, or a row of rejected.parquet with None."""


def ingest(
    sources: Sequence[Source],
    settings: Settings,
    out: str | Path,
    *,
    config: Mapping[str, Any] | None = None,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Write the turns of these files into the folder `out` as a data set and return its manifest.

    Raises
    ------
    ParameterError
        The files cannot be split as asked.
    SignalError
        No file gives a single good turn; nothing was written.
    StoreError
        `out` holds something (see `datagen.store.standing`), is being written to or cannot be written.
    """
    folder, head = Path(out), _head(settings, config or {}, len(sources))
    # The same settings do not mean the same files, so nothing that is there is taken over.
    if standing(open_place(folder), head, overwrite) is State.FINISHED:
        raise StoreError(f"out must be a new or empty folder, got {folder} with a data set in it; add overwrite=true.")
    inside = next((source.name for source in sources if folder.resolve() in source.path.resolve().parents), None)
    if inside is not None:
        raise refuse("ingest", "out", "a folder without measured files", str(folder), f"{inside} lies in it")
    labels = labels_of(sources, settings.split, settings.seed)
    check_channels(sources, settings)
    settings = surveyed(sources, settings)
    tally = _Tally()
    with progress("ingesting", len(sources), "files") as advance:
        entries = _entries(sources, labels, settings, tally, advance)
        beginning = _until_a_record(entries, len(sources))
        with making(folder, head, overwrite, anew=True) as place:
            shards = _written(place, itertools.chain(beginning, entries), settings.shard_items)
            records = {
                "sample_rate": settings.sample_rate,
                "duration": settings.grid.samples / settings.grid.rate,
            }
            manifest = {**head, **tally.summary(labels), **records, "shards": shards}
            finish(place, manifest)
            write_card(place, manifest, {})
            clear(place)
    return manifest


def _entries(
    sources: Sequence[Source], labels: Sequence[Label], settings: Settings, tally: _Tally, advance: Advance
) -> Iterator[Entry]:
    """Every turn and refusal with its item, counted from 0 in the order of the files."""
    items = itertools.count()
    seen = Seen()
    for source, label in zip(sources, labels, strict=True):
        found = cut(source, label, settings, seen)
        tally.partial_turns += found.partial_turns
        for row, record in zip(found.rows, found.records, strict=True):
            entry = {**row, "item": next(items)}
            tally.add(entry, record is not None)
            yield entry, record
        advance(1)


def _until_a_record(entries: Iterator[Entry], files: int) -> list[Entry]:
    """The entries up to the first with a record; files without one are a mistake in the command."""
    taken: list[Entry] = []
    for entry in entries:
        taken.append(entry)
        if entry[1] is not None:
            return taken
    raise SignalError(
        f"ingest must be given files with at least one good turn, got none in {files}; "
        f"the first: {taken[0][0]['reason']}"
    )


def _written(place: Place, entries: Iterator[Entry], shard_items: int) -> list[dict[str, Any]]:
    shards: list[dict[str, Any]] = []
    number, rejects = itertools.count(), pa.BufferOutputStream()
    with pq.ParquetWriter(rejects, rejected_schema()) as writer:
        while chunk := list(itertools.islice(entries, shard_items)):
            rejected = [row for row, record in chunk if record is None]
            rows = [row for row, record in chunk if record is not None]
            if rejected:
                writer.write_table(pa.Table.from_pylist([dict(row) for row in rejected], schema=rejected_schema()))
            if rows:
                records = np.stack([record for _, record in chunk if record is not None])
                shards.append(_shard(place, shard_name(next(number)), rows, records))
    place.publish(REJECTED, rejects.getvalue().to_pybytes())
    return shards


def _shard(place: Place, name: str, rows: Sequence[Mapping[str, Any]], records: np.ndarray) -> dict[str, Any]:
    content = parquet_bytes(to_table(rows, records))
    place.publish(name, content)
    return {
        "name": name,
        "rows": len(rows),
        "first_item": rows[0]["item"],
        "last_item": rows[-1]["item"],
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def _head(settings: Settings, config: Mapping[str, Any], files: int) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "campaign": CAMPAIGN,
        "seed": settings.seed,
        "files": files,
        "versions": made_with(),
        "config": dict(config),
    }


class _Tally:
    """Counts of turns and refusals, kept as they pass."""

    def __init__(self) -> None:
        self.classes: Counter[str] = Counter()
        self.subsets: Counter[str] = Counter()
        self.rejected = 0
        self.partial_turns = 0

    def add(self, row: Mapping[str, Any], good: bool) -> None:
        if good:
            self.classes[row["class_name"]] += 1
            self.subsets[row["subset"]] += 1
        else:
            self.rejected += 1

    def summary(self, labels: Sequence[Label]) -> dict[str, Any]:
        names = {label.number: label.name for label in labels}
        return {
            "count": self.subsets.total() + self.rejected,
            "records": self.subsets.total(),
            "rejected": self.rejected,
            "partial_turns": self.partial_turns,
            "classes": {names[number]: self.classes[names[number]] for number in sorted(names)},
            "subsets": {name: self.subsets[name] for name in SUBSETS},
        }
