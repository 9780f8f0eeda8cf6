"""Differentiation, low-pass and noise of a drive's channels: one choice for all of them.

Every channel is convolved with one symmetric kernel h, a Gaussian cut off at five standard deviations, and rates are
convolutions with its derivatives:

    x̂ = h * x,   d x̂/dt = h' * x,   d² x̂/dt² = h'' * x,   h(t) ∝ exp(-t²/(2 s²)),   s = √(ln 2)/(2π f_c)

f_c [Hz] is where h is down by 3 dB. As all channels pass the same h, a linear equation between them stays exact,
whatever f_c is; h is symmetric, so nothing is delayed. White noise of density S [unit²/Hz] leaves S ∫ |H(f)|² df in x̂
and S ∫ (2π f)^(2n) |H(f)|² df in its n-th derivative (integrals from 0 to ∞), which is how noise is carried along.
Equations that are not linear see the motion through a wide h and are then compared through one of half its band, the
parallel filtering usual in robot identification (Gautier, Proc. IEEE ICRA 1997, p. 3274).
"""

from __future__ import annotations

import math

import numpy as np

WIDEST = 0.15
"""Highest f_c over the sampling rate: the kernel then has 0.9 samples a standard deviation, and its second derivative
is right to 0.1 % up to f_c."""

_REACH = 5.0
_NOISY = 0.1
"""Noise of a derivative over its rms above which the cut-off is lowered."""

_TOP = 0.5
"""Share of the band, its upper end, in which a position that is sampled faster than it moves shows its noise alone."""

_PARTS = 4

_SHORTEST, _PERIODS, _QUIET = 32, 6.0, 0.25
"""Least samples of a piece, its periods of the band's lowest frequency, and the quantile of the pieces' spectra."""

_TAIL = 5.0
"""Cut-offs above which the kernel passes nothing."""

_LEAST_OF = 1.76
"""By how much the least of four medians of m bins each falls short of their mean, as a logarithm times √m: 1.03 for the
least of four normal numbers, 1/ln 2 for the spread of an exponential law's median, √1.4 for the bins that a Hann taper
joins."""


def deviation(cutoff: float) -> float:
    """Standard deviation s [s] of the kernel with this f_c [Hz]."""
    return math.sqrt(math.log(2.0)) / (2.0 * math.pi * cutoff)


def kernel(cutoff: float, rate: float, order: int = 0) -> np.ndarray:
    """Weights (2m + 1,) that take the n-th derivative of samples at a rate [Hz], exact on polynomials of degree n."""
    s = deviation(cutoff)
    m = max(2, math.ceil(_REACH * s * rate))
    t = np.arange(-m, m + 1) / rate
    g = np.exp(-0.5 * (t / s) ** 2)
    zeroth = g / g.sum()
    if order == 0:
        return zeroth
    if order == 1:
        first = -t * g
        # convolution turns the kernel round, so that it must give 1 on -t
        return first / (first @ -t)
    second = (t**2 - (zeroth @ t**2)) * g
    second = second - zeroth * second.sum()
    return second * 2.0 / (second @ t**2)


def smoothed(row: np.ndarray, cutoff: float, rate: float, order: int = 0) -> np.ndarray:
    """A row (n,) through the kernel; its ends, one margin each, hold nothing that may be used."""
    return np.convolve(row, kernel(cutoff, rate, order), mode="same")


def margin(cutoff: float, rate: float) -> int:
    """Samples at each end of a smoothed row that lack neighbours."""
    return max(2, math.ceil(_REACH * deviation(cutoff) * rate))


def passed_noise(density: float, cutoff: float, order: int = 0) -> float:
    """Standard deviation that white noise of one-sided density S [unit²/Hz] leaves in the n-th derivative.

    ∫₀^∞ (2π f)^(2n) exp(-(2π f s)²) df = Γ(n + ½)/(4π s^(2n + 1))
    """
    s = deviation(cutoff)
    return math.sqrt(density * math.gamma(order + 0.5) / (4.0 * math.pi * s ** (2 * order + 1)))


def falling_noise(density: float, at: float, cutoff: float, seconds: float) -> float:
    """Standard deviation that noise leaves whose density has this value at a frequency [Hz], and below it grows as 1/f
    down to a period of the record's length."""
    f = np.arange(1.0, max(2.0, _TAIL * cutoff * seconds)) / seconds
    passed = np.exp(-((2.0 * math.pi * f * deviation(cutoff)) ** 2))
    return math.sqrt(density * float((np.maximum(1.0, at / f) * passed).sum()) / seconds)


def quiet_density(row: np.ndarray, rate: float, low: float) -> float:
    """One-sided density [unit²/Hz] of a row in the octave above a frequency [Hz], by the lower quartile of short
    pieces: what a motion does there comes in bursts, as at reversals. 0 where there are too few pieces."""
    length = max(_SHORTEST, round(_PERIODS / low * rate))
    if len(row) < 2 * length:
        return 0.0
    pieces = np.lib.stride_tricks.sliding_window_view(np.diff(row, 2), length)[:: length // 4]
    taper = np.hanning(length)
    power = np.quantile(np.abs(np.fft.rfft(pieces * taper, axis=1)) ** 2, _QUIET, axis=0) / -math.log(1.0 - _QUIET)
    frequency = np.fft.rfftfreq(length, 1.0 / rate)
    octave = (frequency >= low) & (frequency <= 2.0 * low)
    gain = (2.0 * np.sin(math.pi * frequency[octave] / rate)) ** 4
    return float(np.median(2.0 * power[octave] / gain)) / (rate * float((taper**2).sum()))


def density(row: np.ndarray, rate: float, above: float) -> float:
    """One-sided density [unit²/Hz] of a row's noise above the motion's frequencies: the least of the medians of four
    parts of the band, as a motion's own spectrum falls over it.

    Second differences are taken before the spectrum and divided out after it, as the leakage of a slow large motion
    would else fill the upper band.
    """
    frequency, power = _whitened(row, rate)
    return _floor(power[frequency >= min(max(above, _TOP * 0.5 * rate), 0.4 * rate)])


def _floor(power: np.ndarray) -> float:
    """Mean of the noise in a spectrum; the median of an exponential law is ln 2 times its mean, and the least of
    several lies below them."""
    parts = [part for part in np.array_split(power, _PARTS) if len(part)]
    short = math.exp(_LEAST_OF * math.sqrt(_PARTS / max(len(power), 1)))
    return min((float(np.median(part)) for part in parts), default=0.0) * short / math.log(2.0)


def holding(row: np.ndarray, rate: float, share: float, order: int = 0) -> float:
    """Lowest frequency [Hz] below which a row, or its rate (order 1), has this share of its variance, the row's white
    noise left out."""
    frequency, held, _ = _held(row, rate, order)
    total = float(held.max())
    return float(frequency[int(np.argmax(held >= share * total))]) if total > 0.0 else 0.0


def _held(row: np.ndarray, rate: float, order: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Frequencies [Hz], the power of a row or of its differences (order 1) up to each of them, its white noise left
    out, and what to divide a power by for a mean square."""
    level = np.gradient(row) if order else row
    level, taper = level - level.mean(), np.hanning(len(row))
    power = np.abs(np.fft.rfft(level * taper)) ** 2
    frequency = np.fft.rfftfreq(len(row), 1.0 / rate)
    # what central differences make of white noise
    gain = np.sin(2.0 * math.pi * frequency / rate) ** 2 if order else np.ones_like(frequency)
    upper = (frequency >= _TOP * 0.5 * rate) & (gain > 0.1)
    held = np.cumsum(power - _floor(power[upper] / gain[upper]) * gain)
    return frequency, held, 0.5 * len(row) * float((taper**2).sum())


def strength(row: np.ndarray, rate: float, order: int = 0) -> float:
    """Standard deviation of a row, or of its rate (order 1), the row's white noise left out [unit, unit/s]."""
    _, held, size = _held(row, rate, order)
    return rate**order * math.sqrt(max(float(held.max()), 0.0) / size)


def quiet(row: np.ndarray, rate: float, cutoff: float, order: int) -> float:
    """A cut-off [Hz], lowered until the noise of a row's n-th derivative is a tenth of that, but not below a hundredth
    of the rate."""
    found = density(row, rate, cutoff)
    while cutoff > 0.01 * rate:
        strength = float(np.std(smoothed(row, cutoff, rate, order)[margin(cutoff, rate) : -margin(cutoff, rate)]))
        if passed_noise(found, cutoff, order) < _NOISY * strength:
            break
        cutoff *= 0.8
    return cutoff


def _whitened(row: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and one-sided density of a row, by way of its second differences."""
    n = len(row)
    taper = np.hanning(n - 2)
    spectrum = np.abs(np.fft.rfft(np.diff(row, 2) * taper)) ** 2
    frequency = np.fft.rfftfreq(n - 2, 1.0 / rate)
    power = 2.0 * spectrum / (rate * (taper**2).sum())
    gain = (2.0 * np.sin(math.pi * frequency / rate)) ** 4
    return frequency[1:], power[1:] / np.maximum(gain[1:], 1e-300)
