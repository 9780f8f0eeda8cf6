"""The three filters of the sensor chain as second-order sections (scipy.signal's "sos"), and their start.

scipy.signal is imported where it is used: it takes about half a second, which a start without filters
need not wait.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from indexer_env.errors import refuse

BRACKET_LIMIT = 0.45
"""Highest bracket frequency over the sample rate [-]; nearer to 0.5 the samples no longer fix its phase."""

LOWEST = 1e-6
"""Lowest frequency of a filter over the sample rate [-]; below it rounding changes even what is constant by more than
1e-5."""


def lowpass_sections(cutoff_hz: float, order: int, rate: float) -> np.ndarray:
    """Butterworth low-pass, shape (ceil(order / 2), 6); bilinear transform, pre-warped to `cutoff_hz` [Hz].

        |H(f)|² = 1 / (1 + (w(f) / w(fc))^(2 order)),   w(f) = tan(π f / rate)

    Exactly -3.01 dB at fc. The analogue filter has w = f: towards half the rate [Hz] this one is steeper, and
    its delay is shorter by the factor (π fc / rate) / tan(π fc / rate), 0.86 at fc = rate / 5; the two agree
    as fc / rate → 0, that is when the acceleration comes at a higher rate than the record's.
    """
    return _butterworth("lowpass", cutoff_hz, order, rate).copy()


def highpass_sections(cutoff_hz: float, rate: float) -> np.ndarray:
    """AC coupling, shape (1, 6): a first-order high-pass, H(s) = s / (s + 2π fc), by the bilinear transform, pre-warped
    to its -3.01 dB frequency `cutoff_hz` [Hz], below half the rate [Hz]."""
    return _butterworth("highpass", cutoff_hz, 1, rate).copy()


# Its design takes longer than the filtering of a record, and many records are read by one sensor.
@functools.lru_cache(maxsize=64)
def _butterworth(kind: str, cutoff_hz: float, order: int, rate: float) -> np.ndarray:
    import scipy.signal

    return np.asarray(scipy.signal.butter(order, cutoff_hz, btype=kind, output="sos", fs=rate))


def bracket_sections(frequency_hz: float, damping: float, rate: float) -> np.ndarray:
    """Mounting bracket, shape (1, 6): transmissibility of a mass on a spring and damper.

        H(s) = (2 ζ ω s + ω²) / (s² + 2 ζ ω s + ω²),   H(0) = 1,   |H(jω)| = √(1 + 4 ζ²) / (2 ζ)

    Input is the acceleration of the table, output that of the mass, where the accelerometer sits.
    frequency_hz = ω / 2π [Hz] below BRACKET_LIMIT of the rate [Hz], damping = ζ [-], 0 < ζ < 1.

    Poles are mapped by z = exp(s / rate), so that the ringing has its true frequency and decay; the three
    numerator coefficients make H exact at 0 Hz and, in amplitude and phase, at ω. What is left of an
    error at ζ = 0.02 and 1 kHz: below 100 Hz 0.1 % for a bracket of 100 Hz, 0.4 % for 200 Hz, 1.6 % for
    350 Hz; up to 1.25 ω in amplitude 0.1 %, 1.2 % and 24 %. It grows with ζ and falls with the rate.

    Why not a ready-made transform: at 1 kHz the bilinear one is 6 % off below 100 Hz and narrows the peak
    of a 320 Hz bracket by half; a first-order hold keeps the poles but takes a third off that peak (it
    joins the samples by straight lines); a zero-order hold delays by half a sample.
    """
    w = 2.0 * math.pi * frequency_hz / rate
    pole = np.exp((-damping + 1j * math.sqrt(1.0 - damping**2)) * w)
    a1, a2 = -2.0 * pole.real, abs(pole) ** 2
    # B(z⁻¹) = A(1) + (1 - z⁻¹)(c0 + c1 z⁻¹) is right at 0 Hz whatever c0 and c1 are: they settle H(jω).
    at_zero = 1.0 + a1 + a2
    delay = np.exp(-1j * w)
    at_peak = (1.0 + a1 * delay + a2 * delay**2) * (1.0 + 2j * damping) / (2j * damping)
    q = (at_peak - at_zero) / (1.0 - delay)
    c1 = -q.imag / math.sin(w)
    c0 = q.real - c1 * math.cos(w)
    return np.array([[at_zero + c0, c1 - c0, -c1, 1.0, a1, a2]])


def check_lowest(rate: float, **frequencies: float | None) -> None:
    """Refuse frequencies [Hz] of a sensor's filters, by their names, that are lower than LOWEST of the rate [Hz]."""
    for name, frequency in frequencies.items():
        if frequency is not None and frequency < LOWEST * rate:
            rule = f">= {LOWEST * rate:g} Hz ({LOWEST:g} of the {rate:g} Hz that it reads at)"
            raise refuse("Sensor", name, rule, frequency, "raise it or leave it out (null) to switch it off")


def filtered(sections: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Filter each row of (rows, n) causally, as if its first sample had lasted for ever before."""
    import scipy.signal

    state = scipy.signal.sosfilt_zi(sections)[:, np.newaxis, :] * rows[np.newaxis, :, :1]
    result, _ = scipy.signal.sosfilt(sections, rows, axis=-1, zi=state)
    return result
