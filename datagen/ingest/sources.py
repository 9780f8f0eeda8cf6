"""Which files, and what each is an example of: from a labels table, or from the folders that they lie in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from datagen.campaign import SUBSETS
from indexer_env.build import field_of, from_mapping
from indexer_env.checks import check_choice
from indexer_env.errors import ParameterError, SignalError, refuse
from indexer_env.faults import Faults
from indexer_records.conditions import RecordConditions
from indexer_records.file_table import FILE, files_found, table_rows
from indexer_records.measured import Reading

CLASS, SUBSET = "class", "subset"
CHANNELS = "|"
"""What stands between the channels of a record in a cell of the labels table."""

_READING = {known.name for known in fields(Reading)}
"""Columns of a labels table that say how to read a file."""

_CONDITIONS = {known.name for known in fields(RecordConditions)} - {"machine"} | {"motor_speed_rpm"}
"""Columns of a labels table that are conditions."""

COLUMNS = (FILE, CLASS, SUBSET, *sorted(_CONDITIONS), *sorted(_READING))
"""Columns of a labels table that are no groups."""

_FAULT = "faults."
"""How columns of a labels table begin that say how bad a fault is; any further one is a group."""


@dataclass(frozen=True)
class Source:
    """A measured file before it is opened.

    Attributes
    ----------
    path : Path
    name : str
        Path below the folder that all files lie in, with "/".
    class_name : str
        The class in words.
    subset : str or None
        As the labels table says; None: left to the split.
    groups : mapping
        Text by name, e.g. {"machine": "B"}.
    read : mapping
        What the labels table says about reading the file, as `measured.Reading` takes it.
    known : mapping
        Conditions that the labels table says, as `RecordConditions` takes them.
    faults : mapping
        Severities that the labels table says, by their column of `datagen.schema`.
    """

    path: Path
    name: str
    class_name: str
    subset: str | None = None
    groups: Mapping[str, str] = field(default_factory=dict)
    read: Mapping[str, Any] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    faults: Mapping[str, float] = field(default_factory=dict)

    def reading(self, common: Reading) -> Reading:
        """How to read the file: as its row says, else as all files."""
        return replace(common, **self.read) if self.read else common


def sources_of(files: str, labels: Path | None) -> list[Source]:
    """The files that a folder or a pattern names, sorted by name, each with its class.

    Raises
    ------
    ParameterError
        No file; a label for a file that is not there, or a file without a label.
    SignalError
        The labels table cannot be read as one.
    """
    root, paths = files_found("ingest", "measured", files)
    table = None if labels is None else labels.resolve()
    named = {path.relative_to(root).as_posix(): path for path in paths if path.resolve() != table}
    if labels is None:
        _check_folders(named)
        return [Source(path, name, path.absolute().parent.name or "/") for name, path in named.items()]
    rows = _rows(labels, named)
    missing = sorted(set(named) - set(rows))
    if missing:
        others = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        remedy = "add a row for it or narrow measured=PATTERN"
        raise refuse("ingest", "labels", "a table with a row for each file", f"none for {missing[0]}{others}", remedy)
    return [_labelled(path, name, rows[name], labels) for name, path in named.items()]


def _check_folders(named: Mapping[str, Path]) -> None:
    """Refuse a file beside the folders of the classes: its folder would be a class of its own."""
    beside = [name for name in named if "/" not in name]
    if 0 < len(beside) < len(named):
        remedy = "move it into one of them, narrow measured=PATTERN or give labels=TABLE.csv"
        raise refuse("ingest", "measured", "files in folders named by their class", f"{beside[0]} beside them", remedy)


def _rows(labels: Path, named: Mapping[str, Path]) -> dict[str, dict[str, str]]:
    """Rows of the labels table by the name of their file."""
    rows: dict[str, dict[str, str]] = {}
    for line, row in table_rows(labels, "labels table", (FILE, CLASS)):
        name = _match(row[FILE], named, f"{labels}, line {line}")
        if name in rows:
            raise SignalError(f"{labels}, line {line}: a file must have one row, got a second for {name}; keep one.")
        if not row[CLASS]:
            raise SignalError(f"{labels}, line {line}: the class of {name} must be given, got none; fill the cell.")
        rows[name] = row
    return rows


def _match(written: str, named: Mapping[str, Path], place: str) -> str:
    """The file that a cell means: its name below the folder, or the end of exactly one such name."""
    wanted = written.replace("\\", "/").removeprefix("./")
    found = [wanted] if wanted in named else [name for name in named if wanted and name.endswith(f"/{wanted}")]
    if len(found) != 1:
        many = f"{len(found)} files of that name" if found else "none of that name"
        remedy = "write its path below the folder" if found else "correct the cell or measured=PATTERN"
        raise SignalError(f"{place}: {FILE} must name one of {len(named)} files, got {written!r}, {many}; {remedy}.")
    return found[0]


def _labelled(path: Path, name: str, row: Mapping[str, str], labels: Path) -> Source:
    subset = row.get(SUBSET) or None
    if subset is not None:
        check_choice(f"{labels}, {name}", SUBSET, subset, SUBSETS)
    known = {key: _number(cell, key, name, labels) for key, cell in row.items() if key in _CONDITIONS and cell}
    read: dict[str, Any] = {key: cell for key, cell in row.items() if key in _READING and cell}
    read |= {key: _number(read[key], key, name, labels) for key in ("sample_rate", "scale") if key in read}
    if CHANNELS in read.get("signal_column", ""):
        read["signal_column"] = tuple(part.strip() for part in read["signal_column"].split(CHANNELS))
    try:
        # A scale may stand here and its unit be that of all files.
        from_mapping(Reading, {"unit": "g" if "scale" in read else None, **read}, "read")
        from_mapping(RecordConditions, known, "known")
        faults = _faults(row, name, labels)
    except ParameterError as error:
        raise SignalError(f"{labels}, {name}: {error}") from None
    groups = {key: cell for key, cell in row.items() if key not in COLUMNS and not key.startswith(_FAULT)}
    return Source(path, name, row[CLASS], subset, groups, read, known, faults)


def _faults(row: Mapping[str, str], name: str, labels: Path) -> dict[str, float]:
    """The severities of a row, in SI units, where its cells state them; raises ParameterError."""
    severities = [severity.name for severity in fields(Faults)]
    stated, values = set(), {}
    for key in (key for key in row if key.startswith(_FAULT)):
        own = key.removeprefix(_FAULT)
        field_name, _ = field_of("faults", own, severities)
        if cell := row[key]:
            stated.add(field_name)
            values[own] = int(cell) if cell.isdecimal() else _number(cell, key, name, labels)
    faults = from_mapping(Faults, values, "faults")
    return {f"fault_{field_name}": getattr(faults, field_name) for field_name in sorted(stated)}


def _number(cell: str, key: str, name: str, labels: Path) -> float:
    try:
        return float(cell)
    except ValueError:
        raise SignalError(f"{labels}, {name}: {key} must be a number, got {cell!r}; correct the cell.") from None
