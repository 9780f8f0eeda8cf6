"""Universal files (UFF, UNV): every real time history of the data sets 58 and 58b, named by its first ID line.

Even spacing gives the rate, uneven spacing a column of time beside the record. The units, that of time among them, are
the axis labels of the file. Source of the layout: SDRC, Universal Dataset Number 58.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from indexer_records.formats.gate import damaged, library, reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import TIME_UNITS, Column, MeasuredTable, column_of, distinct

_NAME = "UFF"
_MARK = b"    -1"
_LINE = 82
"""Bytes of the longest line, its end included."""
_MARK_LINE = re.compile(rb"^    -1[ ]*\r?$\n?", re.MULTILINE)
_LINE_END = re.compile(rb"\r?\n?")
_HEADER_LINES = 12
"""Of a set 58, the one with its number included."""

_TIME_HISTORY = 1
_REAL = (2, 4)
_UNEVEN = 0
_NO_LABEL = ("", "NONE")


def read(path: Path) -> MeasuredTable:
    """Every real time history, in file order."""
    _check_sets(path, path.read_bytes())
    pyuff = library("pyuff", path, _NAME)
    with reading(path, _NAME):
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        if 0 in kinds:
            raise damaged(path, _NAME, "a data set has no number")
        sets = [file.read_sets(number) for number, kind in enumerate(kinds) if kind == 58]
    histories = [entry for entry in sets if entry["func_type"] == _TIME_HISTORY and entry["ord_data_type"] in _REAL]
    if not histories:
        raise damaged(path, _NAME, "no real time history, data set 58 of function type 1")
    columns: list[Column] = []
    for entry, title in zip(histories, distinct(_title(entry) for entry in histories), strict=True):
        columns += _columns(path, entry, title)
    return MeasuredTable(path, tuple(columns))


def _check_sets(path: Path, content: bytes) -> None:
    """Refuse data sets that are not closed where they must be: the library would take what it finds between marks, and
    the binary samples of a set from a wrong byte on."""
    position = 0
    while content[position:].strip():
        opening = _MARK_LINE.match(content, position)
        if opening is None:
            raise damaged(path, _NAME, f"a data set must begin at byte {position}")
        position = opening.end()
        if content[position : position + 7].lower() == b"    58b":
            position = _binary_end(path, content, position)
        closing = _MARK_LINE.search(content, position)
        if closing is None or (content[opening.end() :][:7].lower() == b"    58b" and closing.start() > position):
            raise damaged(path, _NAME, f"the data set at byte {opening.start()} is not closed")
        position = closing.end()


def _binary_end(path: Path, content: bytes, begin: int) -> int:
    """Where the samples of the binary set end whose second line begins there."""
    order, numbers, size = (content[begin + a : begin + b].strip() for a, b in ((7, 13), (13, 19), (31, 43)))
    if order not in (b"1", b"2") or numbers != b"2" or not size.isdigit():
        raise damaged(path, _NAME, f"the data set at byte {begin} must state its byte order, IEEE numbers and bytes")
    for _ in range(_HEADER_LINES):
        begin = content.find(b"\n", begin) + 1 or len(content)
    end = begin + int(size)
    return end + len(_LINE_END.match(content, end)[0])  # type: ignore[index]


def _columns(path: Path, entry: dict[str, Any], title: str) -> list[Column]:
    values = np.asarray(entry["data"])
    if len(values) != entry["num_pts"]:
        raise damaged(path, _NAME, f"{title} must have {entry['num_pts']} samples, got {len(values)}")
    unit = _label(entry.get("ordinate_axis_units_lab"))
    unit_of_time = _label(entry.get("abscissa_axis_units_lab")) or "s"
    if entry["abscissa_spacing"] == _UNEVEN:
        time = column_of(path, f"time of {title}", np.asarray(entry["x"]), unit=unit_of_time, group=title)
        return [time, column_of(path, title, values, unit=unit, group=title)]
    if unit_of_time.lower() not in TIME_UNITS:
        # over an angle or a frequency: the rate is asked for, if this is the record
        return [column_of(path, title, values, unit=unit)]
    step = float(entry["abscissa_inc"]) * TIME_UNITS[unit_of_time.lower()]
    if not step > 0.0:
        raise damaged(path, _NAME, f"the step of {title} must be > 0 s, got {step:g}")
    return [column_of(path, title, values, unit=unit, rate=1.0 / step)]


def _title(entry: dict[str, Any]) -> str:
    return _label(entry["id1"]) or "history"


def _label(text: object) -> str | None:
    label = str(text or "").strip()
    return None if label.upper() in _NO_LABEL else label


def _begins(head: bytes) -> bool:
    # Four blanks before the mark tell it from a list of numbers that begins with -1.
    first = head[:_LINE].splitlines()[0]
    return first.rstrip() == _MARK


FORMAT = Format(_NAME, (".uff", ".unv", ".uf", ".bunv"), _begins, read)
