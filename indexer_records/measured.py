"""Measured files -> `Signal`, each doubt answered by one sentence: what, where, rule, value, remedy.

A record is one acceleration channel on an even time grid. The rate comes from the file, from a column of time or from
`sample_rate`. Units are read from the file ("acceleration [m/s^2]") or given; they are never guessed from the size of
the numbers. Which formats are read says `indexer_records.formats`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from indexer_env.checks import check_number
from indexer_env.errors import SignalError, refuse
from indexer_env.signal import Signal
from indexer_records.acceleration_units import KNOWN, unit_of
from indexer_records.column_choice import are_numbers, named, record_of, time_beside, time_of
from indexer_records.formats import read_table
from indexer_records.formats.table import Column, MeasuredTable
from indexer_records.time_grid import check_step, even_rate, seconds_of

RATE_TOLERANCE = 1e-3
"""Relative difference between a file's rate and the expected one that still counts as equal (clock of a data
logger)."""

MOST_APART = 0.5
"""Sampling steps by which channels that belong together may be sampled one after the other."""


def same_rate(rate: float, other: float) -> bool:
    """Whether two rates count as equal, see RATE_TOLERANCE."""
    return abs(rate - other) <= RATE_TOLERANCE * other


@dataclass(frozen=True)
class Reading:
    """What a measured file leaves open; None where the file says it.

    Attributes
    ----------
    sample_rate : float or None
        Rate of a file that states none and has no time column [Hz].
    unit : str or None
        Unit of a channel that states none, e.g. "m/s^2", "g" or "rad/s^2"; with `scale` that of the result.
    scale : float or None
        What one of the written numbers is worth in `unit`: the full scale of a WAV file, 10 g/V of an amplifier.
    time_column : str or None
        Name of the column or channel of time, where the file leaves a choice; it stands above a rate that
        the file states.
    signal_column : str, tuple of str or None
        Name of the channel, or of several that make one record together.
    """

    sample_rate: float | None = None
    unit: str | None = None
    scale: float | None = None
    time_column: str | None = None
    signal_column: str | tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        self._check_channels()
        for name in ("unit", "time_column"):
            value = getattr(self, name)
            if not isinstance(value, str | type(None)):
                raise refuse("read", name, "a text or null", value, f"quote it: read.{name}='\"...\"'")
        if self.sample_rate is not None:
            check_number("read", "sample_rate", self.sample_rate, low=0.0, low_open=True, unit="Hz")
        if self.scale is None:
            return
        check_number("read", "scale", self.scale)
        if self.scale == 0.0:
            raise refuse("read", "scale", "a number other than 0", self.scale)
        if self.unit is None:
            raise refuse("read", "unit", f"one of {KNOWN} where a scale is given", None)

    def _check_channels(self) -> None:
        given = self.signal_column
        names = tuple(given) if isinstance(given, list | tuple) else () if given is None else (given,)
        listed = given is None or isinstance(given, str) or (len(names) > 0 and len(set(map(str, names))) == len(names))
        if not listed or not all(isinstance(name, str) for name in names):
            rule = "a text, a list of different texts or null"
            raise refuse("read", "signal_column", rule, given, "quote it: read.signal_column='\"...\"'")
        object.__setattr__(self, "signal_column", names if len(names) > 1 else names[0] if names else None)

    @property
    def names(self) -> tuple[str, ...]:
        """The channels that are named; empty where the file has no choice."""
        given = self.signal_column
        return given if isinstance(given, tuple) else (given,) if given else ()


@dataclass(frozen=True, eq=False)
class Recording:
    """One measured record with what belongs to it.

    Attributes
    ----------
    signals : tuple of Signal
        One for each channel, of the same rate, length and unit.
    channels : tuple of str
        Their names.
    pulse : numpy.ndarray or None, shape (n,)
        Samples of the once-per-turn pulse, where one was asked for, in the file's own unit, taken at the same times.
    factor : float
        What one of the file's numbers is worth in the unit of the first signal.
    """

    signals: tuple[Signal, ...]
    channels: tuple[str, ...]
    pulse: np.ndarray | None
    factor: float = 1.0

    @property
    def signal(self) -> Signal:
        """The one channel; SignalError where there are several."""
        signal, *others = self.signals
        if others:
            names = ", ".join(map(repr, self.channels))
            raise SignalError(f"read.signal_column must name one channel here, got {names}; choose one of them.")
        return signal


def read_signal(
    path: str | Path,
    *,
    expected_rate: float | None = None,
    expected_duration: float | None = None,
    sample_rate: float | None = None,
    unit: str | None = None,
    scale: float | None = None,
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
    sample_rate, unit, scale, time_column, signal_column : optional
        As in `Reading`.

    Raises
    ------
    SignalError
        Whatever keeps the file from being such a record: see the tests for the list.
    ParameterError
        What `Reading` refuses.
    """
    signal = read_recording(path, Reading(sample_rate, unit, scale, time_column, signal_column)).signal
    rate = signal.sample_rate
    if expected_rate is not None and not same_rate(rate, expected_rate):
        raise SignalError(
            f"{signal.source} is sampled at {rate:.6g} Hz where {expected_rate:.6g} Hz must be; "
            "record at that rate or resample the file."
        )
    samples = signal.values.size
    if expected_duration is not None and samples < round(expected_duration * rate):
        raise SignalError(
            f"{signal.source} lasts {samples / rate:.4g} s ({samples} samples) where at least "
            f"{expected_duration:.4g} s must be; record at least one turn of the table."
        )
    return signal


def read_recording(path: str | Path, reading: Reading, pulse_column: str | None = None) -> Recording:
    """Read the channels of one acceleration record and the pulse that goes with it; raises SignalError."""
    table = read_table(path)
    pulse = None if pulse_column is None else named(table, pulse_column)
    time = named(table, reading.time_column) if reading.time_column else None
    rate = reading.sample_rate
    columns = [named(table, name) for name in reading.names] or [record_of(table, time, pulse, rate)]
    found = [_signal(table, time or time_of(table, column, rate), column, reading) for column in columns]
    first = found[0][0]
    for (signal, _), column in zip(found, columns, strict=True):
        mine, its = ((one.values.size, one.sample_rate, one.unit) for one in (signal, first))
        if mine != its:
            raise SignalError(
                f"{table.path}: channels of one record must have one length, rate and unit, got "
                f"{its[0]} samples at {its[1]:g} Hz in {its[2]} of {columns[0].name!r} and "
                f"{mine[0]} at {mine[1]:g} Hz in {mine[2]} of {column.name!r}; read them as records of their own."
            )
        check_together(table, columns[0], column, time)
    marks = None if pulse is None else _pulse(table, pulse, columns[0], time)
    return Recording(tuple(signal for signal, _ in found), tuple(column.name for column in columns), marks, found[0][1])


def _signal(table: MeasuredTable, time: Column | None, column: Column, reading: Reading) -> tuple[Signal, float]:
    """One channel, and what one of the file's numbers is worth in its unit."""
    values = column.numbers()
    rate = _rate(table, time, column, values, reading.sample_rate)
    unit, factor = unit_of(table, column, reading.unit, reading.scale)
    # A product that overflows is refused by the gate, with its place.
    with np.errstate(over="ignore"):
        scaled = values * factor
    return Signal(scaled, rate, unit=unit, source=str(table.path)), factor


def _rate(table: MeasuredTable, time: Column | None, column: Column, values: np.ndarray, given: float | None) -> float:
    """The rate of a column [Hz]: by its column of time, else as the file states it, else as given."""
    if time is not None:
        if given is not None:
            raise _two_rates(table, f"the time column {time.name!r}", given)
        return _rate_by(table, time, column, values, "in its place" if not are_numbers(time) else "")
    if column.rate is not None:
        return _stated_rate(table, column, column.rate, values, given)
    if given is not None:
        return float(given)
    names = ", ".join(repr(other.name) for other in table.columns)
    raise SignalError(
        f"{table.path} has no time column among {names}; name it (read.time_column=NAME) or give the sampling "
        "rate (read.sample_rate=HZ)."
    )


def _stated_rate(table: MeasuredTable, column: Column, stated: float, values: np.ndarray, given: float | None) -> float:
    """The rate that the file states of a column [Hz]; where the column of time beside it says another, the one given
    decides between the two."""
    time = None if given is not None and same_rate(given, stated) else time_beside(table, column)
    own = stated if time is None else _rate_by(table, time, column, values, "that is right")
    if given is not None and not same_rate(given, own):
        raise _two_rates(table, f"{stated:g} Hz in the file", given)
    if given is None and time is not None and not same_rate(own, stated):
        raise SignalError(
            f"{table.path} must state one sampling rate of {column.name!r}, got {stated:g} Hz and, by its time column "
            f"{time.name!r}, {own:.6g} Hz; name that column (read.time_column=NAME) or give the rate that is right "
            "(read.sample_rate=HZ)."
        )
    rate = stated if given is None else own
    check_step(
        f"{table.path}, column {column.name!r}", 1.0 / rate if rate else math.inf, "correct the rate in the file"
    )
    return rate


def _rate_by(table: MeasuredTable, time: Column, column: Column, values: np.ndarray, which: str) -> float:
    """The rate by a column of time [Hz]; `which` rate may be given instead, "" where none may."""
    try:
        return even_rate(table, time, column, values)
    except SignalError as error:
        if not which:
            raise
        said = str(error).removesuffix(".")
        raise SignalError(f"{said}, or give the sampling rate {which} (read.sample_rate=HZ).") from None


def _two_rates(table: MeasuredTable, what: str, given: float) -> SignalError:
    return SignalError(
        f"{table.path} must have its sampling rate from one place, got {what} and {given:g} Hz; "
        "leave read.sample_rate out."
    )


def _pulse(table: MeasuredTable, pulse: Column, column: Column, time: Column | None) -> np.ndarray:
    if pulse.size != column.size or pulse.rate != column.rate:
        raise SignalError(
            f"{table.path}: the pulse {pulse.name!r} must be sampled together with {column.name!r}, got {pulse.size} "
            f"and {column.size} samples; record both at one rate."
        )
    check_together(table, column, pulse, time)
    return pulse.numbers()


def check_together(table: MeasuredTable, column: Column, other: Column, time: Column | None) -> None:
    """Refuse a channel whose samples were not taken at the times of the first one's, as far as the file tells; `time`
    is the column of time that is named."""
    first = time or time_beside(table, column)
    second = first if other.group == column.group else time_beside(table, other)
    apart = np.array([other.start - column.start])
    step = 0.0 if column.rate is None else 1.0 / column.rate
    if first is not None and second is not None and first is not second:
        one, its = (seconds_of(table, times) for times in (first, second))
        apart, step = its - one, float(np.median(np.diff(one)))
    late = float(apart[np.argmax(np.abs(apart))])
    if abs(late) > MOST_APART * step:
        raise SignalError(
            f"{table.path}: {other.name!r} must be sampled at the same times as {column.name!r}, got some "
            f"{abs(late):.3g} s {'later' if late > 0.0 else 'earlier'}; record both by one clock, or "
            "export them on one grid of time."
        )
