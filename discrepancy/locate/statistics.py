"""What is computed of residuals: the level of each cell and how far each line stands out.

The level of a cell is the rms of its residuals over its windows, the worst window left out where three or more hold it:
a start state that the fit has missed spoils one window, an effect shows again in the next ones.
A line's prominence is the least over the records of its power over that of its surroundings.
"""

from __future__ import annotations

import math

import numpy as np

from discrepancy.subjects.base import Axis, Line, View

_LEAST_WINDOWS = 3
"""Windows that hold a cell from which on the worst one is left out."""

_AROUND = (2.0, 12.0)
"""Nearest and farthest distance of a line's surroundings, in widths 1/T of its record's length T."""

_LEAST_WIDTHS = 3.0
"""Widths above zero below which a line cannot be told from a constant."""


def levels(residual: np.ndarray, axis: Axis) -> np.ndarray:
    """Level of each cell (k,), NaN for one without a sample."""
    count = len(axis.labels)
    windows, samples = np.nonzero(axis.cells >= 0)
    at = windows * count + axis.cells[windows, samples]
    shape = (len(residual), count)
    held = np.bincount(at, minlength=shape[0] * count).reshape(shape)
    sums = np.bincount(at, residual[windows, samples] ** 2, minlength=shape[0] * count).reshape(shape)
    mean = np.where(held > 0, sums / np.maximum(held, 1), -1.0)
    worst = mean.argmax(axis=0)
    spared = (held > 0).sum(axis=0) >= _LEAST_WINDOWS
    cells = np.arange(count)
    total = sums.sum(axis=0) - np.where(spared, sums[worst, cells], 0.0)
    samples_left = held.sum(axis=0) - np.where(spared, held[worst, cells], 0)
    return np.sqrt(np.where(samples_left > 0, total / np.maximum(samples_left, 1), math.nan))


class Prominence:
    """How far lines stand out of residuals.

    Parameters
    ----------
    view : View
        With lines; those too slow for its records are left out.
    """

    def __init__(self, view: View) -> None:
        self._parts = [(view.groups == g)[:, None] & view.inside for g in range(len(view.noise))]
        spans = [float(np.ptp(view.time[part])) for part in self._parts]
        slowest = max((_LEAST_WIDTHS / span for span in spans), default=0.0)
        self.lines = tuple(line for line in view.lines if line.frequency.min() > slowest)
        self._waves = [
            _waves(view.time[part], self.lines, g, span)
            for g, (part, span) in enumerate(zip(self._parts, spans, strict=True))
        ]

    def of(self, residual: np.ndarray) -> np.ndarray:
        """Prominence of each line (k,): 1 is that of noise on average."""
        if not self.lines:
            return np.zeros(0)
        found = []
        for part, waves in zip(self._parts, self._waves, strict=True):
            power = np.abs(waves @ residual[part]).reshape(len(self.lines), -1) ** 2
            # The median of an exponential law is ln 2 times its mean.
            around = np.median(power[:, 1:], axis=1) / math.log(2.0)
            found.append(power[:, 0] / np.maximum(around, 1.0))
        return np.min(found, axis=0)


def _waves(time: np.ndarray, lines: tuple[Line, ...], record: int, span: float) -> np.ndarray:
    """Rows (line and its surroundings, n) that give the normalised amplitude of a record's residuals there."""
    distances = np.arange(_AROUND[0], _AROUND[1] + 0.5)
    shifts = np.concatenate([[0.0], -distances, distances]) / span
    frequencies = np.array([[max(line.frequency[record] + s, 0.5 / span) for s in shifts] for line in lines]).ravel()
    window = np.sin(math.pi * (time - time.min()) / span) ** 2
    waves = window * np.exp(-2j * math.pi * np.outer(frequencies, time))
    return waves / math.sqrt(float((window**2).sum()))
