"""The time column of a measured file -> one sampling rate, or the first place where the grid is not even."""

from __future__ import annotations

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.formats.table import TIME_UNITS, Column, MeasuredTable

SHORTEST_STEP = 1e-7
LONGEST_STEP = 10.0
"""Sampling steps outside this range [s] are no vibration record but a wrong unit of time."""

LONGEST_UNSTATED = 0.1
"""From this step on [s] a time without a unit is none of seconds: a table's vibration is not recorded at 10 Hz."""

MOST_STRAY_STEPS = 2.0
"""Sampling steps by which a sample may lie off the even grid of its record; more is a rate that changes."""

MOST_ROUNDED = 0.9
"""Sampling steps by which rounding may change one: where one in twenty or fewer is doubled, samples are missing."""


def check_step(place: str, step: float, remedy: str) -> None:
    """Refuse a sampling step [s] of no vibration record."""
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        raise SignalError(
            f"{place}: the time step must lie between {SHORTEST_STEP:g} and {LONGEST_STEP:g} s, got {step:.6g} s; "
            f"{remedy}."
        )


def even_rate(table: MeasuredTable, time: Column, signal: Column, values: np.ndarray) -> float:
    """Sampling rate of an even time grid [Hz], rounded to a whole number where the printed digits of time
    allow; `values` are those of the signal, which tell swapped columns apart.

    Raises
    ------
    SignalError
        Another length than the signal's, one sample, a unit of time that is none, time that stands or goes back, a gap
        or an uneven step, a rate that changes.
    """
    # What overflows turns infinite and is named below.
    with np.errstate(over="ignore"):
        seconds = time.numbers() * _time_scale(table, time)
    if len(seconds) != len(values):
        raise SignalError(
            f"{table.path}: the time column {time.name!r} must be as long as {signal.name!r}, got {len(seconds)} and "
            f"{len(values)} samples; name the time column of that channel (read.time_column=NAME)."
        )
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
    check_step(f"{table.path}, column {time.name!r}", step, "correct the unit of time in the header")
    if step >= LONGEST_UNSTATED and unit_of_time(time) is None:
        raise SignalError(
            f"{table.path}, column {time.name!r}: a time without a unit is one in seconds, whose step must be below "
            f"{LONGEST_UNSTATED:g} s, got {step:.6g}; write its unit into the header, as in "
            f"{time.name + ' [ms]'!r}, or give the sampling rate where it counts samples."
        )
    # Rounded times have unequal steps, each within the last digit of the true one, which their mean tells. One twice as
    # long is a gap also where that digit is a whole step.
    near = np.abs(steps - step) <= max(0.5 * step, 1.5 * resolution)
    usual = float(steps[near].mean()) if near.any() else step
    uneven = np.abs(steps - usual) > max(0.5 * usual, min(resolution, MOST_ROUNDED * usual))
    if uneven.any():
        sample = int(np.argmax(uneven)) + 1
        width = float(steps[sample - 1])
        lost = round(min(width / usual, 1e9)) - 1
        problem = (
            f"a gap, {lost} {'sample is' if lost == 1 else 'samples are'} missing" if lost > 0 else "an uneven step"
        )
        digits = ", or raise the digits of the time column" if resolution > 0.5 * usual else ""
        raise SignalError(
            f"{where(sample)}: {problem} ({width:.6g} s after {seconds[sample - 1]:.9g} s "
            f"where {step:.6g} s must be); cut the record there or fill the gap before use{digits}."
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


def unit_of_time(time: Column) -> str | None:
    """The unit of time in the header's brackets, or at the end of its name, as in time_ms."""
    ending = time.name.lower().replace(" ", "_").rpartition("_")[2]
    return time.unit or (ending if ending in TIME_UNITS and ending != time.name.lower() else None)


def _time_scale(table: MeasuredTable, time: Column) -> float:
    unit = unit_of_time(time)
    if unit is None:
        return 1.0
    if unit.lower() not in TIME_UNITS:
        raise SignalError(
            f"{table.path}, column {time.name!r}: the unit of time must be one of s, ms, us, min, "
            f"got {unit!r}; correct the header."
        )
    return TIME_UNITS[unit.lower()]
