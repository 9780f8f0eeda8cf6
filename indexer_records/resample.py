"""A record limited to the band that the wanted rate can hold, to be read at any time within it.

In two steps, so that any ratio of rates and any start is exact: a polyphase filter takes out what would fold down and
leaves a rate near OVERSAMPLING times the wanted one; a spline of degree 5 then reads that between its samples.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline
from scipy.signal import firwin, kaiserord, oaconvolve, resample_poly

from indexer_env.errors import SignalError
from indexer_records.measured import same_rate

PASSBAND = 0.4
STOPBAND = 0.5
"""Edges of the anti-alias filter over the lower of both rates: flat up to the first, nothing from the second on."""

CUTOFF = 0.5 * (PASSBAND + STOPBAND)
"""Half-amplitude frequency of the filter over the lower of both rates."""

ATTENUATION = 100.0
"""Of the stop band [dB], and the depth of the ripple in the pass band: below the noise of a 16-bit logger, 98 dB."""

OVERSAMPLING = 4
"""Samples for the spline over those wanted: its error, about 2 (f / rate)^6, is then below the filter's."""

MOST_UPSAMPLING = 1.1
"""Largest ratio of the wanted rate to the file's: above half its own rate a file holds nothing, and a record with an
empty band there would show its logger instead of its machine."""

REACH = 48
"""Samples at the lower of both rates that a stretch depends on at each side of it: half the filter's length, 32, and
what the spline's ends need to fade out."""

_LARGEST_FACTOR = 64
"""Of the polyphase filter upwards; an odd ratio is met nearly by the filter and exactly by the spline."""


def resampled(
    values: np.ndarray, rate: float, target: float, starts: np.ndarray, steps: np.ndarray, samples: int
) -> np.ndarray:
    """Stretches of a record, each on an even grid of its own.

    A component up to PASSBAND times the lower of both rates passes; one from STOPBAND times on is taken out by
    ATTENUATION. A stretch whose step is another than that of `target` has a filter of its own rate, by which nothing
    folds down in a long turn and the same orders pass in all turns. Near the ends of the file, half the filter's
    length, about 32 samples at the target rate, the record is continued by the straight line through its first and last
    sample. Where all stretches lie on the grid of a file that has the target rate, but for its clock
    (`measured.same_rate`), its own samples are given, untouched.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
    rate, target : float
        Rate of the file and rate whose band the stretches may hold [Hz].
    starts, steps : numpy.ndarray, shape (stretches,)
        First sample and sampling step of each stretch [s], the former after the record's first sample.
    samples : int
        Of each stretch.

    Returns
    -------
    numpy.ndarray, shape (stretches, samples)

    Raises
    ------
    SignalError
        `target` is more than MOST_UPSAMPLING times `rate`.
    """
    check_ratio(rate, target)
    if on_grid(rate, target, starts, steps, samples) and samples <= len(values):
        # by a slow clock the last stretch may end some samples behind the file
        first = np.minimum(np.round(starts * rate).astype(int), len(values) - samples)
        return values[first[:, None] + np.arange(samples)]
    places = np.arange(samples)
    if (steps == 1.0 / target).all():
        return _curve(values, rate, target)(starts[:, None] + steps[:, None] * places)
    found = np.empty((len(starts), samples))
    for stretch, (start, step) in enumerate(zip(starts, steps, strict=True)):
        margin = math.ceil(REACH * max(1.0, rate * step))
        first, last = max(0, math.floor(start * rate) - margin), math.ceil((start + samples * step) * rate) + margin
        found[stretch] = _curve(values[first:last], rate, 1.0 / step)(start - first / rate + step * places)
    return found


def on_grid(rate: float, target: float, starts: np.ndarray, steps: np.ndarray, samples: int) -> bool:
    """Whether the samples of all stretches are samples of the record itself, as in `resampled`; the same for files
    whose clocks alone differ."""
    first, end = starts * target, (starts + samples * steps) * target
    return same_rate(rate, target) and _whole(first) and _whole(end) and bool((np.round(end - first) == samples).all())


def entire(values: np.ndarray, rate: float, target: float) -> np.ndarray:
    """A whole record (n,) at another rate, from its first sample on; as in `resampled`."""
    count = math.floor(len(values) * target / rate + 1e-9)
    return resampled(values, rate, target, np.zeros(1), np.array([1.0 / target]), count)[0]


def check_ratio(rate: float, target: float) -> None:
    """Refuse to make samples that the file does not have."""
    if target > MOST_UPSAMPLING * rate:
        raise SignalError(
            f"sample_rate must be at most {MOST_UPSAMPLING:g} times the rate of the file, got {target:g} Hz for a file "
            f"of {rate:g} Hz; the file holds nothing above {rate / 2:g} Hz, ask for sample_rate={rate:g}."
        )


def factors(rate: float, target: float) -> tuple[int, int]:
    """Factors up and down of the polyphase filter, so that rate·up/down is near OVERSAMPLING·target."""
    ratio = Fraction(rate / (OVERSAMPLING * target)).limit_denominator(_LARGEST_FACTOR)
    return ratio.denominator, ratio.numerator


def _curve(values: np.ndarray, rate: float, target: float) -> BSpline:
    up, down = factors(rate, target)
    lower, fine = min(rate, target), rate * up
    width = (STOPBAND - PASSBAND) * lower
    taps, beta = kaiserord(ATTENUATION, width / (0.5 * fine))
    # An odd number of taps delays by whole samples, which the polyphase filter takes back.
    window = firwin(taps | 1, CUTOFF * lower, window=("kaiser", beta), fs=fine)  # pyright: ignore[reportArgumentType]
    if up == down:
        # where there is nothing to resample, resample_poly leaves the filter out
        line = np.linspace(values[0], values[-1], len(values))
        limited = line + oaconvolve(values - line, window, mode="full")[len(window) // 2 :][: len(values)]
    else:
        limited = resample_poly(values, up, down, window=window, padtype="line")
    times = np.arange(len(limited)) * (down / fine)
    return make_interp_spline(times, limited, k=5)


def _whole(positions: np.ndarray) -> bool:
    return bool((np.abs(positions - np.round(positions)) < doubt(positions)).all())


def doubt(position: Any) -> Any:
    """By how much a position that is the product of a time and a rate [samples] may be off: a millionth of a sample,
    and after days of them the rounding of the product."""
    return np.maximum(1e-6, 8.0 * np.finfo(np.float64).eps * position)
