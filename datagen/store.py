"""Files that appear whole or not at all, and the rule for whom a folder belongs to."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from indexer_env.errors import IndexerError

MANIFEST = "manifest.json"
UNFINISHED = "unfinished.json"
"""Stands in the folder from the first byte to the manifest, with the same order in it."""

REJECTED = "rejected.parquet"
SHARD_FOLDER = "data"
"""Shards have a folder of their own, so that every tool that opens a folder of Parquet files finds records
only."""

_OURS = ("example.csv", "example.json", REJECTED, UNFINISHED, MANIFEST)
_TEMPORARY = ".part"


class StoreError(IndexerError, OSError):
    """A folder or file of a data set cannot be written or read as one."""


def shard_name(number: int) -> str:
    """Path of a shard inside the data set, e.g. data/shard-00000.parquet."""
    return f"{SHARD_FOLDER}/shard-{number:05d}.parquet"


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; it takes its name when the block ends well, else
    nothing stays."""
    temporary = path.with_name(path.name + _TEMPORARY)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        if isinstance(error, IndexerError):
            raise
        raise StoreError(
            f"{path} cannot be written ({error.strerror or error}); check the disk and the folder."
        ) from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a mapping as JSON, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_free(folder: Path, overwrite: bool) -> None:
    """Refuse, without touching anything, a folder that a new data set may not go to.

    Raises
    ------
    StoreError
        It is a file or cannot be made, holds something, or (with `overwrite`) holds something other than one
        data set of ours.
    """
    check_place(folder)
    if not folder.exists():
        return
    held = _held(folder)
    if not held:
        return
    ours = (folder / MANIFEST).is_file() or (folder / UNFINISHED).is_file()
    if not overwrite:
        remedy = "add overwrite=true to replace it" if ours else "choose another folder"
        raise StoreError(f"out must be a new or empty folder, got {folder} with {len(held)} files in it; {remedy}.")
    if not ours:
        raise StoreError(
            f"overwrite replaces data sets only, got {folder} without a {MANIFEST}; choose another folder."
        )
    foreign = sorted(name for name in held if not _is_ours(name))
    if foreign:
        raise StoreError(
            f"overwrite replaces data sets only, got {folder} with {foreign[0]!r} in it; move that file first."
        )


def check_place(folder: Path) -> None:
    """Refuse, without touching anything, a path where no folder is and none can be made.

    Raises
    ------
    StoreError
        A file stands at the path or at a folder above it, or the place may not be written to.
    """
    place = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not place.is_dir():
        raise StoreError(f"out must be a folder, got {folder} where {place} is a file; choose another name.")
    if not os.access(place, os.W_OK | os.X_OK):
        raise StoreError(
            f"out must be a folder that may be written to, got {folder} in {place}; choose another or change its mode."
        )


@contextlib.contextmanager
def making(folder: Path, order: Mapping[str, Any], overwrite: bool) -> Iterator[None]:
    """Keep a folder that passes `check_free` to this run while the block lasts: marked as a data set in the
    making, the one it held taken out.

    Raises
    ------
    StoreError
        As `check_free`; another run is writing to the folder; it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise StoreError(f"out {folder} cannot be made ({error.strerror}); choose another folder.") from None
    try:
        # Held by the system until this process ends, however it ends: a stopped run leaves no stale lock.
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        check_free(folder, overwrite)
        write_json(folder / UNFINISHED, order)
        held = [name for name in _held(folder) if name != UNFINISHED]
        for name in sorted(held, key=lambda name: (name != MANIFEST, name)):
            (folder / name).unlink()
        yield
    except BlockingIOError:
        raise StoreError(
            f"out must be a folder that no other run is writing to, got {folder}; wait for it or choose another."
        ) from None
    finally:
        os.close(lock)


def finish(folder: Path, manifest: Mapping[str, Any]) -> None:
    """Publish the data set: from the manifest on it can be read."""
    write_json(folder / MANIFEST, manifest)
    (folder / UNFINISHED).unlink()


def _held(folder: Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()]


def _is_ours(name: str) -> bool:
    name = name.removesuffix(_TEMPORARY)
    folder, _, file = name.rpartition("/")
    return name in _OURS or (folder == SHARD_FOLDER and file.startswith("shard-") and file.endswith(".parquet"))
