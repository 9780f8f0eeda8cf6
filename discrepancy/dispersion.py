"""How much less a residual tells than white noise of the stated size would: its size and its correlation."""

from __future__ import annotations

import math

import numpy as np

from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.problem import Problem


def dispersion_of(model: Model, place: Point) -> float:
    """D: the windows' median mean square, at least 1, times the autocorrelation time of the residuals in samples."""
    residual = Problem(model, place.hypothesis).left(place)
    return place.dispersion(model) * autocorrelation_time(residual, model.counts)


def autocorrelation_time(residual: np.ndarray, counts: np.ndarray) -> float:
    """1 + 2 Σ_k ρ_k of rows (w, n) that are `counts` (w,) long, up to the first k at which ρ_k is within chance of 0:
    so many samples tell as much as one of white noise (Sokal, in Functional Integration, 1997, section 3)."""
    n = residual.shape[1]
    power = np.abs(np.fft.rfft(residual, 2 * n, axis=1)) ** 2
    covariance = np.fft.irfft(power.sum(axis=0), 2 * n)[: n // 2]
    correlation = covariance / max(covariance[0], 1e-300)
    chance = 2.0 / math.sqrt(float(counts.sum()))
    below = np.flatnonzero(correlation < chance)
    return 1.0 + 2.0 * float(correlation[1 : below[0] if len(below) else len(correlation)].sum())
