"""Measured files that a folder, a pattern or a list names, and the cells of a table that says more about each."""

from __future__ import annotations

import csv
import glob
import os
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from indexer_env.errors import SignalError, refuse
from indexer_records.formats import SUFFIXES

FILE = "file"
"""Column that names the file of a row."""

_BESIDE = (".yaml", ".yml")
"""Endings of what is said about files."""

_COMMA = re.compile(r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$")
"""A number with a decimal comma."""


def files_found(command: str, key: str, files: str) -> tuple[Path, list[Path]]:
    """The folder that the files of a folder or a pattern have in common, and the files sorted by their name below it.
    Of a folder those with a known ending are taken; how many others there are is told on the error stream.

    Raises
    ------
    ParameterError
        There is none.
    """
    folder = Path(files)
    if folder.is_dir():
        hidden = {path for path in folder.rglob(".*")}
        shown = (path for path in folder.rglob("*") if not hidden.intersection((path, *path.parents)))
        every = [path for path in shown if path.is_file()]
        paths = [path for path in every if path.suffix.lower() in SUFFIXES]
        remedy = f"known endings are {', '.join(SUFFIXES)}"
    else:
        # A file's own name may hold what a pattern would.
        found = [files] if folder.is_file() else glob.glob(files, recursive=True)
        paths = [path for path in map(Path, found) if path.is_file()]
        remedy = f"a pattern is quoted: {key}='\"bench/**/*.tdms\"'" if glob.has_magic(files) else "check the path"
    if not paths:
        raise refuse(command, key, "a folder or pattern with measured files", files, remedy)
    if folder.is_dir():
        _tell_others(folder, [path for path in every if path.suffix.lower() not in (*SUFFIXES, *_BESIDE)])
    root = folder if folder.is_dir() else common_folder(paths)
    return root, sorted(paths, key=lambda path: path.relative_to(root).as_posix())


def _tell_others(folder: Path, others: Sequence[Path]) -> None:
    """That files are left out by their endings, as the format of one that is named is told by its content."""
    if others:
        count = "one file of another ending is" if len(others) == 1 else f"{len(others)} files of other endings are"
        example = min(path.relative_to(folder).as_posix() for path in others)
        print(f"in {folder} {count} left out, {example}; what a pattern names is read", file=sys.stderr)


def common_folder(paths: Sequence[Path]) -> Path:
    """The innermost folder that holds all these files."""
    return Path(os.path.commonpath([path.parent for path in paths]))


def table_rows(table: Path, noun: str, needed: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Lines of a CSV table, counted from 1, as cells by column; `noun` is what sentences call it, "labels table".

    Raises
    ------
    SignalError
        No UTF-8 text, no CSV, a column of `needed` that is missing or doubled, a row of another length.
    """
    try:
        text = table.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is no UTF-8 text"
        raise SignalError(f"the {noun} {table} cannot be read ({why}); give a CSV file.") from None
    lines = text.splitlines()
    delimiter = max(",;\t", key=lines[0].count) if lines else ","
    try:
        cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter, strict=True)]
    except csv.Error as error:
        raise SignalError(f"the {noun} {table} cannot be read ({error}); save it as CSV again.") from None
    if delimiter != ",":
        # where a decimal point is a comma, cells stand apart by something else
        cells = [[_COMMA.sub(r"\1.\2", cell) for cell in row] for row in cells]
    header = cells[0] if cells else []
    for name in needed:
        if header.count(name) != 1:
            raise SignalError(f"the {noun} {table} must have one column {name!r}, got {', '.join(header) or 'none'}.")
    if len(set(header)) != len(header) or "" in header:
        raise SignalError(f"the {noun} {table} must have a name of its own over each column, got {header}.")
    for line, row in enumerate(cells[1:], start=2):
        if not any(row):
            continue
        if len(row) != len(header):
            raise SignalError(f"{table}, line {line}: {len(row)} cells where the header has {len(header)}; repair it.")
        yield line, dict(zip(header, row, strict=True))
