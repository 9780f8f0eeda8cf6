"""What lies in a watched folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from indexer_records.formats import SUFFIXES, csv


def files(folder: str | Path, below: str = "") -> Iterator[tuple[str, os.DirEntry[str]]]:
    """Files of the formats that are read, with their names from the watched folder on; neither links nor hidden ones.
    Raises OSError where the watched folder cannot be listed."""
    try:
        entries = list(os.scandir(folder))
    except OSError:
        if not below:
            raise
        return
    for entry in entries:
        if entry.is_symlink():
            continue
        if entry.is_dir():
            yield from files(entry.path, f"{below}{entry.name}/")
        elif not entry.name.startswith(".") and os.path.splitext(entry.name)[1].lower() in SUFFIXES and entry.is_file():
            yield below + entry.name, entry


def within_a_line(path: Path) -> bool:
    """Whether a text ends within a line; False for other files."""
    if path.suffix.lower() not in csv.FORMAT.suffixes:
        return False
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - 2))
            # of UTF-16 a zero stands before or behind the end of the line
            end = file.read().strip(b"\0")
    except OSError:
        return False
    return not end.endswith((b"\n", b"\r"))
