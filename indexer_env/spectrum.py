"""Spectra of records, as the wrappers and the diagnosis task observe them."""

from __future__ import annotations

import numpy as np


def density(records: np.ndarray, sample_rate: float, lines: int) -> np.ndarray:
    """One-sided power spectral densities (..., lines) [unit²/Hz] at 0, 1, ... Hz of records (..., n) in unit.

    Welch's method with Hann windows of 1 s, half overlapping, each without its mean; the rate [Hz] is a whole number
    and n >= sample_rate.
    """
    import scipy.signal

    return scipy.signal.welch(records, sample_rate, nperseg=int(sample_rate), detrend="constant")[1][..., :lines]


def level(densities: np.ndarray, bounds: tuple[float, float]) -> np.ndarray:
    """10 log10(P / 1 unit²/Hz) [dB], clipped to its bounds."""
    floor = 10.0 ** (bounds[0] / 10.0)
    return np.clip(10.0 * np.log10(np.maximum(densities, floor)), *bounds)
