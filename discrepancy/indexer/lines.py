"""Frequencies that stand out of what a model leaves in every record: fixed ones, and orders of the motor shaft."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

_PROMINENT = 30.0
"""Power of a line over the median of its surroundings, from which on it is one: white noise gets there once in some
10⁸ bins (an exponential law's quantile, ln 2 in the median)."""

_SURROUNDINGS = 40
"""Bins on either side that a line is compared with."""

MOST = 2
"""Lines of each kind that are followed up."""

_SLOWEST = 5.0
"""Widths 1/T below which a line cannot be told from a drift."""

_SAME = 1.5
"""Widths 1/T within which lines of two records stand at one place."""


def lines(
    residuals: Sequence[np.ndarray], sample_rate: float | Sequence[float], motor: Sequence[float]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Orders of the motor shaft [-], multiples of a half, and fixed frequencies [Hz] at which lines stand out of every
    record, the strongest first. All are given: what a caller does not ask for must take no place of what it does.

    Parameters
    ----------
    residuals : sequence of ndarray (n,)
        One for each record.
    sample_rate : float or sequence of float
        Of all records, or of each [Hz].
    motor : sequence of float
        Speed of the motor shaft in each record [Hz].
    """
    rates = np.broadcast_to(sample_rate, len(residuals)).tolist()
    widths = [rate / len(row) for row, rate in zip(residuals, rates, strict=True)]
    # the longest record, which tells a line's place best, first
    records = sorted(range(len(rates)), key=widths.__getitem__)
    peaks = [_peaks(residuals[k], rates[k]) for k in records]
    hums = _common(peaks, [1.0] * len(peaks), _SAME * max(widths))
    orders = _common(peaks, [motor[k] for k in records], _SAME * max(widths) / min(motor))
    halves = (round(2.0 * order) / 2.0 for order in orders if _near_half(order))
    return tuple(dict.fromkeys(halves)), hums


def _near_half(order: float) -> bool:
    """Whether an order is a multiple of a half, as those of gears with few teeth are."""
    return order > 0.25 and abs(2.0 * order - round(2.0 * order)) < 0.1


def _common(
    peaks: Sequence[Sequence[tuple[float, float]]], units: Sequence[float], tolerance: float
) -> tuple[float, ...]:
    """Peaks of the first record, over its unit, that all other records have at the same place over theirs, the
    strongest first."""
    first, *others = [[(f / unit, power) for f, power in record] for record, unit in zip(peaks, units, strict=True)]
    found = []
    for place, power in first:
        nearest = [
            min((abs(other - place), p) for other, p in record) if record else (math.inf, 0.0) for record in others
        ]
        if all(distance < tolerance for distance, _ in nearest):
            found.append((min([power, *(p for _, p in nearest)]), place))
    return tuple(place for _, place in sorted(found, reverse=True))


def _peaks(row: np.ndarray, sample_rate: float) -> list[tuple[float, float]]:
    """Frequency [Hz] and prominence of what stands out of a row (n,)."""
    n = len(row)
    hann = np.sin(math.pi * np.arange(n) / n) ** 2
    power = np.abs(np.fft.rfft(hann * row)) ** 2
    at = np.arange(int(_SLOWEST) + 1, len(power) - 2)
    at = at[(power[at] >= power[at - 1]) & (power[at] >= power[at + 1])]
    prominence = power[at] / np.maximum(_around(power, at), 1e-300)
    found = []
    for k in np.flatnonzero(prominence > _PROMINENT).tolist():
        # centre of the three bins, which a Hann window spreads a line over
        three = power[at[k] - 1 : at[k] + 2]
        centre = at[k] + float((three * (-1.0, 0.0, 1.0)).sum() / three.sum())
        found.append((centre * sample_rate / n, float(prominence[k])))
    return found


def _around(power: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Median (k,) of a spectrum (n,) around its bins (k,), fewer of them at its ends."""
    padded = np.pad(power, _SURROUNDINGS, constant_values=math.inf)
    inside = np.minimum(at + _SURROUNDINGS + 1, len(power)) - np.maximum(0, at - _SURROUNDINGS)
    rising = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 2 * _SURROUNDINGS + 1)[at], axis=1)
    rows = np.arange(len(at))
    return 0.5 * (rising[rows, (inside - 1) // 2] + rising[rows, inside // 2])
