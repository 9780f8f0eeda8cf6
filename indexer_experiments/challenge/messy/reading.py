"""What disturbances of base and sensor do to a reading: linear filters and additions, given acceleration and angle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Reader = Callable[[np.ndarray, np.ndarray, float], np.ndarray]
"""Reading y (n,), table angle φ (n,) [rad] and sampling rate [Hz] -> the reading as it is disturbed (n,)."""

_SHOCKS = 1.0 / 1.5
"""Shocks a second."""

_LONGEST = 600.0
"""s; shocks are drawn for so long, so that they do not depend on a record's length."""


def drifting(size: float) -> Reader:
    """y (1 + size (t/T - 1/2)) over a record of length T."""
    return lambda y, angle, rate: y * (1.0 + size * (np.arange(len(y)) / len(y) - 0.5))


def cabled(size: float, hertz: float, damping: float) -> Reader:
    """y + size s²/(s² + 2ζωs + ω²) y."""
    return lambda y, angle, rate: y + size * _resonated([1.0, 0.0, 0.0], hertz, damping, y, rate)


def tilted(size: float, hertz: float, damping: float, phase: float) -> Reader:
    """y + size ψ sin(φ + phase), ψ = ω²/(s² + 2ζωs + ω²) y."""

    def read(y: np.ndarray, angle: np.ndarray, rate: float) -> np.ndarray:
        rocking = _resonated([(2.0 * math.pi * hertz) ** 2], hertz, damping, y, rate)
        return y + size * rocking * np.sin(angle + phase)

    return read


def shocked(size: float, hertz: float, damping: float, rng: np.random.Generator) -> Reader:
    """y + Σ_j ± size e^{-ζωx} sin ωx, x = t - t_j >= 0, at random times t_j [s] and signs drawn here."""
    times = np.cumsum(rng.exponential(1.0 / _SHOCKS, round(_LONGEST * _SHOCKS)))
    signs = rng.choice([-1.0, 1.0], len(times))
    omega = 2.0 * math.pi * hertz
    rung = math.log(1e6) / (damping * omega)

    def read(y: np.ndarray, angle: np.ndarray, rate: float) -> np.ndarray:
        out = y.copy()
        for begin, sign in zip(times[times < len(y) / rate], signs, strict=False):
            first = math.ceil(begin * rate)
            x = np.arange(first, min(len(y), first + round(rung * rate))) / rate - begin
            out[first : first + len(x)] += sign * size * np.exp(-damping * omega * x) * np.sin(omega * x)
        return out

    return read


def _resonated(numerator: list[float], hertz: float, damping: float, y: np.ndarray, rate: float) -> np.ndarray:
    """A resonator at rest before the record, driven by the straight lines between its samples."""
    from scipy.signal import cont2discrete, lfilter

    omega = 2.0 * math.pi * hertz
    found: Any = cont2discrete((numerator, [1.0, 2.0 * damping * omega, omega**2]), 1.0 / rate, "foh")
    return np.asarray(lfilter(np.ravel(found[0]), found[1], y))
