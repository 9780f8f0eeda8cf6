"""What every reader gives: a measured file as named columns, its numbers checked when a column is used."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from indexer_env.errors import SignalError

RATE_NAMES = ("fs", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency")
"""Names, in lower case, under which files keep their sampling rate [Hz] beside the samples."""

TIME_UNITS = {
    "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "min": 60.0, "minute": 60.0, "minutes": 60.0,
    "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9,
}  # fmt: skip
"""Time unit as written -> seconds."""

UNIT_NAMES = ("unit", "units")
"""Names, in lower case, of attributes that hold a unit."""

MOST_COLUMNS = 1000
"""Columns of one file; more is no measurement but a damaged header."""

LARGEST_CONTENT = 2**30
"""Bytes that the samples of one file may take once unpacked; a longer measurement is cut into files."""

_TITLE = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")

_T = TypeVar("_T")


@dataclass(frozen=True)
class Column:
    """One column or channel of a measured file.

    Attributes
    ----------
    name : str
    unit : str or None
        As written; None without one.
    size : int
        Samples.
    numbers : callable
        Gives the samples, float64 of shape (size,), all finite; raises SignalError with the place of the first that is
        no finite number.
    decimals : int or None
        Digits after the decimal mark as written (the most of any cell), None where the file holds binary numbers.
    rate : float or None
        Sampling rate as the file states it [Hz].
    full_scale : bool
        The numbers are shares of an unknown full scale, not a quantity.
    group : str
        What it stands in with the columns that belong to it, by slashes from the outermost on: the group of HDF5 or
        TDMS, the structure of MAT, the data set of UFF. "" in none.
    clock : bool
        The numbers are seconds of a clock since its first value, never a record.
    start : float
        When the first sample was taken [s], after a moment that all columns of the file have in common.
    """

    name: str
    unit: str | None
    size: int
    numbers: Callable[[], np.ndarray]
    decimals: int | None = None
    rate: float | None = None
    full_scale: bool = False
    group: str = ""
    clock: bool = False
    start: float = 0.0


@dataclass(frozen=True)
class MeasuredTable:
    """A measured file: `columns` in file order and what a user calls the row of sample 0 ("line 2")."""

    path: Path
    columns: tuple[Column, ...]
    has_header: bool = True
    row_word: str = "sample"
    first_row: int = 0

    def __post_init__(self) -> None:
        if not self.columns:
            raise SignalError(f"{self.path} has no numeric column; it must hold time and acceleration as numbers.")
        if len(self.columns) > MOST_COLUMNS:
            raise too_many_columns(self.path, len(self.columns))
        if not any(column.size for column in self.columns):
            raise SignalError(f"{self.path} is empty; it must hold a time column and an acceleration column.")

    def row(self, sample: int) -> str:
        """Where a sample stands in the file, e.g. "line 12"."""
        return f"{self.row_word} {self.first_row + sample}"


def split_title(title: str) -> tuple[str, str | None]:
    """Name and unit of a column title: "acceleration [m/s^2]" or "acc (g)" -> ("acceleration", "m/s^2"),
    ("acc", "g")."""
    found = _TITLE.match(title.strip())
    if not found:
        return title.strip(), None
    return found["name"].strip(), found["unit"].strip() or None


def column_of(
    path: Path,
    title: str,
    values: np.ndarray,
    *,
    unit: str | None = None,
    rate: float | None = None,
    full_scale: bool = False,
    group: str = "",
    start: float = 0.0,
) -> Column:
    """A column of binary numbers; `unit` where the file states it apart from the title."""
    name, written = split_title(title)
    numbers = partial(finite, values, path, name, "sample", 0)
    stated = {"rate": rate, "full_scale": full_scale, "group": group, "start": start}
    return Column(name, unit or written, len(values), numbers, **stated)  # type: ignore[arg-type]


def columns_of(path: Path, title: str, values: np.ndarray, **stated: object) -> list[Column]:
    """Columns of an array of one or two dimensions; the longer one is time. Nothing for text, scalars and more
    dimensions."""
    if values.dtype.kind not in "iuf" or values.ndim not in (1, 2) or values.size < 2:
        return []
    if min(values.shape) == 1:
        values = values.reshape(-1)
    if values.ndim == 1:
        return [column_of(path, title, values, **stated)]  # type: ignore[arg-type]
    tall = values if values.shape[0] >= values.shape[1] else values.T
    check_content(path, 0, columns=tall.shape[1])
    return [
        column_of(path, f"{title} {index + 1}", np.ascontiguousarray(tall[:, index]), **stated)  # type: ignore[arg-type]
        for index in range(tall.shape[1])
    ]


def nearest(group: str, stated: Iterable[tuple[str, _T]]) -> list[_T]:
    """What is stated in a group itself, else in the nearest group above it; `stated` are pairs of group and what."""
    stated = list(stated)
    while True:
        found = [what for place, what in stated if place == group]
        if found or not group:
            return found
        group = group.rpartition("/")[0]


def nearest_rate(
    group: str, stated: Iterable[tuple[str, float]], anywhere: Iterable[tuple[str, float]] = ()
) -> float | None:
    """The rate that the file states in a group or the nearest above it, else the one that it states anywhere [Hz]; None
    where those differ."""
    found = set(nearest(group, stated) or [rate for _, rate in anywhere])
    return found.pop() if len(found) == 1 else None


def check_content(path: Path, size: int, columns: int = 0) -> None:
    """Refuse, before memory is taken for them, samples of more bytes or columns than a file may hold."""
    if size > LARGEST_CONTENT:
        raise SignalError(
            f"{path} must hold at most {LARGEST_CONTENT >> 20} MiB of samples, got {size >> 20} MiB; "
            "cut the measurement into several files."
        )
    if columns > MOST_COLUMNS:
        raise too_many_columns(path, columns)


def too_many_columns(path: Path, columns: int) -> SignalError:
    """Build (not raise) the sentence for a file of too many columns."""
    return SignalError(f"{path} must have at most {MOST_COLUMNS} columns, got {columns}; export the needed ones.")


def distinct(names: Iterable[str]) -> list[str]:
    """The names, with " (2)", " (3)" … behind those that came before."""
    seen: dict[str, int] = {}
    result = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        result.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return result


def finite(values: np.ndarray, path: Path, name: str, row_word: str, first_row: int) -> np.ndarray:
    """The values as float64, or the place of the first that is not finite."""
    with np.errstate(over="ignore"):
        numbers = np.asarray(values, dtype=np.float64)
    good = np.isfinite(numbers)
    if not good.all():
        sample = int(np.argmin(good))
        raise SignalError(
            f"{path}, {row_word} {first_row + sample}, column {name!r}: {numbers[sample]} where a finite "
            "number must be; repair the cell or cut the record before it."
        )
    return numbers
