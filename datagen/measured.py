"""Measured files (CSV, Parquet) -> `Signal`, each doubt answered by one sentence: what, where, rule, value,
remedy.

A record is one acceleration channel on an even time grid. Time may be given by a column or, without one, by
`sample_rate`. Units are read from the header ("acceleration [m/s^2]") or given; they are never guessed from
the size of the numbers.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from datagen.tables import Column, MeasuredTable, read_table
from indexer_env.errors import SignalError
from indexer_env.signal import Signal

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²], exact by definition (3rd CGPM, 1901)."""

TIME_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
"""Time unit as written -> seconds."""

ACCELERATION_UNITS = {
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", math.pi / 180.0),
    "°/s^2": ("rad/s^2", math.pi / 180.0),
    "m/s^2": ("m/s^2", 1.0),
    "mm/s^2": ("m/s^2", 1e-3),
    "g": ("m/s^2", STANDARD_GRAVITY),
    "mg": ("m/s^2", 1e-3 * STANDARD_GRAVITY),
}
"""Acceleration unit as written (normalised) -> unit of the Signal and the factor to it."""

RATE_TOLERANCE = 1e-3
"""Relative difference between a file's rate and the expected one that still counts as equal (clock of a data
logger)."""

SHORTEST_STEP = 1e-7
LONGEST_STEP = 10.0
"""Sampling steps outside this range [s] are no vibration record but a wrong unit of time."""

MOST_STRAY_STEPS = 2.0
"""Sampling steps by which a sample may lie off the even grid of its record; more is a rate that changes."""

_TIME_NAMES = ("time", "zeit", "temps", "tempo", "timestamp", "seconds", "t")
_ACCELERATION_NAMES = ("acc", "beschl", "phi_dd", "table_acceleration")


def read_signal(
    path: str | Path,
    *,
    expected_rate: float | None = None,
    expected_duration: float | None = None,
    sample_rate: float | None = None,
    unit: str | None = None,
    time_column: str | None = None,
    signal_column: str | None = None,
) -> Signal:
    """Read one acceleration record from a measured file.

    Parameters
    ----------
    expected_rate : float, optional
        Sampling rate the record must have [Hz], within `RATE_TOLERANCE`.
    expected_duration : float, optional
        Least duration [s], e.g. one table turn.
    sample_rate : float, optional
        Rate [Hz] of a file that has no time column.
    unit : str, optional
        Unit of a column whose header names none, e.g. "m/s^2", "g" or "rad/s^2".
    time_column, signal_column : str, optional
        Column names, where the header leaves a choice.

    Raises
    ------
    SignalError
        Whatever keeps the file from being such a record: see the tests for the list.
    """
    table = read_table(path)
    time, signal = _choose(table, time_column, signal_column, sample_rate)
    if time is not None and sample_rate is not None:
        raise SignalError(
            f"{table.path} must have no time column where a sampling rate is given, got {time.name!r} and "
            f"{sample_rate:g} Hz; leave sample_rate out."
        )
    values = signal.numbers()
    if time is None:
        rate = float(sample_rate or 0.0)
    else:
        rate = _rate(table, time, signal, time.numbers() * _time_scale(table, time), values)
    if expected_rate is not None and abs(rate - expected_rate) > RATE_TOLERANCE * expected_rate:
        raise SignalError(
            f"{table.path} is sampled at {rate:.6g} Hz where {expected_rate:.6g} Hz must be; "
            "record at that rate or resample the file."
        )
    if expected_duration is not None and len(values) < round(expected_duration * rate):
        raise SignalError(
            f"{table.path} lasts {len(values) / rate:.4g} s ({len(values)} samples) where at least "
            f"{expected_duration:.4g} s must be; record at least one turn of the table."
        )
    unit_out, factor = _unit(table, signal, unit)
    # A product that overflows is refused by the gate, with its place.
    with np.errstate(over="ignore"):
        scaled = values * factor
    return Signal(scaled, rate, unit=unit_out, source=str(table.path))


def _choose(
    table: MeasuredTable, time_name: str | None, signal_name: str | None, sample_rate: float | None
) -> tuple[Column | None, Column]:
    columns = list(table.columns)
    time = _named(table, time_name) if time_name else _time_of(table, sample_rate)
    others = [column for column in columns if column is not time]
    if signal_name:
        return time, _named(table, signal_name)
    likely = [column for column in others if _is_acceleration(column)] or others
    if not likely:
        raise SignalError(f"{table.path} has no acceleration column beside {columns[0].name!r}; export both columns.")
    if len(likely) > 1:
        names = ", ".join(repr(column.name) for column in likely)
        raise SignalError(
            f"{table.path} has {len(likely)} columns that may be the record ({names}); name one (signal_column=NAME)."
        )
    return time, likely[0]


def _time_of(table: MeasuredTable, sample_rate: float | None) -> Column | None:
    columns = table.columns
    found = [column for column in columns if _is_time(column)]
    if not table.has_header and len(columns) > 1:
        found = [columns[0]]
    if found:
        return found[0]
    if sample_rate is None:
        names = ", ".join(repr(column.name) for column in columns)
        raise SignalError(
            f"{table.path} has no time column among {names}; name it (time_column=NAME) or give the sampling rate "
            "(sample_rate=HZ)."
        )
    return None


def _is_time(column: Column) -> bool:
    name = column.name.lower()
    return name == "t" or name.startswith(_TIME_NAMES[:-1]) or (column.unit or "").lower() in TIME_UNITS


def _is_acceleration(column: Column) -> bool:
    named = any(part in column.name.lower() for part in _ACCELERATION_NAMES)
    return named or (column.unit is not None and _normal(column.unit) in ACCELERATION_UNITS)


def _named(table: MeasuredTable, name: str) -> Column:
    for column in table.columns:
        if column.name == name:
            return column
    names = ", ".join(repr(column.name) for column in table.columns)
    raise SignalError(f"{table.path} has no numeric column {name!r}; it has {names}.")


def _time_scale(table: MeasuredTable, time: Column) -> float:
    if time.unit is None:
        return 1.0
    if time.unit.lower() not in TIME_UNITS:
        raise SignalError(
            f"{table.path}, column {time.name!r}: the unit of time must be one of s, ms, us, "
            f"got {time.unit!r}; correct the header."
        )
    return TIME_UNITS[time.unit.lower()]


def _rate(table: MeasuredTable, time: Column, signal: Column, seconds: np.ndarray, values: np.ndarray) -> float:
    """Sampling rate of an even time grid [Hz], rounded to a whole number where the printed digits of time
    allow."""
    if len(seconds) < 2:
        raise SignalError(f"{table.path} holds one sample; record at least one turn of the table.")

    def where(sample: int) -> str:
        return f"{table.path}, {table.row(sample)}, column {time.name!r}"

    # Steps that overflow turn infinite and are named as gaps below.
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(seconds)
    if (steps <= 0.0).any():
        if (values[1:] > values[:-1]).all():
            raise SignalError(
                f"{table.path}: the columns look swapped, {time.name!r} does not ascend and {signal.name!r} "
                "does; exchange the two columns or their headers."
            )
        sample = int(np.argmax(steps <= 0.0)) + 1
        raise SignalError(
            f"{where(sample)}: time must ascend, got {seconds[sample]:.9g} s after "
            f"{seconds[sample - 1]:.9g} s; sort the rows or raise the digits of the time column."
        )
    step = float(np.median(steps))
    resolution = 0.0 if time.decimals is None else 10.0**-time.decimals * _time_scale(table, time)
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        raise SignalError(
            f"{table.path}, column {time.name!r}: the time step must lie between {SHORTEST_STEP:g} and "
            f"{LONGEST_STEP:g} s, got {step:.6g} s; correct the unit of time in the header."
        )
    slack = max(0.5 * step, resolution)
    uneven = np.abs(steps - step) > slack
    if uneven.any():
        sample = int(np.argmax(uneven)) + 1
        width = float(steps[sample - 1])
        lost = round(min(width / step, 1e9)) - 1
        problem = (
            f"a gap, {lost} {'sample is' if lost == 1 else 'samples are'} missing" if lost > 0 else "an uneven step"
        )
        raise SignalError(
            f"{where(sample)}: {problem} ({width:.6g} s after {seconds[sample - 1]:.9g} s "
            f"where {step:.6g} s must be); cut the record there or fill the gap before use."
        )
    span = float(seconds[-1] - seconds[0])
    rate = (len(seconds) - 1) / span
    strays = np.abs(seconds - seconds[0] - np.arange(len(seconds)) / rate)
    if strays.max() > MOST_STRAY_STEPS / rate + resolution:
        sample = int(np.argmax(strays))
        raise SignalError(
            f"{where(sample)}: the rate must be one throughout, got a time {strays[sample]:.3g} s off that of an even "
            f"{rate:.6g} Hz; resample the record to an even grid."
        )
    whole = float(round(rate))
    doubt = rate * max(resolution / span, 1e-9)
    return whole if whole > 0.0 and abs(whole - rate) <= doubt else rate


def _unit(table: MeasuredTable, signal: Column, given: str | None) -> tuple[str, float]:
    if signal.unit and given and _normal(signal.unit) != _normal(given):
        raise SignalError(
            f"{table.path}, column {signal.name!r}: the unit must be given once, got {signal.unit!r} in the header and "
            f"{given!r}; leave unit out or correct the header."
        )
    written = signal.unit or given
    known = "rad/s^2, deg/s^2, m/s^2, mm/s^2, g, mg"
    if written is None:
        raise SignalError(
            f"{table.path}, column {signal.name!r}: no unit; write it into the header as "
            f"{signal.name} [UNIT] or give it (unit=UNIT), one of {known}."
        )
    if _normal(written) not in ACCELERATION_UNITS:
        raise SignalError(
            f"{table.path}, column {signal.name!r}: the unit must be one of {known}, got {written!r}; "
            "correct the header."
        )
    return ACCELERATION_UNITS[_normal(written)]


def _normal(unit: str) -> str:
    text = unit.strip().lower().replace(" ", "").replace("²", "^2").replace("**2", "^2")
    return text[:-2] + "s^2" if text.endswith("/s2") else text
