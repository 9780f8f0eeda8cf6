"""CSV files as data loggers write them: delimiter, decimal mark, header and a unit in it are found out.

Nothing is interpreted here but the layout. Cells become numbers only when a column is used, so that a comment column
in text does no harm; the first cell that is no number is named by line and column.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import itertools
import re
import statistics
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from indexer_env.errors import SignalError
from indexer_records.formats.kind import Format
from indexer_records.formats.table import LARGEST_CONTENT, Column, MeasuredTable, finite, split_title

_PLAIN = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER = rf"^\s*{_PLAIN}\s*$"
_NUMBER_OR_COMMA = re.compile(_NUMBER.replace(r"\.", "[.,]"))
_POINT, _COMMA = (re.compile(rf"[+-]?\d*{mark}\d+(?:[eE][+-]?\d+)?") for mark in (r"\.", ","))
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may stand between thousands."""

_WHOLE = re.compile(r"[+-]?\d+")

_PLAIN_ROWS = {delimiter: re.compile(f"{_PLAIN}(?:{delimiter}{_PLAIN})*") for delimiter in (";", "\t", ",")}
"""By delimiter, the rows whose cells are numbers without spaces, quotes and decimal commas: those of most files."""

_MISSING = {"", "nan", "-nan", "na", "n/a", "null", "inf", "-inf", "+inf"}
_SNIFFED_LINES = 400
_LARGEST_TEXT = LARGEST_CONTENT // 4
"""Bytes of a text file: as lines and cells it takes several times as many."""


def read(path: Path) -> MeasuredTable:
    """The columns of a text file; raises SignalError for a binary one, rows of unequal length, no numeric row."""
    size = path.stat().st_size
    if size > _LARGEST_TEXT:
        raise SignalError(
            f"{path} must have at most {_LARGEST_TEXT >> 20} MiB of text, got {size >> 20} MiB; save it as Parquet or "
            "cut it into several files."
        )
    return _csv(path, _decode(path, path.read_bytes()))


def _decode(path: Path, content: bytes) -> str:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encodings = ["utf-16"]
    elif b"\0" in content:
        raise SignalError(f"{path} is a binary file of unknown kind; export it as CSV or Parquet.")
    else:
        encodings = ["utf-8-sig", "cp1252", "latin-1"]
    for encoding in encodings:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise SignalError(f"{path} is not readable text; export it as CSV in UTF-8.")


def _csv(path: Path, text: str) -> MeasuredTable:
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    filled = text.rstrip()
    # Blank lines at the end hold nothing, but a tab at the end of the last row does. Nothing looks at single lines
    # further down: the rest stays one piece of text.
    lines = (filled + text[len(filled) :].partition("\n")[0]).split("\n", 2 * _SNIFFED_LINES)
    delimiter, width, start = _layout(lines)
    if width == 0:
        raise SignalError(
            f"{path} has no numeric column; rows must be numbers separated by commas, semicolons or tabs."
        )
    header = _header(lines[:start], delimiter, width)
    body = "\n".join(lines[start:])
    table = _cells(path, body, delimiter, width, start, columns_named="the header" if header else "the first row")
    sampled = lines[start : start + _SNIFFED_LINES]
    comma = delimiter != "," and any(re.search(r"\d,\d", line) for line in sampled)
    if comma:
        _check_comma(path, [_split(line, delimiter) for line in sampled])
    if not header and width > 1 and not any(_split(line, delimiter)[-1] for line in sampled):
        # each row ends with a delimiter, and the header does not
        header, width = _header(lines[:start], delimiter, width - 1), width - 1
    names = header or [f"column {index + 1}" for index in range(width)]
    columns = []
    for index, title in enumerate(names):
        name, unit = split_title(title)
        texts = table.column(index).combine_chunks()
        if comma:
            texts = pc.replace_substring(texts, ",", ".")  # type: ignore[attr-defined]
        columns.append(Column(name, unit, len(texts), _parser(path, name, texts, start + 1), _decimals(texts)))
    return MeasuredTable(path, tuple(columns), bool(header), "line", start + 1)


def _check_comma(path: Path, rows: list[list[str]]) -> None:
    """Refuse commas that may all stand between thousands: beside points, or in a column whose other numbers are whole
    and below a thousand."""
    cells = [cell for row in rows for cell in row]
    points, commas = ([cell for cell in cells if mark.fullmatch(cell)] for mark in (_POINT, _COMMA))
    if points and commas and all(map(_THOUSANDS.fullmatch, commas)):
        raise SignalError(
            f"{path} must have one decimal mark, got {points[0]!r} and {commas[0]!r}; export it without marks "
            "between thousands."
        )
    for column in itertools.zip_longest(*rows, fillvalue=""):
        marked = [cell for cell in column if _COMMA.fullmatch(cell)]
        whole = [cell for cell in column if _WHOLE.fullmatch(cell)]
        if (
            marked
            and whole
            and all(map(_THOUSANDS.fullmatch, marked))
            and all(len(one.lstrip("+-")) < 4 for one in whole)
        ):
            raise SignalError(
                f"{path} must have all decimals in each number, or no marks between thousands, got {marked[0]!r} and "
                f"{whole[0]!r} in one column; export it without marks between thousands."
            )


def _layout(lines: list[str]) -> tuple[str, int, int]:
    """Delimiter, cells a row and index of the first row of numbers; the delimiter that makes most rows
    numeric wins."""
    best, sniffed = (0, ",", 0, 0), lines[:_SNIFFED_LINES]
    for delimiter in _PLAIN_ROWS:
        widths = [line.count(delimiter) + 1 for line in sniffed]
        numbers = {
            index: _numbers(line, delimiter, width)
            for index, (line, width) in enumerate(zip(sniffed, widths, strict=True))
            if width > 1
        }
        # At least half the cells: a broken one must not turn the first row of data into a header.
        numeric = {index: count for index, count in numbers.items() if widths[index] <= 2 * count}
        if len(numeric) > best[0]:
            start = _start(widths, numeric)
            best = (len(numeric), delimiter, widths[start], start)
    if best[0]:
        return best[1:]
    single = [index for index, line in enumerate(sniffed) if _NUMBER_OR_COMMA.match(line)]
    return (";", 1, single[0]) if single else (",", 0, 0)


def _start(widths: list[int], numeric: dict[int, int]) -> int:
    """First row of the data: the first with as many numbers as most have, or those broken ones that lead up to it; a
    preamble such as "rate;1000" stands apart, above the header. `numeric` counts the numbers of each row that has
    enough."""
    usual = statistics.mode(numeric.values())
    start = next(index for index, count in numeric.items() if count == usual)
    while start - 1 in numeric and widths[start - 1] == widths[start]:
        start -= 1
    return start


def _numbers(line: str, delimiter: str, width: int) -> int:
    """How many of the `width` cells of a line are numbers."""
    if _PLAIN_ROWS[delimiter].fullmatch(line):
        return width
    return sum(bool(_NUMBER_OR_COMMA.match(cell)) for cell in _split(line, delimiter))


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _header(before: list[str], delimiter: str, width: int) -> list[str]:
    """Titles from the line above the data; a line of units between titles and data is joined as "title
    [unit]". A line with a number in it, or apart from the next one, is of a preamble and has no titles; one after "#"
    is a comment unless it has as many cells as a row, one of them with a unit."""
    commented = _split(before[-1].lstrip("# "), delimiter) if before and before[-1].startswith("#") else []
    if len(commented) == width and any(name and unit for name, unit in map(split_title, commented)):
        return commented  # as numpy.savetxt writes it
    told = [place for place, line in enumerate(before) if line.strip() and not line.startswith("#")]
    rows = [_split(before[place], delimiter) for place in told]
    if not rows or len(rows[-1]) != width:
        return []
    titled = any(name and unit for name, unit in map(split_title, rows[-1]))
    above = rows[-2] if len(rows) > 1 and told[-1] - told[-2] == 1 else []
    named = len(above) == width > 1 and all(cell and not _NUMBER_OR_COMMA.match(cell) for cell in above)
    if not titled and named:
        units = [cell.strip("[]()") for cell in rows[-1]]
        return [f"{name} [{unit}]" if unit else name for name, unit in zip(rows[-2], units, strict=True)]
    return rows[-1]


def _cells(path: Path, body: str, delimiter: str, width: int, start: int, columns_named: str) -> pa.Table:
    bad: list[tuple[int, int]] = []

    def note(row: pyarrow.csv.InvalidRow) -> str:
        bad.append((row.number or 0, row.actual_columns))
        return "skip"

    names = [str(index) for index in range(width)]
    try:
        table = pyarrow.csv.read_csv(
            io.BytesIO(body.encode()),
            read_options=pyarrow.csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=pyarrow.csv.ParseOptions(
                delimiter=delimiter, ignore_empty_lines=False, invalid_row_handler=note
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
            ),
        )
    except pa.ArrowInvalid as error:
        raise SignalError(f"{path} cannot be read as CSV: {str(error).splitlines()[0]}.") from None
    lines = body.count("\n") + 1
    if not bad and table.num_rows != lines:
        raise SignalError(
            f"{path} must have a row in each line from {start + 1} on, got {table.num_rows} rows in {lines} lines; "
            "close the quotation mark that joins lines."
        )
    if bad:
        number, cells = bad[0]
        raise SignalError(
            f"{path}, line {start + number}: {cells} cells where {columns_named} has {width}; "
            "repair the row, and with a decimal comma export with semicolons between the columns."
        )
    return table


def _parser(path: Path, name: str, texts: pa.StringArray, first_line: int) -> Callable[[], np.ndarray]:
    def numbers() -> np.ndarray:
        # Most files hold plain finite numbers throughout: seven times as fast as to look at every cell by its pattern.
        with contextlib.suppress(pa.ArrowInvalid):
            values = pc.cast(texts, pa.float64()).to_numpy(zero_copy_only=False)
            if np.isfinite(values).all():
                return values
        valid = pc.match_substring_regex(texts, _NUMBER).to_numpy(zero_copy_only=False)  # type: ignore[attr-defined]
        if not valid.all():
            sample = int(np.argmin(valid))
            cell = texts[sample].as_py().strip()
            problem = "no value" if cell.lower() in _MISSING else "text"
            raise SignalError(
                f"{path}, line {first_line + sample}, column {name!r}: {problem} ({cell!r}) where a finite "
                "number must be; repair the cell or cut the record before it."
            )
        plain = pc.replace_substring_regex(texts, r"^\s*\+?|\s*$", "")  # type: ignore[attr-defined]
        values = pc.cast(plain, pa.float64()).to_numpy(zero_copy_only=False)
        return finite(values, path, name, "line", first_line)

    return numbers


def _decimals(texts: pa.StringArray) -> int | None:
    head = texts[:_SNIFFED_LINES].to_numpy(zero_copy_only=False)
    if any("e" in text or "E" in text for text in head):
        return None
    return max((len(text.strip().partition(".")[2]) for text in head), default=0)


FORMAT = Format("CSV", (".csv", ".txt", ".asc", ".tsv", ".dat"), lambda head: False, read, apart=False)
