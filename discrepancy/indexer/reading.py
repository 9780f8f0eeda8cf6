"""What a sensor makes of windows' true accelerations, and how far that is from what was measured."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.loops import loops
from discrepancy.indexer.nuisance import without_nuisance
from indexer_env.filters import BRACKET_LIMIT
from indexer_env.sensors import Sensor

ReadAs = Callable[[Sensor, np.ndarray, np.ndarray], np.ndarray]
"""Sensor, true accelerations (k, samples), windows (k,) -> what is read of them."""

_BELOW = 1.0 - 1e-6
"""Share of the highest frequency of a filter up to which a clock may move one."""

_BAD = 1e3
"""Normalised residual of a run that left the physical range: worse than any that did not."""


def filters_of(sensor: Sensor, sample_rate: float) -> tuple[np.ndarray, ...]:
    """A sensor's filters as second-order sections."""
    return _designed(sensor, sample_rate) if has_filters(sensor) else ()


def passed(filters: Sequence[np.ndarray], frequencies: np.ndarray, sample_rate: float) -> np.ndarray:
    """What filters of a sampling rate [Hz] pass on of frequencies (f,) [Hz], complex."""
    import scipy.signal

    out = np.ones(len(frequencies), dtype=complex)
    for sections in filters:
        out *= scipy.signal.sosfreqz(sections, frequencies, fs=sample_rate)[1] if len(frequencies) else 1.0
    return out


def has_filters(sensor: Sensor) -> bool:
    """Whether a sensor has a bracket's resonance, a high-pass or a low-pass."""
    return any(hz is not None for hz in (sensor.bracket_hz, sensor.highpass_hz, sensor.lowpass_hz))


def of_its_rate(sensor: Sensor) -> bool:
    """Whether a sensor has a bracket's resonance or a low-pass, which would be others at a lower sampling rate; a
    high-pass, of some Hz at most, would not."""
    return sensor.bracket_hz is not None or sensor.lowpass_hz is not None


def by_clock(sensor: Sensor, fast: float, rate: float) -> Sensor:
    """A sensor with its filters as a clock sees them whose rate is higher by so much, relatively, than the stated one
    [Hz]; a frequency at the very limit of that rate stays there."""
    if not has_filters(sensor) or fast == 0.0:
        return sensor
    seen = {}
    for name, limit in (("bracket_hz", BRACKET_LIMIT), ("highpass_hz", 0.5), ("lowpass_hz", 0.5)):
        hz = getattr(sensor, name)
        if hz is not None:
            seen[name] = min(hz / (1.0 + fast), max(hz, _BELOW * limit * rate))
    return dataclasses.replace(sensor, **seen)


@functools.lru_cache(maxsize=256)
def _designed(sensor: Sensor, sample_rate: float) -> tuple[np.ndarray, ...]:
    """The same: to design them takes as long as to filter ten windows."""
    return tuple(sensor.sections(sample_rate))


def numbered(
    sensors: Sequence[Sensor], usual: Sensor, point: np.ndarray, clock: np.ndarray, rate: float
) -> tuple[list[Sensor], np.ndarray]:
    """The different ones among sensors (p,) of points as the records' clocks see them, and the number of each job's.

    `point` and `clock` (n,) are a job's point, and by how much its record's rate is higher than the stated `rate` [Hz],
    relatively.
    """
    numbers: dict[Sensor | None, int] = {}
    # to hash a sensor takes as long as to read a window, and most are the usual one itself
    own = (None if sensor is usual else sensor for sensor in sensors)
    number = np.array([numbers.setdefault(sensor, len(numbers)) for sensor in own])[point]
    different = [sensor or usual for sensor in numbers]
    if not any(has_filters(sensor) for sensor in different):
        return different, number
    pairs, number = np.unique(np.stack([number, clock]), axis=1, return_inverse=True)
    return [by_clock(different[int(k)], fast, rate) for k, fast in pairs.T.tolist()], number.ravel()


def runs(numbers: np.ndarray) -> list[slice]:
    """Stretches of equal numbers (n,) that stand side by side."""
    edges = [0, *(np.flatnonzero(numbers[1:] != numbers[:-1]) + 1).tolist(), len(numbers)]
    return [slice(first, last) for first, last in itertools.pairwise(edges)]


def bounded(rows: np.ndarray, factors: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Sums of squares (k,) of residuals (k, samples), which are multiplied by `factors` (k,), made 0 beyond a window's
    `counts` (k,) and kept within what is worse than any good one, where a run failed (NaN) or left the physical range.
    """
    _, weigh = loops()
    weigh(rows, factors, counts)
    squares = np.einsum("kn,kn->k", rows, rows)
    failed = ~(squares <= _BAD**2)
    if failed.any():
        # of a number and NaN fmin takes the number
        rows[failed] = np.maximum(np.fmin(rows[failed], _BAD), -_BAD)
        squares[failed] = np.einsum("kn,kn->k", rows[failed], rows[failed])
    return squares


@dataclass(frozen=True, eq=False)
class Reading:
    """The windows of records as a sensor saw them.

    Attributes
    ----------
    measured : ndarray (w, samples)
        [unit of the sensor]; 0 beyond a window's end.
    counts, first : ndarray (w,) of int
        Samples of each window, and its first one in its record.
    begun : ndarray (w,)
        Time of that record's first sample since the sensor's record began [s].
    sample_rate : float
        [Hz]
    """

    measured: np.ndarray
    counts: np.ndarray
    first: np.ndarray
    begun: np.ndarray
    sample_rate: float

    def difference(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        """Readings of true accelerations (n, samples) less those that were measured, what is unknown of single windows
        taken out; may overwrite `acceleration`."""
        difference = self._read(sensor, acceleration, window)
        subtract, _ = loops()
        subtract(difference, self.measured, window)
        filters, hum = filters_of(sensor, self.sample_rate), sensor.hum_amplitude
        if filters or hum != 0.0:
            counts, cycles = self.counts[window], sensor.hum_hz / self.sample_rate
            for part in runs(counts):
                own = difference[part, : counts[part.start]]
                own[:] = without_nuisance(own, filters, hum, cycles, sensor.hum_third)
        return difference

    def _filtered(self, sensor: Sensor, acceleration: np.ndarray) -> np.ndarray:
        """What leaves the sensor's filters (n, samples), at rest before. Overwrites `acceleration`."""
        import scipy.signal

        y = acceleration
        if sensor.scale != 1.0:
            y *= sensor.scale
        for sections in filters_of(sensor, self.sample_rate):
            y = np.asarray(scipy.signal.sosfilt(sections, y))
        return y

    def whole(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        """Readings of true accelerations (n, samples), hum with its stated phase; may overwrite `acceleration`."""
        y = self._filtered(sensor, acceleration)
        return sensor.with_background(y, self._time(window, y.shape[1]))

    def _time(self, window: np.ndarray, samples: int) -> np.ndarray:
        """Time (n, samples) of windows' samples since their sensor's record began [s]."""
        time = (self.first[window][:, None] + np.arange(samples)) / self.sample_rate
        return time + self.begun[window][:, None]

    def _read(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        """The sensor's reading (n, samples) of windows without hum, as filtered. Overwrites `acceleration`."""
        y = self._filtered(sensor, acceleration)
        if sensor.offset == 0.0 and sensor.offset_drift == 0.0:
            return y
        return dataclasses.replace(sensor, hum_amplitude=0.0).with_background(y, self._time(window, y.shape[1]))
