"""What is usual for a machine in a mode, and a sensor whose gain jumps.

The first `LEARNED` turns in a mode teach the mean and the scatter of the log level, of the table as a whole and, where
a pulse says which index is which, of each station. A change is told in scatters from there.

A fault changes the shape of the spectrum; a sensor that was exchanged, or an amplifier that was set, scales all of it.
So the gain has jumped where all octaves have moved by the same factor, within ALIKE, and by more than JUMP.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

LEARNED = 30
"""Turns that teach what is usual: the scatter is then known to an eighth."""

JUMP = 0.10
"""Least relative change of gain that is told: sensors of one make differ by less."""

ALIKE = 0.03
"""By how much octaves may differ in a change of gain; noise in an octave of a turn moves it by less."""

OCTAVES = 6
_LOWEST_HZ = 1.0

SCATTERS = 8.0
"""Deviation from what is usual that counts as 1 [scatters]: of 30 turns that teach it, the scatter itself is known to
an eighth, and play makes the tails longer than a normal distribution's."""


class Baseline:
    """What is usual for one machine in one mode."""

    def __init__(self, body: dict[str, Any] | None = None) -> None:
        body = body or {}
        self._count = int(body.get("count", 0))
        self._mean = np.array(body.get("mean", []), dtype=float)
        self._squares = np.array(body.get("squares", []), dtype=float)
        self._octaves = np.array(body.get("octaves", []), dtype=float)

    @property
    def learned(self) -> bool:
        """Whether enough turns were seen."""
        return self._count >= LEARNED

    def add(self, values: np.ndarray) -> np.ndarray | None:
        """Deviation of the values (k,) of a turn from what is usual, in scatters (k,); None while it is learned."""
        if self.learned and self._mean.size == values.size:
            scatter = np.sqrt(self._squares / (self._count - 1))
            return (values - self._mean) / np.maximum(scatter, 0.01)
        if self._mean.size != values.size:
            self._count, self._mean, self._squares = 0, np.zeros(values.size), np.zeros(values.size)
        self._count += 1
        step = values - self._mean
        self._mean = self._mean + step / self._count
        self._squares = self._squares + step * (values - self._mean)
        return None

    def gain(self, record: np.ndarray, rate: float) -> float | None:
        """Factor by which the gain has jumped since the turn before; None where it has not."""
        octaves = octave_levels(record, rate)
        before, self._octaves = self._octaves, octaves
        if before.size != octaves.size:
            return None
        change = octaves - before
        if np.ptp(change) > ALIKE or abs(np.expm1(change.mean())) < JUMP:
            return None
        return float(np.exp(change.mean()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same baseline."""
        return {
            "count": self._count,
            "mean": self._mean.tolist(),
            "squares": self._squares.tolist(),
            "octaves": self._octaves.tolist(),
        }


class Baselines:
    """What is usual for one machine: a baseline for each mode, with a pulse and without.

    Parameters
    ----------
    body : mapping, optional
        What `to_dict` gave.
    """

    def __init__(self, body: dict[str, Any] | None = None) -> None:
        self._baselines = {key: Baseline(value) for key, value in (body or {}).items()}

    def clear(self) -> None:
        """Learn anew, as after another sensor was mounted."""
        self._baselines.clear()

    def far(
        self, key: str, record: np.ndarray, rate: float, level: float, stations: int | None
    ) -> tuple[float, float | None]:
        """How far the level [unit of the record] of a turn's record, and that of each station, lies from what is usual,
        in units of SCATTERS scatters, and the factor by which the gain has jumped; None: it has not. What is usual is
        learnt anew from a jump on."""
        baseline = self._baselines.setdefault(key, Baseline())
        factor = baseline.gain(record, rate)
        if factor is not None:
            # What was usual is so no longer, at no speed.
            self.clear()
            baseline = self._baselines[key] = Baseline()
            baseline.gain(record, rate)
        levels = station_levels(record, stations) if stations else []
        away = baseline.add(np.array([np.log(max(level, 1e-12)), *levels]))
        return 0.0 if away is None else float(np.abs(away).max()) / SCATTERS, factor

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same baselines."""
        return {key: baseline.to_dict() for key, baseline in self._baselines.items()}


def octave_levels(record: np.ndarray, rate: float) -> np.ndarray:
    """Log of the root mean square of a record (n,) in each of OCTAVES octaves from 1 Hz on."""
    power = np.abs(np.fft.rfft(record - record.mean()) / record.size) ** 2
    frequency = np.fft.rfftfreq(record.size, 1.0 / rate)
    edges = _LOWEST_HZ * 2.0 ** np.arange(OCTAVES + 1)
    inside = [power[(frequency >= low) & (frequency < high)].sum() for low, high in itertools.pairwise(edges)]
    return 0.5 * np.log(np.maximum(inside, 1e-30))


def station_levels(record: np.ndarray, stations: int) -> np.ndarray:
    """Log of the root mean square in each of so many equal parts of a turn (n,)."""
    parts = np.array_split(record - record.mean(), stations)
    return np.log(np.maximum([np.sqrt(np.mean(part**2)) for part in parts], 1e-12))
