"""The size and the colour of measuring noise, read where a machine is quiet.

Noise is taken for a first-order autoregression, e_k = ρ e_{k-1} + w_k with w white, by the likelihood of its spectrum
(Whittle, J. Roy. Stat. Soc. B 15 (1953) 125): of short pieces, whose lower quartile is that of the dwells, at high
frequencies, where machines do little, and without the lines that stand there. What ρ says of the frequencies below is
all that is known of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

_PIECE, _SHORTEST = 0.2, 32
"""Length of a piece: so many seconds, short enough for a dwell, or samples, if that is longer."""

_OVERLAP = 4
"""Pieces begin so often in one's length: whatever the speed, some lie within a dwell."""

_LEAST_PIECES = 4
"""Pieces below which a quartile says nothing."""

_QUARTILE = 0.25
"""Of the pieces' spectra: the quietest ones show the noise."""

_FROM_HZ = 50.0
"""Below it lies what machines do; or half of the spectrum, where that is more."""

_LINE, _ROUNDS = 3.0, 8
"""Power over that of the noise at which a frequency is left out as a line, and rounds in which lines are found."""

_COLOURS = np.linspace(0.0, 0.98, 50)
"""Coefficients that are compared."""

_EVEN = 4096
"""Even steps of the frequency in which a spectrum is integrated."""

_BINOMIAL_4 = math.sqrt(70.0)
"""Gain of the fourth difference for white noise: the root of 1 + 16 + 36 + 16 + 1."""

LEAST = 1e-3
"""Least noise over a record's standard deviation: what is simulated without a sensor's noise has none, and no model is
true to a thousandth."""

_MAD = 0.6745
"""Median absolute value of a standard normal."""


def noise_of(values: np.ndarray, rate: float) -> tuple[float, float]:
    """Standard deviation of a record's noise [its unit], and ρ at its sampling rate [Hz]."""
    return shared_noise([values], rate)


def shared_noise(records: Sequence[np.ndarray], rate: float) -> tuple[float, float]:
    """The same of records that one sensor took, by the quieter half of them: what a machine does in a record, hum and
    rattling say, looks like more noise and never like less."""
    if len(records) > 1:
        by_noise = sorted(records, key=lambda values: noise_of(values, rate)[0])
        records = by_noise[: math.ceil(0.5 * len(records))]
    pieces = _pieces([_level(values) for values in records], rate)
    pieces -= pieces.mean(axis=1, keepdims=True)
    found = _fitted(pieces, rate)
    least = LEAST * float(np.median([_level(values).std() for values in records]))
    if found is None or not found[1] > 0.0:
        return max(float(np.median([white_noise(values) for values in records])), least), 0.0
    colour, variance = found
    # low frequencies are extrapolated, but no more noise is there than all that is read where the machine is quiet
    quiet = float(np.quantile(np.einsum("pn,pn->p", pieces, pieces), _QUARTILE)) / pieces.shape[1]
    return max(math.sqrt(min(variance / (1.0 - colour**2), max(quiet, variance))), least), colour


def _level(values: np.ndarray) -> np.ndarray:
    """A record without its slope: a drift of the sensor's offset is no noise."""
    rise = np.linspace(-1.0, 1.0, len(values))
    return values - float(values @ rise) / float(rise @ rise) * rise


def limited_noise(spread: float, colour: float, rate: float, limit: float, target: float) -> tuple[float, float]:
    """Standard deviation and correlation from sample to sample of noise of a rate [Hz] once nothing above `limit` [Hz]
    is left of it and it is read at the `target` rate [Hz]."""
    frequencies = np.linspace(0.0, 0.5 * rate, _EVEN + 1)
    turn = np.cos(2.0 * math.pi * frequencies / rate)
    power = (1.0 - colour**2) / (1.0 + colour**2 - 2.0 * colour * turn) * (frequencies <= limit)
    share = float(power.mean())
    correlation = float((power * np.cos(2.0 * math.pi * frequencies / target)).mean()) / share
    return spread * math.sqrt(share), correlation


def autoregression(rows: Sequence[np.ndarray], rate: float) -> tuple[float, float] | None:
    """ρ and the variance of w in rows (n,) of one sampling rate [Hz]; None where they hold too few pieces."""
    pieces = _pieces(rows, rate)
    return _fitted(pieces - pieces.mean(axis=1, keepdims=True), rate)


def _fitted(pieces: np.ndarray, rate: float) -> tuple[float, float] | None:
    """The same of pieces (p, n) without their means."""
    if len(pieces) < _LEAST_PIECES:
        return None
    length = pieces.shape[1]
    window = np.hanning(length)
    spectra = np.fft.rfft(pieces * window, axis=1)
    frequencies = np.fft.rfftfreq(length, 1.0 / rate)
    band = frequencies > min(_FROM_HZ, 0.25 * rate)
    # as an order statistic it is found five times as fast as between two of them
    rank = round(_QUARTILE * (len(pieces) - 1))
    power = np.partition(np.abs(spectra[:, band]) ** 2, rank, axis=0)[rank]
    turn = np.cos(2.0 * math.pi * frequencies[band] / rate)
    shapes = 1.0 / (1.0 + _COLOURS[:, None] ** 2 - 2.0 * _COLOURS[:, None] * turn)
    kept, best, levels = np.ones(len(power), dtype=bool), 0, np.zeros((len(shapes), 1))
    for _ in range(_ROUNDS):
        levels = np.maximum((power / shapes)[:, kept].mean(axis=1, keepdims=True), 1e-300)
        unlikely = np.log(levels * shapes) + power / (levels * shapes)
        best = int(unlikely[:, kept].sum(axis=1).argmin())
        # hum and other lines are no noise
        below = power < _LINE * levels[best] * shapes[best]
        if below.sum() < 0.5 * len(below) or bool((below == kept).all()):
            break
        kept = below
    # the quantile of an exponential law over its mean
    mean = -math.log(1.0 - _QUARTILE) * float((window**2).sum())
    return float(_COLOURS[best]), float(levels[best, 0]) / mean


def _pieces(rows: Sequence[np.ndarray], rate: float) -> np.ndarray:
    """Pieces (p, n) of rows (n,)."""
    length = max(_SHORTEST, round(_PIECE * rate))
    long = [row for row in rows if len(row) >= length]
    cut = [np.lib.stride_tricks.sliding_window_view(row, length)[:: length // _OVERLAP] for row in long]
    return np.concatenate(cut) if cut else np.zeros((0, length))


def white_noise(values: np.ndarray) -> float:
    """Standard deviation of the white part of a record [its unit], from its fourth differences, which a vibration far
    below the sampling rate hardly enters."""
    return float(np.median(np.abs(np.diff(values, 4)))) / (_MAD * _BINOMIAL_4)
