"""How long a cam turn takes by the record itself: the shortest time after which it resembles itself.

    ρ(T) = Σ y(t) y(t + T) / √(Σ y(t)² Σ y(t + T)²)

An index repeats with every cam turn, whatever the machine's stiffness, so this needs no model of it.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

SHORTEST, LONGEST = 0.25, 4.0
"""Periods looked at, over the one that is expected."""

_BAND = 12.0
"""Highest frequency that takes part, over that of the expected cam turn: the index itself, hardly its ringing."""

_ALIKE = 0.9
"""Share of the highest resemblance that a shorter period must reach to be the period: two turns resemble as well."""

_LEAST, _SHORT = 0.3, 0.6
"""Resemblance below which a long record has no period, and what a record of m turns must have more, times m: the fewer
turns, the more alike is noise to itself. Effects that make every turn another one leave 0.47 of ten turns."""


def cam_period(values: np.ndarray, rate: float, expected: float) -> float | None:
    """Duration of a cam turn [s] by a record (n,) at `rate` [Hz], near `expected` [s]; None where nothing repeats, or
    the record is too short to show it."""
    longest = min(int(LONGEST * expected * rate), len(values) // 2)
    shortest = int(SHORTEST * expected * rate)
    if longest < 1.05 * expected * rate or longest - shortest < 3:
        return None
    likeness = _likeness(_lowpassed(values, rate, _BAND / expected), longest + 2)
    peaks = np.flatnonzero((likeness[1:-1] >= likeness[:-2]) & (likeness[1:-1] > likeness[2:])) + 1
    least = _LEAST + _SHORT * expected * rate / len(values)
    peaks = peaks[(peaks >= shortest) & (likeness[peaks] > least)]
    if not len(peaks):
        return None
    first = int(peaks[likeness[peaks] >= _ALIKE * likeness[peaks].max()][0])
    return (first + _vertex(likeness[first - 1 : first + 2])) / rate


def _lowpassed(values: np.ndarray, rate: float, frequency: float) -> np.ndarray:
    centred = values - values.mean()
    if frequency >= 0.45 * rate:
        return centred
    return sosfiltfilt(butter(4, frequency, fs=rate, output="sos"), centred)


def _likeness(y: np.ndarray, lags: int) -> np.ndarray:
    """ρ at lags 0 … lags-1 [samples]."""
    n = len(y)
    padded = 1 << (2 * n - 1).bit_length()
    products = np.fft.irfft(np.abs(np.fft.rfft(y, padded)) ** 2, padded)[:lags]
    energy = np.concatenate([[0.0], np.cumsum(y**2)])
    lag = np.arange(lags)
    head, tail = energy[n - lag], energy[n] - energy[lag]
    return products / np.sqrt(np.maximum(head * tail, 1e-300))


def _vertex(three: np.ndarray) -> float:
    """Where the parabola through three values, the middle one highest, has its top; in samples from the middle."""
    below, middle, above = three
    return 0.5 * (below - above) / (below - 2.0 * middle + above)
