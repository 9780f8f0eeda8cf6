"""What was known when each record was taken: from a table beside the files, or the same for all of them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any

from indexer_env.build import from_mapping
from indexer_env.checks import check_number
from indexer_env.errors import ParameterError, SignalError, refuse
from indexer_env.units import ENDINGS
from indexer_records.conditions import RecordConditions
from indexer_records.file_table import FILE, table_rows
from indexer_records.measured import Reading

TABLES = ("records.csv", "records.yaml")
"""Names under which the table is looked for beside the files."""

_TEXTS = ("machine", "unit", "time_column", "signal_column")
FLAGS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
"""Cells that say yes or no."""

_ONE = 0.01
"""Difference up to which speeds or loads count as one, over the largest: pulses never give the same twice."""


@dataclass(frozen=True)
class Conditions(RecordConditions):
    """What was known when a record was taken, and what its file leaves open.

    Attributes
    ----------
    motor_speed, load_torque, sensor_radius, machine
        As in `RecordConditions`. Speed, the mean over the record, and load are needed here.
    start_angle : float or None
        Cam angle at the first sample [rad], counted from an index out of station 0; None: by the pulse, else by
        comparison with the nominal machine.
    start_uncertainty : float
        Standard deviation of the cam angle that is stated, or of the pulse's [rad], > 0.
    speed_uncertainty : float or None
        Relative standard deviation of the mean speed [-], > 0; None: as far as the record itself gives it.
    inertia_uncertainty : float
        Relative standard deviation by which the table's inertia is another one in this record, with other workpieces on
        it [-], 0 to 0.3; changes of up to a third are found.
    pulse_angle : float or None
        Cam angle at which the once-per-turn pulse stands [rad]; None: 0 where the pulse gives the start angle.
    noise : float or None
        Standard deviation of the measuring noise [the file's own numbers], > 0; None: estimated from the record.
    held_out : bool
        Whether the record is kept from the fit, to judge it.
    sample_rate, unit, scale, time_column, signal_column
        As in `indexer_records.measured.Reading`.
    """

    motor_speed: float = field()
    load_torque: float = field()
    _: KW_ONLY
    start_angle: float | None = None
    start_uncertainty: float = 0.002
    speed_uncertainty: float | None = None
    inertia_uncertainty: float = 0.0
    pulse_angle: float | None = None
    noise: float | None = None
    held_out: bool = False
    sample_rate: float | None = None
    unit: str | None = None
    scale: float | None = None
    time_column: str | None = None
    signal_column: str | None = None

    def __post_init__(self) -> None:
        check_number("Conditions", "motor_speed", self.motor_speed, low=0.0, low_open=True, unit="rad/s")
        check_number("Conditions", "load_torque", self.load_torque, unit="N m")
        for name, unit in (("start_angle", "rad"), ("pulse_angle", "rad")):
            if getattr(self, name) is not None:
                check_number("Conditions", name, getattr(self, name), unit=unit)
        for name, unit in (("noise", "of the record"), ("start_uncertainty", "rad")):
            if getattr(self, name) is not None:
                check_number("Conditions", name, getattr(self, name), low=0.0, low_open=True, unit=unit)
        if self.speed_uncertainty is not None:
            check_number("Conditions", "speed_uncertainty", self.speed_uncertainty, low=0.0, low_open=True, high=0.1)
        check_number("Conditions", "inertia_uncertainty", self.inertia_uncertainty, low=0.0, high=0.3)
        if not isinstance(self.held_out, bool):
            raise refuse("Conditions", "held_out", "true or false", self.held_out)
        try:
            super().__post_init__()
            self.reading  # noqa: B018  (checks the rest)
        except ParameterError as error:
            said = re.sub(r"^(read|known)\.", "Conditions.", str(error)).replace("read.", "known.")
            raise ParameterError(said) from None

    @property
    def reading(self) -> Reading:
        """What the file leaves open."""
        return Reading(**{field.name: getattr(self, field.name) for field in dataclasses.fields(Reading)})


def conditions_of(names: Sequence[str], table: Path | None, known: Mapping[str, Any]) -> dict[str, Conditions]:
    """Conditions of each file, named as below the folder of them all.

    Parameters
    ----------
    names : sequence of str
    table : Path or None
        CSV with a column `file` and any of the fields of `Conditions` (`motor_speed_rpm`, `start_angle_deg` as well),
        or YAML with a mapping of them for each file, by its name or in a list with the key `file`; rows for other files
        are passed over.
    known : mapping
        Values for all files, by the same names; a cell of the table goes first.

    Raises
    ------
    SignalError, ParameterError
        A file without a row or with two, an unknown name, a value that breaks its rule, files of different machines.
    """
    rows = {} if table is None else _rows(table)
    found, taken = {}, {}
    for name in names:
        row = {} if table is None else _row_of(name, rows, table, taken)
        place = f"{table}, {name}" if table else name
        si = {_si(key) for key in row}
        common = {key: value for key, value in known.items() if value is not None and _si(key) not in si}
        try:
            found[name] = from_mapping(Conditions, {**common, **row}, place)
        except ParameterError as error:
            said = _owned(str(error), place, common)
            raise SignalError(said if table is None else _of_table(said, place, table)) from None
    machines = sorted({told.machine for told in found.values() if told.machine is not None})
    if len(machines) > 1:
        got = ", ".join(machines)
        raise SignalError(f"{table}: machine must be the same in all rows, got {got}; explain each machine by itself.")
    return found


def _owned(sentence: str, place: str, common: Mapping[str, Any]) -> str:
    """The sentence about a row, with what all files have in common named as the command is given it."""
    for key in common:
        for name in (key, _si(key)):
            sentence = re.sub(rf"(?<!\w){re.escape(f'{place}.{name}')}(?!\w)", f"known.{key}", sentence)
    absent = f"{place} lacks "
    if sentence.startswith(absent):
        remedy = "give each for all files by known.NAME=VALUE (known.motor_speed_rpm) or in the table of records"
        return f"{sentence.partition(';')[0]}; {remedy}."
    return sentence


def _of_table(sentence: str, place: str, table: Path) -> str:
    """The sentence about a row; of an unknown name it says where it stands, and that in the shop's unit first."""
    found = re.fullmatch(rf"{re.escape(place)} has no parameter (.+?); (.*)", sentence)
    if found is None:
        return sentence
    where = f"{place}: key" if table.suffix.lower() in (".yaml", ".yml") else f"{table}: column"
    hint = found[2].replace("its parameters are", "known are")
    if meant := re.fullmatch(r"did you mean '(\w+)'\.", hint):
        units = ((ending, unit.si) for ending, unit in ENDINGS.items() if unit.measures(meant[1]))
        for ending, si in units:
            hint = f"did you mean '{meant[1]}{ending}', or '{meant[1]}' in {si}."
    return f"{where} {found[1]} is not known; {hint}"


def table_beside(files: Sequence[Path], root: Path) -> Path | None:
    """The table that stands beside the files, or the nearest one above them, up to the folder of them all, `root`.

    Raises
    ------
    ParameterError
        Files have different ones, or a folder has two.
    """
    nearest = {_nearest(folder, root): None for folder in dict.fromkeys(path.parent for path in files)}
    found = [table for table in nearest if table is not None]
    if len(found) > 1:
        rule = "one table for all files, or a choice by records=TABLE"
        raise refuse("discrepancy", "records", rule, " and ".join(map(str, found)), "put their rows into one")
    return found[0] if found else None


def _nearest(folder: Path, root: Path) -> Path | None:
    places = [folder, *folder.parents]
    for place in places[: places.index(root) + 1] if root in places else [folder, root]:
        tables = [place / name for name in TABLES if (place / name).is_file()]
        if len(tables) > 1:
            rule = "one table in a folder, or a choice by records=TABLE"
            raise refuse("discrepancy", "records", rule, " and ".join(map(str, tables)), "keep one of them")
        if tables:
            return tables[0]
    return None


def _si(key: str) -> str:
    return key.removesuffix("_rpm").removesuffix("_deg")


def _rows(table: Path) -> dict[str, Mapping[str, Any]]:
    if table.suffix.lower() in (".yaml", ".yml"):
        return _yaml_rows(table)
    rows: dict[str, Mapping[str, Any]] = {}
    for line, row in table_rows(table, "table of records", (FILE,)):
        name = written(row.pop(FILE))
        if name in rows:
            raise SignalError(f"{table}, line {line}: a file must have one row, got a second for {name}; keep one.")
        rows[name] = {key: _value(key, cell, f"{table}, line {line}") for key, cell in row.items() if cell}
    return rows


def _yaml_rows(table: Path) -> dict[str, Mapping[str, Any]]:
    import yaml

    try:
        content = yaml.safe_load(table.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        why = str(error).replace("\n", " ")
        raise SignalError(f"the table of records {table} cannot be read ({why}); repair it.") from None
    listed: list[tuple[Any, Any]] = []
    if isinstance(content, list) and all(isinstance(row, dict) and FILE in row for row in content):
        listed = [(row[FILE], {key: value for key, value in row.items() if key != FILE}) for row in content]
    elif isinstance(content, dict):
        listed = list(content.items())
    rows: dict[str, Mapping[str, Any]] = {}
    for file, row in listed:
        texts = isinstance(row, dict) and all(isinstance(text, str) for text in (file, *row))
        if not texts:
            raise SignalError(
                f"{table} must hold, for each file, a mapping of its conditions by name, got {row!r} for {file!r}; put "
                "names that YAML takes for something else in quotes."
            )
        name = written(file)
        if name in rows:
            raise SignalError(f"{table}: a file must have one row, got a second for {name}; keep one.")
        given = {key: value for key, value in row.items() if value is not None}  # as an empty cell
        rows[name] = {key: _number(value) if key not in _TEXTS else value for key, value in given.items()}
    if not rows:
        raise SignalError(f"{table} must hold, for each file, a mapping of its conditions; see docs/how-to/explain.md.")
    return rows


def _number(value: Any) -> Any:
    """1.5e3 as a number: YAML takes one without a sign in its exponent for a text."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


def written(file: str) -> str:
    """A file's name as a table writes it, without what says nothing."""
    return file.replace("\\", "/").removeprefix("./")


def _row_of(name: str, rows: Mapping[str, Mapping[str, Any]], table: Path, taken: dict[str, str]) -> Mapping[str, Any]:
    """The row of a file; `taken` has the files whose rows are named by the end of their path, by that."""
    if name in rows:
        return rows[name]
    meant = [written for written in rows if name.endswith(f"/{written}")]
    if len(meant) != 1:
        got = "two or more" if meant else "none"
        remedy = f"name it in the column {FILE!r} once, or move what is no record out of the folder"
        raise SignalError(f"{table} must have one row for {name}, got {got}; {remedy}.")
    first = taken.setdefault(meant[0], name)
    if first != name:
        raise SignalError(
            f"{table} must have a row for each file, got {meant[0]} for {first} and {name}; name them by their folders."
        )
    return rows[meant[0]]


def _value(key: str, cell: str, place: str) -> Any:
    """A cell as the type its field has; what is no field is left to the conditions to refuse."""
    if key in _TEXTS:
        return cell
    if key == "held_out":
        if cell.lower() not in FLAGS:
            raise SignalError(f"{place}: held_out must be yes or no, got {cell!r}; correct the cell.")
        return FLAGS[cell.lower()]
    try:
        return float(cell)
    except ValueError:
        if _si(key) not in {field.name for field in dataclasses.fields(Conditions)}:
            return cell
        raise SignalError(f"{place}: {key} must be a number, got {cell!r}; correct the cell.") from None


def grouped(values: Sequence[float]) -> tuple[list[int], list[float]]:
    """Speeds or loads that count as one: the number of each value's group, no value further than `_ONE` from the least
    of its group, and the groups' means, the least first."""
    order = sorted(values)
    near = _ONE * max(map(abs, order))
    groups = [[order[0]]]
    for value in order[1:]:
        if value - groups[-1][0] > near:
            groups.append([])
        groups[-1].append(value)
    number = {value: k for k, group in enumerate(groups) for value in group}
    return [number[value] for value in values], [sum(group) / len(group) for group in groups]
