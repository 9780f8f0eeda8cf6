"""A history of sizes and a limit -> remaining time with its interval.

Wear feeds on what it has worn: dg/dt = a + b g, whose solution is g(t) = A + B (e^(c t) - 1)/c, linear in A and B for
a given c (c = 0: a straight line). For each c of an even grid the least squares over the history give the posterior
of A, B and the scatter in closed form (normal-inverse-gamma with a flat prior; Gelman et al., Bayesian Data Analysis,
section 14.2). Neighbouring errors are alike, since the diagnosis errs with the size: with their correlation ρ, n
points tell as much as n (1 - ρ)/(1 + ρ). Each c is weighted by its evidence, each draw of A and B by the prior of the
ratio r = (rate at the limit) / (rate at the first record), log-uniform from 1 to FASTEST; a draw that does not grow
is left out. The machine's own error of the diagnosis, the same in all of its turns, is drawn too: it shifts the level
that is seen at the limit. The time at which a draw reaches the limit has a closed form, and the quantiles of these
times are the answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FASTEST = 12.0
"""Largest ratio of the wear rate at the limit to that at the first record: teeth with room hit each other, yet a part
that wears ten times faster than when new is no longer in its life."""

LEAST_POINTS = 8
"""Points of a history below which nothing is extrapolated."""

MOST_ALIKE = 0.8
"""Largest correlation of neighbouring errors that is reckoned with: beyond, a history says next to nothing."""

FARTHEST = 30.0
"""Told is no time longer than this many times the history: beyond, the answer is "longer than"."""

_CURVES = 30
_DRAWS = 80
_Z90 = 1.645


@dataclass(frozen=True)
class Remaining:
    """Time until a quantity reaches its limit [s]: median and the ends of the 90 % interval; an end that is infinite
    lies beyond FARTHEST histories."""

    median: float
    low: float
    high: float


def remaining_time(history: np.ndarray, limit: float, now: float) -> Remaining | None:
    """When the limit will be reached.

    Parameters
    ----------
    history : numpy.ndarray, shape (n, 4)
        Time [s], value and the ends of its 90 % interval.
    limit : float
        Of the quantity, in its unit.
    now : float
        Time from which the rest counts [s].

    Returns
    -------
    Remaining or None
        None where the history is too short or shows no growth in half of the draws.
    """
    if len(history) < LEAST_POINTS:
        return None
    time, value = history[:, 0], history[:, 1]
    span = float(time[-1] - time[0])
    if span <= 0.0:
        return None
    told = (time - time[0]) / span
    # As if all of a reading's error were shared by the turns of a machine: the careful end.
    shared = np.median(history[-LEAST_POINTS:, 3] - history[-LEAST_POINTS:, 2]) / (2.0 * _Z90)
    rng = np.random.default_rng(0)
    fits = [_Fit.of(told, value, curve) for curve in np.linspace(0.0, np.log(FASTEST), _CURVES)]
    alike = min(fits, key=lambda fit: fit.squares).alike
    fewer = (1.0 - alike) / (1.0 + alike)
    times, logs = [], []
    for fit in fits:
        curve, (start, rate) = fit.curve, fit.draws(fewer, rng)
        log_evidence = fit.log_evidence(fewer)
        goal = limit - start + shared * rng.standard_normal(_DRAWS)
        with np.errstate(all="ignore"):
            ratio = 1.0 + curve * goal / rate
            reach = goal / rate if curve == 0.0 else np.log(ratio) / curve
            # Uniform in log r: its density over c is d(log r)/dc.
            prior = np.where((rate > 0.0) & (ratio <= FASTEST) & (ratio >= 1.0), goal / (rate * ratio), 0.0)
        # A goal behind us is reached already, whatever the ratio.
        past = (rate > 0.0) & (goal <= 0.0)
        times.append(np.where(past, 0.0, np.where(prior > 0.0, reach, np.inf)))
        logs.append(log_evidence + np.log(np.maximum(np.where(past, 1.0, prior), 1e-300)))
    return _quantiles(np.concatenate(times), np.concatenate(logs), span, now - float(time[0]))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Least squares for one curve: best A and B, the inverse normal matrix, the sum of squares that is left, the
    correlation of neighbouring errors, and the points less two."""

    curve: float
    best: np.ndarray
    inverse: np.ndarray
    squares: float
    alike: float
    freedom: int

    @classmethod
    def of(cls, told: np.ndarray, value: np.ndarray, curve: float) -> _Fit:
        shape = told if curve == 0.0 else np.expm1(curve * told) / curve
        design = np.stack([np.ones_like(told), shape], axis=1)
        inverse = np.linalg.inv(design.T @ design)
        best = inverse @ design.T @ value
        missed = value - design @ best
        # The floor keeps a noiseless history from a posterior without width.
        squares = float(np.sum(missed**2)) + 1e-12 * float(np.sum(value**2)) + 1e-300
        alike = float(np.clip(np.sum(missed[1:] * missed[:-1]) / squares, 0.0, MOST_ALIKE))
        return cls(float(curve), best, inverse, squares, alike, len(value) - 2)

    def draws(self, fewer: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Draws (n,) of A and of B where so large a share of the points counts."""
        variance = self.squares / fewer / rng.chisquare(self.freedom, _DRAWS)
        noise = rng.standard_normal((_DRAWS, 2)) @ np.linalg.cholesky(self.inverse).T
        drawn = self.best + np.sqrt(variance)[:, None] * noise
        return drawn[:, 0], drawn[:, 1]

    def log_evidence(self, fewer: float) -> float:
        """Log of the evidence for the curve, up to a constant."""
        return float(-0.5 * fewer * self.freedom * np.log(self.squares) + 0.5 * np.log(np.linalg.det(self.inverse)))


def _quantiles(times: np.ndarray, logs: np.ndarray, span: float, passed: float) -> Remaining | None:
    weight = np.exp(logs - logs.max())
    order = np.argsort(times)
    share = np.cumsum(weight[order]) / weight.sum()
    found = [float(times[order][min(np.searchsorted(share, part), len(times) - 1)]) for part in (0.5, 0.05, 0.95)]
    median, low, high = (max(0.0, end * span - passed) if end <= FARTHEST else np.inf for end in found)
    return None if np.isinf(median) and np.isinf(low) else Remaining(median, low, high)
