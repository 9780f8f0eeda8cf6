"""From what a YAML file says to a motion law."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

from indexer_env.checks import check_choice
from indexer_env.errors import refuse
from indexer_env.motion_law.base import MotionLaw
from indexer_env.motion_law.cycloidal import Cycloidal
from indexer_env.motion_law.modified_sine import ModifiedSine
from indexer_env.motion_law.modified_trapezoid import ModifiedTrapezoid
from indexer_env.motion_law.polynomial_345 import Polynomial345
from indexer_env.motion_law.table import TableLaw, numbers

MOTION_LAWS: dict[str, type[MotionLaw]] = {
    law.name: law for law in (ModifiedSine, ModifiedTrapezoid, Cycloidal, Polynomial345, TableLaw)
}
COLUMNS = ("cam_angle_deg", "follower_angle_deg")


def motion_law(name_or_mapping: str | Mapping[str, object]) -> MotionLaw:
    """The motion law of that name, or described by a mapping.

    "modified_sine", "modified_trapezoid", "cycloidal", "polynomial_345", or the same as {"name": ...};
    {"name": "table", "cam_angle_deg": [...], "follower_angle_deg": [...]}, in degrees over one cam turn;
    {"name": "table", "file": "path.csv"}, a CSV file whose header names these two columns.
    Raises `ParameterError` for an unknown name or key, a file that cannot be read, and what `TableLaw`
    refuses.
    """
    if not isinstance(name_or_mapping, Mapping):
        name_or_mapping = {"name": name_or_mapping}
    given = dict(name_or_mapping)
    check_choice("motion_law", "name", given.pop("name", None), MOTION_LAWS)
    law = MOTION_LAWS[str(name_or_mapping["name"])]
    for key in given:
        check_choice("motion_law", "key", key, (*COLUMNS, "file") if law is TableLaw else ("name",))
    if law is not TableLaw:
        return law()
    if set(given) == {"file"}:
        columns = _read_columns(given["file"])
    elif set(given) == set(COLUMNS):
        columns = given
    else:
        rule = "given as cam_angle_deg and follower_angle_deg, or as file alone"
        raise refuse("motion_law", "table", rule, sorted(given))
    degrees = (numbers("motion_law", column, columns[column], "deg") for column in COLUMNS)
    return TableLaw(*(tuple(math.radians(value) for value in row) for row in degrees))


def _read_columns(file: object) -> dict[str, object]:
    """The two columns of a CSV file, found by name; other columns are left alone."""
    if not isinstance(file, (str, Path)):
        raise refuse("motion_law", "file", "a path to a CSV file", file)
    try:
        lines = Path(file).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        remedy = getattr(error, "strerror", None) or "save it as UTF-8 text"
        raise refuse("motion_law", "file", "a CSV file that can be read", str(file), remedy) from error
    rows = csv.reader(lines, strict=True)
    columns: dict[str, list[float]] = {column: [] for column in COLUMNS}
    try:
        header = [cell.strip() for cell in next(rows, [])]
        for column in COLUMNS:
            if header.count(column) != 1:
                rule = f"a CSV file with one column {column} in its first line, cells apart by commas"
                raise refuse("motion_law", "file", rule, header, f"correct the header of {file}")
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            for column in COLUMNS:
                columns[column].append(_cell(row, header.index(column), f"{file}, line {rows.line_num}", column))
    except csv.Error as error:
        raise refuse("motion_law", "file", "well-formed CSV", str(file), str(error)) from error
    return dict(columns)


def _cell(row: list[str], place: int, where: str, column: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise refuse("motion_law", column, f"a finite number in deg ({where})", text, "fill the gap or drop the line")
    return value
