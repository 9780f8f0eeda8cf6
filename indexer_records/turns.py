"""Where the turns of the table lie in a record: between the edges of a once-per-turn pulse, or period after period.

Between two pulses the table is taken to keep its pace, as in order tracking with one pulse a turn: the wanted number of
samples is spread evenly over each turn, so that the same sample of every record stands for the same place in the turn.
A turn is stretched by its own duration over the nominal one, at most by the tolerance. Source: Fyfe and Munck,
"Analysis of computed order tracking", Mechanical Systems and Signal Processing 11 (1997).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.conditions import Pulse

HYSTERESIS = 0.2
"""Share of the way from the threshold to the nearer extreme of the pulse that an edge must pass on both sides: noise on
it is no second pulse."""

_LEAST_BESIDE_A_GLITCH = 0.2
"""Share of the range that a pulse must have whose extremes are those of a glitch: less is its baseline."""

_LEAST_OVER_NOISE = 12.0
"""Its height over the median step between samples, of which noise alone spans ten in a million samples."""

_MARKS_BESIDE_A_GLITCH = 3
"""Edges that tell against the one excursion that hides them."""


@dataclass(frozen=True)
class Turn:
    """A turn of the table: where it begins in the record and how long it lasts [s], and the rule it breaks, "" for
    none."""

    start: float
    duration: float
    problem: str = ""


def turns_by_period(duration: float, period: float) -> tuple[list[Turn], int]:
    """Turns one after the other from the first sample of a record of `duration` [s], and the number of partial turns
    left out at its end: 0 or 1."""
    # A record of one turn may lack a millionth of a sample by the rounding of its rate.
    whole = int(duration / period * (1.0 + 1e-9))
    return [Turn(index * period, period) for index in range(whole)], int(duration > whole * period * (1.0 + 1e-9))


def turns_by_pulse(edges: np.ndarray, period: float, tolerance: float) -> tuple[list[Turn], int]:
    """Turns between the pulses at `edges` [s], and the number of partial turns left out: before the first pulse and
    behind the last."""
    turns = [
        Turn(float(start), float(length), _problem(float(length), period, tolerance))
        for start, length in zip(edges[:-1], np.diff(edges), strict=True)
    ]
    return turns, 2


def _problem(length: float, period: float, tolerance: float) -> str:
    if abs(length - period) <= tolerance * period:
        return ""
    missed = round(length / period) - 1
    if missed > 0 and abs(length - (missed + 1) * period) <= tolerance * length:
        why = f"{missed} {'pulse was' if missed == 1 else 'pulses were'} missed"
    else:
        why = "a pulse too many" if length < 0.5 * period else "another speed"
    return f"must last {period:g} s within {100 * tolerance:g} %, got {length:.6g} s ({why})"


def pulse_edges(pulse: np.ndarray, rate: float, settings: Pulse, least: int = 2) -> np.ndarray:
    """Times at which the pulse crosses its threshold [s after its first sample], between samples by a straight line.

    Where none is given, it lies half-way between the extremes; on a pulse of both polarities, whose baseline lies there
    already, half-way between its median and the extreme on the edge's side. One excursion that hides all other pulses
    is a glitch and no extreme.

    Parameters
    ----------
    pulse : numpy.ndarray, shape (n,)
        In the file's unit.

    Raises
    ------
    SignalError
        The pulse is constant, does not reach the threshold, or has fewer than `least` edges.
    """
    edges, (_, _, level) = _found(pulse, settings)
    if len(edges) < least:
        wanted = f"two {settings.edge} edges" if least == 2 else f"one {settings.edge} edge"
        raise SignalError(
            f"the pulse must have {wanted} at least, got {len(edges)} across {level:g}; record more turns, or give the "
            "level of its edges (pulse.threshold=NUMBER)."
        )
    return edges / rate


def pulse_levels(pulse: np.ndarray, settings: Pulse) -> tuple[float, float, float]:
    """Least and greatest value of a pulse (n,) and the level of its edges, as `pulse_edges` takes them."""
    return _found(pulse, settings)[1]


def _found(pulse: np.ndarray, settings: Pulse) -> tuple[np.ndarray, tuple[float, float, float]]:
    """Edges [samples], and the extremes and the level that they go by."""
    low, high = float(pulse.min()), float(pulse.max())
    edges, level = _edges(pulse, low, high, settings)
    if len(edges) < 2 and settings.threshold is None:
        within = _beside_a_glitch(pulse, low, high)
        among, its = _edges(pulse, *within, settings)
        if len(among) >= _MARKS_BESIDE_A_GLITCH:
            return among, (*within, its)
    return edges, (low, high, level)


def _edges(pulse: np.ndarray, low: float, high: float, settings: Pulse) -> tuple[np.ndarray, float]:
    """Where the pulse crosses its threshold [samples], and that threshold."""
    level = _level(pulse, low, high, settings)
    return EdgeFinder(low, high, replace(settings, threshold=level)).feed(pulse)[0], level


def _level(pulse: np.ndarray, low: float, high: float, settings: Pulse) -> float:
    if settings.threshold is not None:
        return float(settings.threshold)
    middle = 0.5 * low + 0.5 * high
    # of two middle samples the upper one: the sum of huge ones overflows
    usual = float(np.partition(pulse, len(pulse) // 2)[len(pulse) // 2])
    if abs(usual - middle) > HYSTERESIS * (0.5 * high - 0.5 * low):
        return middle
    return 0.5 * usual + 0.5 * (high if settings.edge == "rising" else low)


def _beside_a_glitch(pulse: np.ndarray, low: float, high: float) -> tuple[float, float]:
    """The extremes without an excursion that alone reaches where an edge would count; the same ones where what is left
    is no pulse but noise."""
    height = pulse / max(abs(low), abs(high))
    bottom, top = float(height.min()), float(height.max())
    counts = 0.5 * (1.0 + HYSTERESIS) * (top - bottom)
    highest, lowest = _peak_beside_one(height, bottom + counts), _peak_beside_one(-height, counts - top)
    noise = float(np.median(np.abs(np.diff(height)))) if len(height) > 1 else 0.0
    left = height[highest] - height[lowest]
    if left <= max(_LEAST_BESIDE_A_GLITCH * (top - bottom), _LEAST_OVER_NOISE * noise):
        return low, high
    return float(pulse[lowest]), float(pulse[highest])


def _peak_beside_one(height: np.ndarray, level: float) -> int:
    """Place of the highest sample; where one short stretch alone reaches the level, of the highest outside it."""
    above = height >= level
    stretches = np.count_nonzero(above[1:] & ~above[:-1]) + int(above[0])
    lone = stretches == 1 and 2 * np.count_nonzero(above) < len(height)
    return int(np.argmax(np.where(above, -np.inf, height) if lone else height))


class EdgeFinder:
    """Edges of a pulse whose samples come piece by piece; four of them are kept, and how they are cut changes nothing.

    Parameters
    ----------
    low, high : float
        Extremes of the pulse, in its unit.
    settings : Pulse

    Raises
    ------
    SignalError
        The extremes are equal, or the threshold does not lie between them.
    """

    def __init__(self, low: float, high: float, settings: Pulse) -> None:
        if low == high:
            raise SignalError(f"the pulse must change, got {low:g} throughout; check the sensor and its cable.")
        level = 0.5 * low + 0.5 * high if settings.threshold is None else float(settings.threshold)
        if not low < level < high:
            raise SignalError(f"pulse.threshold must lie within the pulse, {low:g} to {high:g}, got {level:g}.")
        # In shares of the largest value, so that no difference of absurd values overflows.
        self._scale = max(abs(low), abs(high)) * (1.0 if settings.edge == "rising" else -1.0)
        self._level = level / self._scale
        reach = level / abs(self._scale)
        self._margin = HYSTERESIS * min(reach - low / abs(self._scale), high / abs(self._scale) - reach)
        self._index, self._height, self._count = np.empty(0, int), np.empty(0), 0

    def feed(self, pulse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where it has crossed the threshold [samples since the first of all], and after how many samples of all each
        crossing was sure."""
        index = np.concatenate([self._index, self._count + np.arange(len(pulse))])
        height = np.concatenate([self._height, pulse / self._scale - self._level])
        self._count += len(pulse)
        before, tops = _crossings(height, self._margin)
        # What is kept holds the crossing that was told before.
        new = tops >= len(self._index)
        before, tops = before[new], tops[new]
        edges = index[before] + height[before] / (height[before] - height[before + 1])
        kept = _deciding(height, self._margin)
        self._index, self._height = index[kept], height[kept]
        return edges, index[tops] + 1


def _crossings(height: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Last places below 0 from which `height` rises on its way from below -margin to above +margin, and the first
    places above."""
    outside = np.flatnonzero(np.abs(height) > margin)
    above = height[outside] > 0.0
    tops = outside[1:][above[1:] & ~above[:-1]]
    last_below = np.maximum.accumulate(np.where(height <= 0.0, np.arange(len(height)), -1))
    return last_below[tops], tops


def _deciding(height: np.ndarray, margin: float) -> np.ndarray:
    """Places, in order, of the samples on which the next crossing depends: the last outside the margin, the last below
    0 with the one after it, and the last of all."""
    outside, below = np.flatnonzero(np.abs(height) > margin)[-1:], np.flatnonzero(height <= 0.0)[-1:]
    last = np.array([len(height) - 1], dtype=int)
    places = np.unique(np.concatenate([outside, below, below + 1, last]))
    return places[(places >= 0) & (places < len(height))]
