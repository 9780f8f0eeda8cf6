"""Which columns of a measured file are meant: the record, and the time that belongs to it."""

from __future__ import annotations

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.acceleration_units import ACCELERATION_UNITS, normal
from indexer_records.formats.table import TIME_UNITS, Column, MeasuredTable, nearest
from indexer_records.time_grid import unit_of_time

_TIME_NAMES = ("time", "zeit", "temps", "tempo", "timestamp", "seconds", "t")
_ACCELERATION_NAMES = ("acc", "beschl", "phi_dd", "table_acceleration")


def named(table: MeasuredTable, name: str) -> Column:
    """The column of that name; behind a group its own name is enough where one column has it."""
    exact = [column for column in table.columns if column.name == name]
    found = exact or [column for column in table.columns if _own_name(column) == name]
    if len(found) == 1:
        return found[0]
    names = ", ".join(repr(column.name) for column in found or table.columns)
    rule = f"must have one numeric column {name!r}, got {len(found)}" if found else f"has no numeric column {name!r}"
    raise SignalError(f"{table.path} {rule}; it has {names}.")


def record_of(table: MeasuredTable, time: Column | None, pulse: Column | None, rate: float | None) -> Column:
    """The one column that may be the record beside its time, named or found, and the pulse; `rate` is the one given."""
    times = [time] if time is not None else _times(table, rate)
    others = [column for column in table.columns if not (column in times or column is pulse or column.clock)]
    likely = [column for column in others if _is_acceleration(column)]
    if pulse is not None and not likely and (_is_acceleration(pulse) or not others):
        raise SignalError(
            f"{table.path}: pulse.column must be another channel than the record, got {pulse.name!r}, the only one "
            "that may be the record; name the channel of the pulse, or the record (read.signal_column=NAME)."
        )
    likely = likely or others
    if not likely:
        first = table.columns[0].name
        raise SignalError(f"{table.path} has no acceleration column beside {first!r}; export both columns.")
    if len(likely) > 1:
        names = ", ".join(repr(column.name) for column in likely)
        raise SignalError(
            f"{table.path} has {len(likely)} columns that may be the record ({names}); "
            "name one (read.signal_column=NAME)."
        )
    return likely[0]


def time_of(table: MeasuredTable, column: Column, rate: float | None) -> Column | None:
    """The column of time of a channel: that of its own group, else of the nearest group above it, else any.

    None where the file states the channel's rate, or has no time. Where the rate is given, a clock is no time, nor a
    column that does not ascend or only counts samples.

    Raises
    ------
    SignalError
        Several are equally near.
    """
    if column.rate is not None:
        return None
    times = [(time.group, time) for time in _times(table, rate) if time is not column]
    found = nearest(column.group, times) or [time for _, time in times]
    if len(found) > 1:
        names = ", ".join(repr(time.name) for time in found)
        raise SignalError(
            f"{table.path} has {len(found)} columns that may be the time of {column.name!r} ({names}); "
            "name one (read.time_column=NAME)."
        )
    return found[0] if found else None


def time_beside(table: MeasuredTable, column: Column) -> Column | None:
    """The one column of time in a channel's own group, else in the nearest above it, that states a rate for it."""
    times = [(time.group, time) for time in _times(table, None) if time is not column and time.size == column.size]
    found = nearest(column.group, times)
    return found[0] if len(found) == 1 and _states_a_rate(found[0]) else None


def are_numbers(column: Column) -> bool:
    """Whether every sample of a column is a finite number."""
    try:
        column.numbers()
    except SignalError:
        return False
    return True


def _times(table: MeasuredTable, rate: float | None) -> list[Column]:
    """What may be time: other columns before those of a clock."""
    if table.has_header:
        found = [column for column in table.columns if _is_time(column)]
    else:
        found = list(table.columns[:1]) if len(table.columns) > 1 else []
    found = [column for column in found if not column.clock] or found
    return [column for column in found if rate is None or _states_a_rate(column)]


def _states_a_rate(column: Column) -> bool:
    return _ascends(column) and not column.clock and not (_counts(column) and unit_of_time(column) is None)


def _ascends(column: Column) -> bool:
    return are_numbers(column) and bool((np.diff(column.numbers()) > 0.0).all())


def _counts(column: Column) -> bool:
    return bool((np.diff(column.numbers()) == 1.0).all())


def _is_time(column: Column) -> bool:
    name, unit = _own_name(column).lower(), (column.unit or "").lower()
    if unit in TIME_UNITS:
        return True
    return (name == "t" or name.startswith(_TIME_NAMES[:-1])) and not _measures_acceleration(column)


def _own_name(column: Column) -> str:
    """A column's name without the group or structure that it stands in."""
    structure = column.group.replace("/", ".")
    return column.name.removeprefix(f"{structure}.").rpartition("/")[2]


def _is_acceleration(column: Column) -> bool:
    named = any(part in column.name.lower() for part in _ACCELERATION_NAMES)
    return named or _measures_acceleration(column)


def _measures_acceleration(column: Column) -> bool:
    return column.unit is not None and normal(column.unit) in ACCELERATION_UNITS
