"""A history of sizes and a limit -> remaining time with its interval.

Wear feeds on what it has worn: dg/dt = a + b g, whose solution is g(t) = A + B (e^(c t) - 1)/c, linear in A and B for
a given c (c = 0: a straight line). Readings err in part alike: a diagnosis that reads one size too high reads its
neighbours too high as well, so the covariance of two readings is

    σ² (w δ_ij / n + (1 - w) e^(-|g_i - g_j| / l))      w = 1 - ALIKE, l = REACH times the limit, n turns in a point

with g from a parabola through the history. For each c of an even grid generalised least squares over the history give
the posterior of A, B and σ in closed form (normal-inverse-gamma with a flat prior; Gelman et al., Bayesian Data
Analysis, section 14.7). Each c is weighted by its evidence, each draw of A and B by the prior of the ratio r = (rate at
the limit) / (rate at the first record), log-uniform from 1 to FASTEST; a draw that does not grow is left out, and where
these are more than half of them by the evidence alone, nothing is told. The time at which a draw reaches the limit has
a closed form, and the quantiles of these times are the answer.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass

import numpy as np

FASTEST = 12.0
"""Largest ratio of the wear rate at the limit to that at the first record: teeth with room hit each other, yet a part
that wears ten times faster than when new is no longer in its life."""

LEAST_POINTS = 8
"""Points of a history below which nothing is extrapolated."""

ALIKE = 0.45
"""Share of a reading's variance that readings of a neighbouring size have in common [-], and"""

REACH = 0.25
"""distance in size over which it fades, as share of the limit [-]. Both as measured: over 100 machines of campaign=wear
the errors' correlation falls from 0.44 to a third of that at a quarter of the limit, and to nothing at half of it."""

FARTHEST = 30.0
"""Told is no time longer than this many times the history: beyond, the answer is "longer than"."""

_CURVES = 30
_DRAWS = 80


@dataclass(frozen=True)
class Remaining:
    """Running time until a quantity reaches its limit [s]: median and the ends of the 90 % interval; an end that is
    infinite lies beyond FARTHEST histories."""

    median: float
    low: float
    high: float


def remaining_time(history: np.ndarray, limit: float, now: float, turns: int = 1) -> Remaining | None:
    """When the limit will be reached.

    Parameters
    ----------
    history : numpy.ndarray, shape (n, 4)
        Running time [s], value and the ends of its 90 % interval.
    limit : float
        Of the quantity, in its unit.
    now : float
        Running time from which the rest counts [s].
    turns : int
        Of which each point is the mean.

    Returns
    -------
    Remaining or None
        None where the history is too short or shows no growth in half of the draws.
    """
    history = _in_time(history)
    if len(history) < LEAST_POINTS:
        return None
    time, value = history[:, 0], history[:, 1]
    span = float(time[-1] - time[0])
    if span <= 0.0:
        return None
    told = (time - time[0]) / span
    white = _whitening(told, value, limit, turns)
    seen, level = white @ value, white.sum(axis=1)
    rng = np.random.default_rng(0)
    times, logs, growing, evidence = [], [], [], []
    for curve in np.linspace(0.0, np.log(FASTEST), _CURVES):
        shape = told if curve == 0.0 else np.expm1(curve * told) / curve
        (start, rate), log_evidence = _draws(np.stack([level, white @ shape], axis=1), seen, rng)
        growing.append(np.mean(rate > 0.0))
        evidence.append(log_evidence)
        goal = limit - start
        with np.errstate(all="ignore"):
            ratio = 1.0 + curve * goal / rate
            reach = goal / rate if curve == 0.0 else np.log(ratio) / curve
            # Uniform in log r: its density over c is d(log r)/dc.
            prior = np.where((rate > 0.0) & (ratio <= FASTEST) & (ratio >= 1.0), goal / (rate * ratio), 0.0)
        # A goal behind us is reached already, whatever the ratio.
        past = (rate > 0.0) & (goal <= 0.0)
        times.append(np.where(past, 0.0, np.where(prior > 0.0, reach, np.inf)))
        logs.append(log_evidence + np.log(np.maximum(np.where(past, 1.0, prior), 1e-300)))
    if np.average(growing, weights=np.exp(np.array(evidence) - max(evidence))) < 0.5:
        return None
    return _quantiles(np.concatenate(times), np.concatenate(logs), span, now - float(time[0]))


def _in_time(history: np.ndarray) -> np.ndarray:
    """As many points as can be in the order of their times: others are of a clock that jumped and came back."""
    # by patience sorting: the least time at which a choice of so many points ends, and its last point
    ends: list[float] = []
    last: list[int] = []
    before: list[int] = []
    for k, time in enumerate(history[:, 0].tolist()):
        count = bisect.bisect_right(ends, time)
        before.append(last[count - 1] if count else -1)
        ends[count : count + 1], last[count : count + 1] = [time], [k]
    kept, k = [], last[-1] if last else -1
    while k >= 0:
        kept.append(k)
        k = before[k]
    return history[kept[::-1]]


def _whitening(told: np.ndarray, value: np.ndarray, limit: float, turns: int) -> np.ndarray:
    """Matrix (n, n) that makes the errors of the readings independent and alike."""
    # Distances of the readings themselves would be the larger the more these err.
    size = np.polyval(np.polyfit(told, value, 2), told)
    common = np.exp(-np.abs(size[:, None] - size[None, :]) / (REACH * limit))
    covariance = ALIKE * common + (1.0 - ALIKE) / turns * np.eye(len(value))
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _draws(design: np.ndarray, seen: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Draws (2, n) of A and B from their posterior, and the log of the evidence for the curve, up to a constant."""
    inverse = np.linalg.inv(design.T @ design)
    best = inverse @ design.T @ seen
    freedom = len(seen) - 2
    # The floor keeps a noiseless history from a posterior without width.
    squares = float(np.sum((seen - design @ best) ** 2)) + 1e-12 * float(np.sum(seen**2)) + 1e-300
    variance = squares / rng.chisquare(freedom, _DRAWS)
    noise = rng.standard_normal((_DRAWS, 2)) @ np.linalg.cholesky(inverse).T
    drawn = best + np.sqrt(variance)[:, None] * noise
    return drawn.T, float(-0.5 * freedom * np.log(squares) + 0.5 * np.log(np.linalg.det(inverse)))


def _quantiles(times: np.ndarray, logs: np.ndarray, span: float, passed: float) -> Remaining | None:
    weight = np.exp(logs - logs.max())
    order = np.argsort(times)
    share = np.cumsum(weight[order]) / weight.sum()
    found = [float(times[order][min(np.searchsorted(share, part), len(times) - 1)]) for part in (0.5, 0.05, 0.95)]
    median, low, high = (max(0.0, end * span - passed) if end <= FARTHEST else np.inf for end in found)
    return None if np.isinf(median) and np.isinf(low) else Remaining(median, low, high)
