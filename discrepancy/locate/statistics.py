"""What is computed of residuals: the level of each cell and how far each line stands out.

The level of a cell is the rms of its residuals over its windows, the worst window left out where three or more hold it:
a start state that the fit has missed spoils one window, an effect shows again in the next ones.
A line's prominence is the least over the records, and over their channels, of its power over that of its surroundings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.fft import next_fast_len, rfft

from discrepancy.subjects.base import Axis, View

_LEAST_WINDOWS = 3
"""Windows that hold a cell from which on the worst one is left out."""

_AROUND = (2.0, 12.0)
"""Nearest and farthest distance of a line's surroundings, in widths 1/T of its record's length T."""

_PADDING = 4
"""Zeros are added up to this many times the record's length or more: a line lies an eighth of a width off at most."""

CHANNEL = "channel"
"""The axis of records with several channels, which are sampled at the same times."""

_LEAST_WIDTHS = 3.0
"""Widths above zero below which a line cannot be told from a constant, and below half the sampling rate above which
it cannot be told from its alias."""


class Levels:
    """Levels of the cells of several axes. Samples side by side that no axis tells apart are summed once for all.

    Parameters
    ----------
    axes : sequence of Axis
    """

    def __init__(self, axes: Sequence[Axis]) -> None:
        changes = np.zeros(axes[0].cells.shape, dtype=bool)
        changes[:, 0] = True
        for axis in axes:
            changes[:, 1:] |= axis.cells[:, 1:] != axis.cells[:, :-1]
        self._runs = np.flatnonzero(changes)
        lengths = np.diff(self._runs, append=changes.size)
        self._axes = [_Cells(axis, self._runs, lengths) for axis in axes]

    def of(self, residual: np.ndarray) -> np.ndarray:
        """Level of each cell (d, k) of all axes, of several residuals (d, w, n); NaN for one without a sample."""
        sums = np.add.reduceat(residual.reshape(len(residual), -1) ** 2, self._runs, axis=1)
        return np.concatenate([axis.levels(sums) for axis in self._axes], axis=1)


class _Cells:
    """The cells of one axis: of runs of samples, their first ones and lengths (runs,) over all windows end to end."""

    def __init__(self, axis: Axis, runs: np.ndarray, lengths: np.ndarray) -> None:
        self._shape = shape = (len(axis.cells), len(axis.labels))
        cells = axis.cells.ravel()[runs]
        self._mine = np.flatnonzero(cells >= 0)
        self._at = (runs // axis.cells.shape[1] * shape[1] + cells)[self._mine]
        held = np.bincount(self._at, lengths[self._mine], minlength=shape[0] * shape[1]).reshape(shape)
        self._per_sample = np.where(held > 0.0, 1.0 / np.maximum(held, 1.0), 0.0)
        self._spared = ((held > 0.0).sum(axis=0) >= _LEAST_WINDOWS).astype(float)
        self._held, self._samples = held, held.sum(axis=0)

    def levels(self, sums: np.ndarray) -> np.ndarray:
        """Level of each cell (d, k) given the sum of squares of each run (d, runs)."""
        count, size = len(sums), self._held.size
        at = np.arange(count)[:, None] * size + self._at
        squares = np.bincount(at.ravel(), sums[:, self._mine].ravel(), minlength=count * size)
        squares = squares.reshape(count, *self._shape)
        worst = (squares * self._per_sample).argmax(axis=1)
        most = np.take_along_axis(squares, worst[:, None], axis=1)[:, 0]
        total = squares.sum(axis=1) - self._spared * most
        samples = self._samples - self._spared * self._held[worst, np.arange(self._shape[1])]
        return np.sqrt(np.where(samples > 0.0, total / np.maximum(samples, 1.0), math.nan))


class Prominence:
    """How far lines stand out of residuals.

    Parameters
    ----------
    view : View
        With lines; those too slow or too fast for its records are left out.
    """

    def __init__(self, view: View) -> None:
        self._spectra = [(number, _Spectrum(view, part)) for number, part in parts_of(view)]
        every = [spectrum for _, spectrum in self._spectra]
        slowest = max((_LEAST_WIDTHS / one.span for one in every), default=0.0)
        fastest = min((0.5 / one.step - _LEAST_WIDTHS / one.span for one in every), default=math.inf)
        self.lines = tuple(
            line for line in view.lines if line.frequency.min() > slowest and line.frequency.max() < fastest
        )

    def of(self, residual: np.ndarray) -> np.ndarray:
        """Prominence of each line (d, k) in several residuals (d, w, n): 1 is that of noise on average."""
        if not self.lines:
            return np.zeros((len(residual), 0))
        found = []
        for number, spectrum in self._spectra:
            frequencies = np.array([line.frequency[number] for line in self.lines])
            found.append(spectrum.prominence(residual, frequencies))
        return np.min(found, axis=0)


def parts_of(view: View) -> list[tuple[int, np.ndarray]]:
    """Each record's number with the samples (w, n) of it, channel by channel where it has several."""
    parts = [(number, (view.groups == number)[:, None] & view.inside) for number in range(len(view.noise))]
    channels = next((axis for axis in view.axes if axis.name == CHANNEL), None)
    if channels is None:
        return parts
    return [(number, part & (channels.cells == k)) for number, part in parts for k in range(len(channels.labels))]


class _Spectrum:
    """Hann-windowed spectrum of the residuals of a part (w, n) of the samples, its windows put end to end."""

    def __init__(self, view: View, part: np.ndarray) -> None:
        self._part, time = np.flatnonzero(part), view.time[part]
        self.span = float(np.ptp(time))
        self.step = float(np.median(np.diff(np.sort(time))))
        self._at = np.rint((time - time.min()) / self.step).astype(int)
        self._count = int(self._at.max()) + 1
        # even, so that the spectrum ends at half the rate
        half = next_fast_len(_PADDING * self._count // 2, real=True)
        assert half is not None
        self._padded = 2 * half
        self._per_width = self._padded / self._count
        self._per_hertz = self._padded * self.step
        self._hann = np.sin(math.pi * np.arange(self._count) / self._count) ** 2
        self._hann /= math.sqrt(float((self._hann**2).sum()))

    def prominence(self, residual: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
        """Power (d, k) of several residuals (d, w, n) at frequencies (k,) [Hz] over that of their surroundings, or of
        white noise where that is more."""
        rows = np.zeros((len(residual), self._count))
        rows[:, self._at] = residual.reshape(len(residual), -1)[:, self._part]
        power = np.abs(np.asarray(rfft(self._hann * rows, self._padded))) ** 2
        distances = np.arange(_AROUND[0], _AROUND[1] + 0.5)
        shifts = np.concatenate([[0.0], -distances, distances]) * self._per_width
        bins = np.rint(frequencies[:, None] * self._per_hertz + shifts).astype(int)
        # Below zero and above half the rate the spectrum is its own mirror image.
        bins = np.abs(bins)
        bins = np.minimum(bins, 2 * (power.shape[1] - 1) - bins)
        values = power[:, bins]
        # The median of an exponential law is ln 2 times its mean.
        around = np.median(values[:, :, 1:], axis=2) / math.log(2.0)
        return values[:, :, 0] / np.maximum(around, 1.0)
