"""The time column of a measured file -> one sampling rate, or the first place where the grid is not even."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from indexer_env.errors import SignalError
from indexer_records.formats.table import TIME_UNITS, Column, MeasuredTable

SHORTEST_STEP = 1e-7
LONGEST_STEP = 10.0
"""Sampling steps outside this range [s] are no vibration record but a wrong unit of time."""

SHORTEST_UNSTATED = 1e-6
LONGEST_UNSTATED = 0.1
"""From these steps on [s] a time without a unit is none of seconds: a table's vibration is recorded neither at 1 MHz
nor at 10 Hz."""

LONG_UNITS = ("h", "hr", "hrs", "hour", "hours", "d", "day", "days")
"""Endings of a name that are units of time, and none in which a vibration is recorded; they are refused."""

MOST_STRAY_STEPS = 2.0
"""Sampling steps by which a sample may lie off the even grid of its record; more is a rate that changes."""

MOST_ROUNDED = 0.9
"""Sampling steps by which rounding may change one: where one in twenty or fewer is doubled, samples are missing."""

COARSE = 0.5
"""Sampling steps from which on the last digit of time may hide in its rounding that a sample is missing."""

MOST_OFF_GRID = 0.25
"""Sampling steps by which a sample may lie off the even grid of its neighbours, rounding aside; about a missing one
they lie off by half a step."""

NEIGHBOURS = 200
"""Samples to which that grid is fitted: so few that the drift of a clock is none."""


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
    seconds = seconds_of(table, time)
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
    if unit_of_time(time) is None and not SHORTEST_UNSTATED < step < LONGEST_UNSTATED:
        raise SignalError(
            f"{table.path}, column {time.name!r}: a time without a unit is one in seconds, whose step must lie between "
            f"{SHORTEST_UNSTATED:g} and {LONGEST_UNSTATED:g} s, got {step:.6g}; write its unit into the header, as in "
            f"{time.name + ' [ms]'!r}, or give the sampling rate where it counts samples."
        )
    check_step(f"{table.path}, column {time.name!r}", step, "correct the unit of time in the header")
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
    if resolution > COARSE * usual:
        off, sample = _farthest_off_grid(seconds)
        rounding = 0.5 * resolution
        if off > rounding + MOST_OFF_GRID * usual:
            raise SignalError(
                f"{where(sample)}: a gap, samples are missing about there (a time {off:.3g} s off the even grid of its "
                f"neighbours, where rounding makes {rounding:.3g} s); cut the record there or fill the gap before use, "
                "or raise the digits of the time column."
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


def _farthest_off_grid(seconds: np.ndarray) -> tuple[float, int]:
    """The largest distance [s] of a time from the even grid of its neighbours, by least squares, and its sample. Each
    stretch of neighbours overlaps half the next, so that every sample has some on both sides in one of them."""
    size = min(NEIGHBOURS, len(seconds))
    begins = np.append(np.arange(0, len(seconds) - size, max(1, size // 2)), len(seconds) - size)
    times = sliding_window_view(seconds, size)[begins]
    place = np.arange(size) - 0.5 * (size - 1)
    mean = times.mean(axis=1, keepdims=True)
    slope = (times - mean) @ place / (place @ place)
    off = np.abs(times - mean - slope[:, None] * place)
    stretch, sample = np.unravel_index(int(np.argmax(off)), off.shape)
    return float(off[stretch, sample]), int(begins[stretch] + sample)


def seconds_of(table: MeasuredTable, time: Column) -> np.ndarray:
    """A column of time in seconds, infinite where it overflows."""
    with np.errstate(over="ignore"):
        return time.numbers() * _time_scale(table, time)


def unit_of_time(time: Column) -> str | None:
    """The unit of time in the header's brackets, or at the end of its name, as in time_ms."""
    ending = time.name.lower().replace(" ", "_").rpartition("_")[2]
    return time.unit or (ending if ending in (*TIME_UNITS, *LONG_UNITS) and ending != time.name.lower() else None)


def _time_scale(table: MeasuredTable, time: Column) -> float:
    unit = unit_of_time(time)
    if unit is None:
        return 1.0
    if unit.lower() not in TIME_UNITS:
        raise SignalError(
            f"{table.path}, column {time.name!r}: the unit of time must be one of s, ms, us, ns, min, "
            f"got {unit!r}; give the times in one of these, with it in the header."
        )
    return TIME_UNITS[unit.lower()]
