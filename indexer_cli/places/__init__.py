"""A folder of files, on this machine or behind a URL: files in it appear whole or not at all, and last.

`open_place("data/table2")` is a folder of this machine, `open_place("s3://bucket/table2")` one of any filesystem that
fsspec knows. A local file is written beside its name, brought to the disk and renamed, so that neither a kill nor a
power cut leaves half of it; an object store takes a file as a whole by itself. `base` says what both offer, `local` and
`remote` are the two.
"""

from __future__ import annotations

from pathlib import Path

from indexer_cli.places.base import Place, StoreError
from indexer_cli.places.local import LocalPlace
from indexer_cli.places.remote import RemotePlace

__all__ = ["LocalPlace", "Place", "RemotePlace", "StoreError", "is_url", "open_place"]


def open_place(out: str | Path | Place) -> Place:
    """The folder at a path or URL; nothing is made or read.

    Raises
    ------
    StoreError
        A URL of an unknown protocol, or one whose package is not installed.
    """
    if isinstance(out, Place):
        return out
    if not is_url(out):
        return LocalPlace(Path(str(out).removeprefix("file://")))
    return RemotePlace(str(out))


def is_url(out: object) -> bool:
    """Whether this names a folder behind a URL; file:// is one of this machine."""
    return isinstance(out, str) and "://" in out and not out.startswith("file://")
