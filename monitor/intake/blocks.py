"""A stretch of samples of one sensor with its time."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.acceleration_units import ACCELERATION_UNITS, KNOWN, normal

NANO = 1_000_000_000
"""Nanoseconds in a second."""

LARGEST_BLOCK = 2**18
"""Most samples of a block: four minutes at 1 kHz."""

EARLIEST_NS = 0
LATEST_NS = 4_102_444_800 * NANO
"""Times between which a block may begin: 1970 to 2100."""

LARGEST_RATE = 1e6
"""Highest sampling rate [Hz]: above it the nanoseconds of a clock no longer tell one sample from the next."""

_NAME = re.compile(r"[\w][\w .:+-]{0,63}")


@dataclass(frozen=True, eq=False)
class Block:
    """Samples of one sensor, evenly spaced from `start_ns` on.

    Attributes
    ----------
    machine : str
        Name of the machine: letters, digits and any of ``.:_+-`` and spaces, at most 64.
    start_ns : int
        Time of the first sample [ns since 1970, UTC].
    rate : float
        Of the samples [Hz], > 0.
    unit : str
        rad/s^2 or m/s^2, after conversion of what was written.
    values : numpy.ndarray, shape (n,), float32
        Acceleration of the table. A sample that is not finite is one that the sensor did not give.
    pulse : numpy.ndarray or None, shape (n,), float32
        Once-per-turn pulse at the same times.
    sequence : int or None
        Number that the sender counts up by one from block to block.
    sensor : str or None
        Name or serial number of the sensor.
    motor_speed : float or None
        Of the motor shaft [rad/s], where the sender knows it.
    begins : bool
        The block is the first of a recording: what lies before it is no gap.

    Raises
    ------
    SignalError
        A field breaks its rule; the sentence says which.
    """

    machine: str
    start_ns: int
    rate: float
    unit: str
    values: np.ndarray
    pulse: np.ndarray | None = None
    sequence: int | None = None
    sensor: str | None = None
    motor_speed: float | None = None
    begins: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.machine, str) or not _NAME.fullmatch(self.machine):
            raise _refuse("machine", "a name of at most 64 letters, digits and ' .:_+-'", self.machine)
        if not _whole(self.start_ns) or not EARLIEST_NS <= self.start_ns <= LATEST_NS:
            raise _refuse("time", "between 1970 and 2100", self.start_ns)
        if not _real(self.rate) or not 0.0 < self.rate <= LARGEST_RATE:
            raise _refuse("rate", f"> 0 and <= {LARGEST_RATE:g} Hz", self.rate)
        if not isinstance(self.unit, str) or normal(self.unit) not in ACCELERATION_UNITS:
            raise _refuse("unit", f"one of {KNOWN}", self.unit)
        unit, factor = ACCELERATION_UNITS[normal(self.unit)]
        values = _samples("values", self.values, factor)
        if self.start_ns + values.size / float(self.rate) * NANO > LATEST_NS:
            raise _refuse("rate", f"such that {values.size} samples end before 2100, in Hz", self.rate)
        if self.pulse is not None:
            pulse = _samples("pulse", self.pulse, 1.0)
            if pulse.shape != values.shape or not np.isfinite(pulse).all():
                raise _refuse("pulse", f"{values.size} finite numbers, one for each value", f"{pulse.size} numbers")
            object.__setattr__(self, "pulse", pulse)
        if self.sequence is not None and (not _whole(self.sequence) or not 0 <= self.sequence < 2**62):
            raise _refuse("sequence", "a whole number >= 0", self.sequence)
        if self.sensor is not None and (not is_text(self.sensor) or len(self.sensor) > 64):
            raise _refuse("sensor", "a text of at most 64 signs that UTF-8 has", self.sensor)
        if self.motor_speed is not None and (not _real(self.motor_speed) or not 0.0 < self.motor_speed < 1e5):
            raise _refuse("speed", "> 0 and < 100000 rad/s at the motor shaft", self.motor_speed)
        if not isinstance(self.begins, bool):
            raise _refuse("begins", "true or false", self.begins)
        object.__setattr__(self, "rate", float(self.rate))
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "values", values)

    @property
    def duration_ns(self) -> int:
        """Time that the samples stand for [ns]."""
        return round(self.values.size / self.rate * NANO)

    @property
    def end_ns(self) -> int:
        """Time of the sample that would follow the last [ns since 1970]."""
        return self.start_ns + self.duration_ns

    def behind(self, time_ns: int) -> Block | None:
        """The block with the samples alone that lie behind a time [ns since 1970]; None where there are none."""
        known = max(0, round((time_ns - self.start_ns) / NANO * self.rate))
        if known >= self.values.size:
            return None
        if not known:
            return self
        start = self.start_ns + round(known / self.rate * NANO)
        pulse = None if self.pulse is None else self.pulse[known:]
        return replace(self, start_ns=start, values=self.values[known:], pulse=pulse)


def _samples(name: str, given: object, factor: float) -> np.ndarray:
    try:
        array = np.asarray(given)
    except ValueError:
        raise _refuse(name, "a list of numbers", "a nested one") from None
    if array.dtype.kind not in "iuf" or array.ndim != 1 or not 1 <= array.size <= LARGEST_BLOCK:
        raise _refuse(name, f"a list of 1 to {LARGEST_BLOCK} numbers", f"shape {array.shape} of {array.dtype}")
    with np.errstate(over="ignore", invalid="ignore"):
        samples = (array.astype(np.float64) * factor).astype(np.float32)
    samples.flags.writeable = False
    return samples


def is_text(value: object) -> TypeGuard[str]:
    """A text that can be written down: JSON lets half a sign pass, such as \\ud800 alone."""
    return isinstance(value, str) and not any("\ud800" <= sign <= "\udfff" for sign in value)


def _real(value: object) -> bool:
    """A real number; whole ones may be larger than any float."""
    return _whole(value) or (isinstance(value, float) and math.isfinite(value))


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _refuse(name: str, rule: str, got: object) -> SignalError:
    text = repr(got)
    return SignalError(f"the block's {name} must be {rule}, got {text if len(text) <= 80 else text[:77] + '...'}.")
