"""Measured files -> the channels of each record by their roles, all on one time grid, in SI units."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from discrepancy.drives.channel_checks import check_markers, check_motion, check_units, usual_unit
from discrepancy.drives.description import LOAD, Channel, Drive
from discrepancy.drives.units import in_si
from discrepancy.records.conditions import FLAGS, TABLES, table_beside, written
from discrepancy.records.reading import check_new, measured_paths
from indexer_cli.words import joined
from indexer_env.checks import check_number, did_you_mean
from indexer_env.errors import SignalError, refuse
from indexer_records.file_table import FILE, table_rows
from indexer_records.formats import read_table
from indexer_records.formats.table import Column, MeasuredTable, split_title
from indexer_records.measured import check_together
from indexer_records.time_grid import TIME_UNITS, even_rate

LEAST_SAMPLES = 200
"""Samples below which a record says nothing of twenty effects."""

_KEYS = ("held_out", "motion", "noise", "sample_rate")
"""Columns of the table beside the files, besides those that name channels."""


@dataclass(frozen=True, eq=False)
class Record:
    """One file.

    Attributes
    ----------
    name : str
    rate : float
        [Hz]
    rows : mapping of str to ndarray (n,)
        By role, without `time`.
    units : mapping of str to str
    held_out : bool
    motion : str
        Which motion it is of; "" where nothing says it.
    noise : float or None
        Standard deviation of what is predicted, in its unit in `units`.
    offsets : mapping of str to float
        What was taken off a measured speed or acceleration as its sensor's offset, by role.
    """

    name: str
    rate: float
    rows: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    held_out: bool = False
    motion: str = ""
    noise: float | None = None
    offsets: Mapping[str, float] = field(default_factory=dict)


def read_drive_records(
    drive: Drive, measured: str | Sequence[str], table: Path | None, known: Mapping[str, Any], held_out: Sequence[str]
) -> list[Record]:
    """All records, those to hold out marked: named in `held_out` (a file or a motion) or in the table.

    Raises
    ------
    SignalError, ParameterError
    """
    paths, root = measured_paths(measured)
    table = table or table_beside(paths, root)
    if table is not None and table.suffix.lower() in (".yaml", ".yml"):
        raise refuse("discrepancy", "records", "a CSV table for a drive", str(table), "write it as records.csv")
    paths = [path for path in paths if path.name not in TABLES and (table is None or path.resolve() != table.resolve())]
    if not paths:
        raise refuse("discrepancy", "measured", "one measured file or more", str(measured), "only the table is there")
    rows = {} if table is None else _rows(table, drive, root, {path.resolve() for path in paths})
    records: list[Record] = []
    seen: dict[bytes, str] = {}
    for path in paths:
        name = path.relative_to(root).as_posix()
        told = {**{k: v for k, v in known.items() if v is not None}, **rows.get(path.resolve(), {})}
        record = _record(drive, path, name, told)
        check_new(path, name, b"".join(row.tobytes() for row in record.rows.values()), seen)
        records.append(record)
    return _kept(records, held_out)


def _rows(table: Path, drive: Drive, root: Path, measured: Collection[Path]) -> dict[Path, dict[str, Any]]:
    """Cells by file, which a row names as below the table's folder or as below `root`: of `_KEYS`, and columns of
    channels by their roles."""
    found: dict[Path, dict[str, Any]] = {}
    for line, row in table_rows(table, "table of records", (FILE,)):
        name = written(row.pop(FILE))
        places = [(folder / name).resolve() for folder in (table.parent, root)]
        there = [place for place in places if place.is_file()]
        if not there:
            raise SignalError(
                f"{table}, line {line}: file must be one of those beside it, got {name!r}; correct the cell."
            )
        path = next((place for place in there if place in measured), there[0])
        if path in found:
            raise SignalError(f"{table}, line {line}: a file must have one row, got a second for {name}; keep one.")
        cells = found[path] = {}
        for key, cell in row.items():
            if key not in _KEYS and key not in drive.channels:
                hint = (
                    did_you_mean(key, (*_KEYS, *drive.channels)) or f"known are {', '.join((*_KEYS, *drive.channels))}"
                )
                raise SignalError(f"{table} must have columns that say something of a record, got {key!r}; {hint}.")
            if not cell:
                continue
            if key == "held_out" and cell.lower() not in FLAGS:
                raise SignalError(f"{table}, line {line}: held_out must be yes or no, got {cell!r}; correct the cell.")
            cells[key] = FLAGS[cell.lower()] if key == "held_out" else cell
            if key in ("noise", "sample_rate"):
                try:
                    cells[key] = float(cell)
                except ValueError:
                    raise SignalError(f"{table}, line {line}: {key} must be a number, got {cell!r}.") from None
    return found


def _record(drive: Drive, path: Path, name: str, told: Mapping[str, Any]) -> Record:
    table = read_table(path)
    channels = {
        role: Channel(told[role], c.factor, c.unit) if role in told else c for role, c in drive.channels.items()
    }
    columns = {role: _column(table, channel.column, role) for role, channel in channels.items()}
    time = _time(path, columns.pop("time"), channels["time"]) if "time" in columns else None
    rows, units, factors = {}, {}, {}
    for role, column in columns.items():
        rows[role], units[role], factors[role] = _values(drive, table, column, channels[role], role)
    check_units(drive, path, units)
    lengths = {len(row) for row in rows.values()}
    if len(lengths) > 1:
        raise SignalError(f"{path}: all channels must be sampled together, got {sorted(lengths)} samples.")
    first = next(iter(rows))
    for other in [columns[role] for role in rows if role != first]:
        if None not in (other.rate, columns[first].rate) and other.rate != columns[first].rate:
            got = f"{columns[first].rate:g} and {other.rate:g} Hz of {columns[first].name!r} and {other.name!r}"
            raise SignalError(f"{path}: all channels must be sampled together, got {got}; record both at one rate.")
        check_together(table, columns[first], other, time)
    rate = _rate(table, time, columns[first], rows[first], told.get("sample_rate"))
    size = lengths.pop()
    if size < LEAST_SAMPLES:
        raise SignalError(f"{path} must have at least {LEAST_SAMPLES} samples, got {size}; record longer.")
    check_markers(path, rows, units)
    offsets = check_motion(drive, path, rows, units, rate)
    rows |= {role: rows[role] - offset for role, offset in offsets.items()}
    noise = told.get("noise")
    if noise is not None:
        check_number("known", "noise", noise, low=0.0, low_open=True, unit="in the numbers of the file")
        noise = float(noise) * _worth(drive, units, factors, noise)
    return Record(name, rate, rows, units, bool(told.get("held_out")), str(told.get("motion", "")), noise, offsets)


def _worth(drive: Drive, units: Mapping[str, str], factors: Mapping[str, float], noise: float) -> float:
    """What one of the file's numbers is worth in the channels that are predicted."""
    predicted = [r for r in units if r in drive.states or r == "a"] if drive.forward else ["force"]
    worth = {(units[role], abs(factors[role])) for role in predicted}
    if len(worth) > 1:
        rule = f"left out where {joined(predicted)} are not measured in one unit"
        raise refuse("known", "noise", rule, noise, f"state noise by role in {drive.path.name}")
    return worth.pop()[1]


def _column(table: MeasuredTable, name: str, role: str) -> Column:
    exact = [c for c in table.columns if c.name == name]
    found = exact or [c for c in table.columns if c.name.rpartition("/")[2] == name]
    if not found:
        _check_titles(table, name)
    if len(found) != 1:
        names = [c.name for c in table.columns]
        hint = did_you_mean(name, names) or f"it has {', '.join(map(repr, names))}"
        raise SignalError(f"{table.path} must have one numeric column {name!r} for {role!r}, got {len(found)}; {hint}.")
    return found[0]


def _check_titles(table: MeasuredTable, name: str) -> None:
    """Refuse titles that another separator parts than the numbers below them, so that no column has its name."""
    if table.has_header or table.row_word != "line":
        return
    with table.path.open(encoding="utf-8", errors="replace") as lines:
        for line in itertools.islice(lines, table.first_row - 1):
            separator = next((one for one in ",;\t" if name in _names(line, one)), None)
            if separator is not None:
                got = f"{separator!r} between the titles and another one between the numbers"
                raise SignalError(f"{table.path} must have one separator, got {got}; correct the line of titles.")


def _names(line: str, separator: str) -> list[str]:
    return [split_title(cell.strip().strip('"'))[0] for cell in line.lstrip("\ufeff# ").split(separator)]


def _time(path: Path, column: Column, channel: Channel) -> Column:
    """The column of time with the factor and the unit that the drive's file gives it."""
    if channel.unit is not None and channel.unit.lower() not in TIME_UNITS:
        raise refuse(str(path), "time", "in s, ms, us or min", channel.unit, "correct it in channels")
    factor = 1.0 if channel.factor is None else channel.factor
    decimals = None if column.decimals is None else math.floor(column.decimals - math.log10(abs(factor)))
    unit = channel.unit or column.unit
    return dataclasses.replace(column, unit=unit, decimals=decimals, numbers=lambda: factor * column.numbers())


def _values(
    drive: Drive, table: MeasuredTable, column: Column, channel: Channel, role: str
) -> tuple[np.ndarray, str, float]:
    """Samples in the unit that is used here, that unit, and what one of the file's numbers is worth in it."""
    stated = channel.unit or column.unit
    if stated is None:
        given = 1.0 if channel.factor is None else channel.factor
        row = (channel.column, given, usual_unit(drive, role))
        remedy = f"write channels = {{{role!r}: {row}}} with the unit that it has"
        raise SignalError(f"{table.path}: the channel {column.name!r} ({role}) must have a unit; {remedy}.")
    factor, unit = in_si(stated, acceleration=role == "a")
    factor *= 1.0 if channel.factor is None else channel.factor
    values = column.numbers() * factor
    if not np.ptp(values) and role in ("q", "v", "force", LOAD[0]):
        raise SignalError(
            f"{table.path}: the channel {column.name!r} ({role}) must vary, got {values[0]:g} throughout."
        )
    return values, unit, factor


def _rate(table: MeasuredTable, time: Column | None, column: Column, values: np.ndarray, given: float | None) -> float:
    if time is not None:
        return even_rate(table, time, column, values)
    rate = column.rate if column.rate is not None else given
    if rate is None:
        remedy = "map the role 'time' to a column, or give known.sample_rate=HZ"
        raise SignalError(f"{table.path} must have a sampling rate; {remedy}.")
    check_number("known", "sample_rate", rate, low=0.0, low_open=True, unit="Hz")
    return float(rate)


def _kept(records: list[Record], wanted: Sequence[str]) -> list[Record]:
    """The records, those that are named, by file or by motion, marked as held out."""
    kept = set()
    for name in wanted:
        meant = [r.name for r in records if name in (r.name, r.motion) or name.endswith(f"/{r.name}")]
        if not meant:
            names = ", ".join(dict.fromkeys(n for r in records for n in (r.name, r.motion) if n))
            raise refuse("discrepancy", "held_out", f"files or motions among {names}", name)
        kept |= set(meant)
    marked = [dataclasses.replace(r, held_out=r.held_out or r.name in kept) for r in records]
    if all(r.held_out for r in marked):
        raise refuse("discrepancy", "held_out", "fewer than all records", len(marked), "one must be left to fit")
    return marked
