"""Levenberg and Marquardt's method on many turns at once.

Steps go by secants (Broyden 1965). Derivatives by all unknowns are taken anew where such a step does not gain or comes
to rest: those by the machine's own parameters change with the sizes, and a fit with old ones stops on the way along the
valley in which a size and a stiffness make up for each other. What has come to rest leaves, so that simulations go to
the turns that are hard. A turn that is not explained then is started again from about the best fit, as play leaves
several minima.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from twin.work import LEAST, Work

_REST = 0.3
"""Gain of k q in a step, in which 1 is a standard deviation, below which a fit is at rest."""

_TRIES = 4
"""Steps one after the other that do not gain, each 8 times as cautious, until a fit is at rest."""

_EXPLAINED = 1.5
"""q up to which a turn is explained; its mean over noise alone is 1."""

_AGAIN, _ROUNDS = 6, 2
"""Starts about the best fit, and how often."""

_FIRST, _GO_ON, _STEPS = 4, 2, 9
"""Steps of all these starts; how many of each turn then go on, and for how many steps more."""

_SIZES, _OWN = 0.1, 0.7
"""Scatter of those starts: relative of the sizes, in standard deviations of the machine's own parameters."""

_LOST = 0.05
"""Size with which a fault that a fit has lost comes back in half of the starts."""


@dataclass(frozen=True, eq=False)
class Descent:
    """Fits of the turns `at` (n,): unknowns t (n, u), q (n,), curvature (n, u, u) of k q/2 where derivatives were last
    taken."""

    at: np.ndarray
    t: np.ndarray
    q: np.ndarray
    curvature: np.ndarray

    def part(self, rows: np.ndarray) -> Descent:
        """Some of the fits."""
        return Descent(*(getattr(self, field.name)[rows] for field in dataclasses.fields(self)))

    def best(self, kept: int = 1) -> np.ndarray:
        """Places of the best few of each turn, by turn."""
        order = np.lexsort((self.q, self.at))
        rank = np.arange(len(self.at)) - np.searchsorted(self.at[order], self.at[order])
        return order[rank < kept]


def descended(work: Work, t: np.ndarray, at: np.ndarray, steps: int) -> Descent:
    """Fits from unknowns t (n, u) of the turns `at`, at most so many steps."""
    n, u = t.shape
    t, count = t.copy(), work.m.shape[1]
    sizes = np.arange(u) < len(work.of.faults)
    now, slopes, curvature = work.at(t, at), np.zeros((n, count, u)), np.zeros((n, u, u))
    damping, failed = np.full(n, 1e-2), np.zeros(n, dtype=int)
    stale, secant = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    live = np.arange(n)
    for _ in range(steps):
        old = live[stale[live]]
        slopes[old], stale[old], secant[old] = work.slopes(t[old], at[old], now.part(old)), False, False
        part = now.part(live)
        weighted = part.weight @ slopes[live]
        curvature[live] = slopes[live].transpose(0, 2, 1) @ weighted + np.diag(work.prior)
        pull = np.einsum("nki,nk->ni", weighted, part.off) - work.prior * t[live]
        new = t[live] + _step(work, t[live], at[live], curvature[live], pull, damping[live])
        new = np.clip(new, work.low, work.high)
        new[sizes & (np.abs(new) < LEAST)] = 0.0
        then = work.at(new, at[live])
        better, gain = then.q < part.q, count * (part.q - then.q)
        won, lost, by_secant = live[better], live[~better], secant[live]
        slopes[won] += _broyden(work, slopes[won], new[better] - t[won], then.m[better] - part.m[better])
        # a fault that comes or goes changes all derivatives; a secant that does not gain, or rests, proves nothing
        stale[won] = ((new[better] != 0.0) != (t[won] != 0.0))[:, sizes].any(axis=1)
        stale[live[by_secant & (~better | (gain < _REST))]] = True
        secant[won] = True
        t[won] = new[better]
        now.put(won, then.part(np.flatnonzero(better)))
        damping[won], failed[won] = damping[won] / 5.0, 0
        cautious = lost[~by_secant[~better]]
        damping[cautious], failed[cautious] = damping[cautious] * 8.0, failed[cautious] + 1
        live = live[~(better & (gain < _REST) & ~by_secant) & (failed[live] < _TRIES)]
        if not len(live):
            break
    return Descent(at, t, now.q, curvature * count)


def _broyden(work: Work, slopes: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """What makes slopes (n, k, u) agree with the change of the modes (n, k) in a step (n, u), least of all matrices in
    units of the strides."""
    scaled = step / work.stride**2
    missed = change - np.einsum("nku,nu->nk", slopes, step)
    return missed[:, :, None] * (scaled / np.maximum((scaled * step).sum(axis=1), 1e-12)[:, None])[:, None]


def _step(
    work: Work, t: np.ndarray, at: np.ndarray, curvature: np.ndarray, pull: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """A step (n, u) against the pull; what is bound, or not asked for, stays."""
    held = ~work.free[at] | ((t <= work.low) & (pull <= 0.0)) | ((t >= work.high) & (pull >= 0.0))
    matrix = np.where(held[:, :, None] | held[:, None, :], 0.0, curvature)
    diagonal = damping[:, None] * np.einsum("nii->ni", matrix) + held + 1e-6
    matrix = matrix + diagonal[:, :, None] * np.eye(t.shape[1])
    step = np.linalg.solve(matrix, np.where(held, 0.0, pull)[:, :, None])[:, :, 0]
    return np.clip(step, -work.stride, work.stride)


def again(work: Work, found: Descent) -> Descent:
    """Fits, one of each turn, of which those that do not explain their turn are started again from about them."""
    rng = np.random.default_rng(0)
    best = Descent(*(getattr(found, field.name).copy() for field in dataclasses.fields(found)))
    for _ in range(_ROUNDS):
        # all turns are scattered alike, so that a fit does not depend on what is fitted beside it
        scatter = rng.standard_normal((_AGAIN, best.t.shape[1]))
        hard = np.flatnonzero(best.q > _EXPLAINED)
        if not len(hard):
            break
        at = np.repeat(best.at[hard], _AGAIN)
        tried = descended(work, _about(work, best.t[hard], work.free[best.at[hard]], scatter), at, _FIRST)
        tried = tried.part(tried.best(_GO_ON))
        tried = descended(work, tried.t, tried.at, _STEPS)
        tried = tried.part(tried.best())
        won = tried.q < best.q[hard]
        for field in dataclasses.fields(best):
            getattr(best, field.name)[hard[won]] = getattr(tried, field.name)[won]
    return best


def _about(work: Work, t: np.ndarray, free: np.ndarray, scatter: np.ndarray) -> np.ndarray:
    """Starts (n starts, u) about unknowns t (n, u)."""
    starts = np.repeat(t[:, None], len(scatter), axis=1)
    size, own = starts[:, :, work.sizes], starts[:, :, work.own]
    side = np.where((np.arange(len(scatter)) % 2 == 1)[:, None] & (work.low[work.sizes] < 0.0), -1.0, 1.0)
    lost = free[:, None, work.sizes] & (size == 0.0) & (scatter[:, work.sizes] > 0.0)
    size[:] = np.where(lost, side * _LOST, size) * np.exp(_SIZES * scatter[:, work.sizes])
    own[:] = 0.5 * own + _OWN * scatter[:, work.own]
    return np.clip(starts.reshape(-1, t.shape[1]), work.low, work.high)
