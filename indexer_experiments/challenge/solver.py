"""Dormand–Prince steps of order 5 that stop at every edge of the joints: the truth of the challenge.

A step that ends beyond an edge is taken again, shorter, until it ends on it (regula falsi, Illinois variant), and the
joint changes its region there. Steps are 1/4 ms: far shorter than the machine's fastest period, so that what is left of
an error comes from edges grazed within a step.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numba
import numpy as np

from indexer_experiments.challenge.equations import (
    STATES,
    TURN,
    Joint,
    Plant,
    commanded,
    deflections,
    follower,
    rates,
    softness,
)

STEPS_PER_MS = 4

_PAST = 1e-12
"""rad; an edge counts as crossed this far behind it: above rounding, so that the same edge cannot fire twice."""

_EDGES = 3
"""Ends of the cam turn, of joint 1's region and of joint 2's."""


@numba.njit
def depths(j: Joint, rho: float, d: float, v: float) -> tuple[float, float]:
    """How deep in contact the two flanks are [rad]; a flank that withdraws is deep by the push that is left, over k."""
    plus, minus = d - 0.5 * j.g, -d - 0.5 * j.g
    if j.g > 0.0:
        plus += (j.k_c * plus**3 + j.r * min(v, 0.0)) / j.k
        minus += (j.k_c * minus**3 + j.r * min(-v, 0.0)) / (rho * j.k)
    return plus, minus


@numba.njit
def room(j: Joint, rho: float, region: int, d: float, v: float) -> float:
    """Distance to the end of the region [rad], < 0 beyond it."""
    if j.edged == 0.0:
        return math.inf
    plus, minus = depths(j, rho, d, v)
    if region == 0:
        return -max(plus, minus)
    return plus if region > 0 else minus


@numba.njit
def region_of(j: Joint, rho: float, d: float, v: float) -> int:
    """The region that a deflection and its rate lie in."""
    plus, minus = depths(j, rho, d, v)
    if j.edged == 0.0 or plus >= 0.0:
        return 1
    return -1 if minus >= 0.0 else 0


@numba.njit
def next_region(j: Joint, rho: float, region: int, d: float, v: float) -> int:
    """The region entered when `region` ends."""
    if region == 0:
        plus, minus = depths(j, rho, d, v)
        return 1 if plus > minus else -1
    return 0 if j.g > 0.0 else -region


@numba.njit
def margins(p: Plant, y: np.ndarray, turn: float, region_1: int, region_2: int, out: np.ndarray) -> None:
    """Distances to the edges into out (_EDGES,)."""
    d1, v1, d2, v2 = deflections(p, y, turn)
    out[0] = TURN * (turn + 1.0) - y[0]
    out[1] = room(p.joint_1, p.joint_1.rho, region_1, d1, v1)
    out[2] = room(p.joint_2, softness(p, turn), region_2, d2, v2)


@numba.njit
def step(p: Plant, y: np.ndarray, turn: float, region_1: int, region_2: int, h: float, k: np.ndarray, out) -> None:
    """One step of order 5 (Dormand and Prince 1980, the pair's higher solution) of length h into out (STATES,);
    k (6, STATES) is workspace."""
    rates(p, y, turn, region_1, region_2, k[0])
    for i in range(STATES):
        out[i] = y[i] + h * (k[0, i] / 5.0)
    rates(p, out, turn, region_1, region_2, k[1])
    for i in range(STATES):
        out[i] = y[i] + h * (3.0 / 40.0 * k[0, i] + 9.0 / 40.0 * k[1, i])
    rates(p, out, turn, region_1, region_2, k[2])
    for i in range(STATES):
        out[i] = y[i] + h * (44.0 / 45.0 * k[0, i] - 56.0 / 15.0 * k[1, i] + 32.0 / 9.0 * k[2, i])
    rates(p, out, turn, region_1, region_2, k[3])
    for i in range(STATES):
        out[i] = y[i] + h * (
            19372.0 / 6561.0 * k[0, i] - 25360.0 / 2187.0 * k[1, i] + 64448.0 / 6561.0 * k[2, i]
            - 212.0 / 729.0 * k[3, i]
        )  # fmt: skip
    rates(p, out, turn, region_1, region_2, k[4])
    for i in range(STATES):
        out[i] = y[i] + h * (
            9017.0 / 3168.0 * k[0, i] - 355.0 / 33.0 * k[1, i] + 46732.0 / 5247.0 * k[2, i]
            + 49.0 / 176.0 * k[3, i] - 5103.0 / 18656.0 * k[4, i]
        )  # fmt: skip
    rates(p, out, turn, region_1, region_2, k[5])
    for i in range(STATES):
        out[i] = y[i] + h * (
            35.0 / 384.0 * k[0, i] + 500.0 / 1113.0 * k[2, i] + 125.0 / 192.0 * k[3, i]
            - 2187.0 / 6784.0 * k[4, i] + 11.0 / 84.0 * k[5, i]
        )  # fmt: skip


@numba.njit
def crossing(p: Plant, y: np.ndarray, turn: float, regions, h: float, edge: int, m0: float, m1: float, k, out) -> float:
    """Length of the step that ends just behind an edge whose margin is m0 at the start and m1 < -_PAST at h; the state
    there into out."""
    margin = np.empty(_EDGES)
    low, high, f_low, f_high = 0.0, h, m0 + _PAST, m1 + _PAST
    side = 0
    for _ in range(60):
        if high - low < 1e-16 or f_low <= 0.0:
            break
        middle = low + (high - low) * f_low / (f_low - f_high)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        step(p, y, turn, regions[0], regions[1], middle, k, out)
        margins(p, out, turn, regions[0], regions[1], margin)
        f = margin[edge] + _PAST
        if f > 0.0:
            low, f_low = middle, f
            f_high = 0.5 * f_high if side == 1 else f_high
            side = 1
        else:
            high, f_high = middle, f
            f_low = 0.5 * f_low if side == -1 else f_low
            side = -1
            if f > -1e-13:
                break
    step(p, y, turn, regions[0], regions[1], high, k, out)
    return high


@numba.njit
def _started(p: Plant, start_angle: float, t: float) -> np.ndarray:
    """The state (STATES,) of an undeflected machine at a cam angle [rad] and time [s]."""
    y = np.zeros(STATES)
    turn = float(math.floor(start_angle / TURN))
    speed = commanded(p.unlisted, p.command, t)
    y[0], y[1], y[6], y[7], y[8] = start_angle, p.tau * speed, start_angle / p.tau, speed, t
    y[2], slope, _ = follower(p, start_angle, turn)
    y[3] = slope * y[1]
    y[10], y[11] = y[2], y[3]
    return y


@numba.njit
def _solved(p: Plant, y: np.ndarray, before: int, samples: int, interval: float, steps: int) -> np.ndarray:
    """Table acceleration [rad/s²], then the state, at each sample (1 + STATES, samples) of a run from state y, which is
    overwritten; `before` samples run first; a run that leaves the physical range holds NaN from there on."""
    new, k = np.empty(STATES), np.empty((6, STATES))
    turn = float(math.floor(y[0] / TURN))
    d1, v1, d2, v2 = deflections(p, y, turn)
    regions = np.array([region_of(p.joint_1, p.joint_1.rho, d1, v1), region_of(p.joint_2, softness(p, turn), d2, v2)])
    was, now, rate = np.empty(_EDGES), np.empty(_EDGES), np.empty(STATES)
    out = np.full((1 + STATES, samples), np.nan)
    h = interval / steps
    for sample in range(-before, samples):
        if sample >= 0:
            rates(p, y, turn, regions[0], regions[1], rate)
            if not abs(rate[3]) < 1e6:
                return out
            out[0, sample], out[1:, sample] = rate[3], y
        for _ in range(steps):
            left = h
            while left > 1e-15:
                margins(p, y, turn, regions[0], regions[1], was)
                step(p, y, turn, regions[0], regions[1], left, k, new)
                margins(p, new, turn, regions[0], regions[1], now)
                # the cam's turn first: what the joints are depends on it
                taken, edge = left, -1
                for e in range(_EDGES):
                    if now[e] < -_PAST:
                        length = crossing(p, y, turn, regions, left, e, was[e], now[e], k, new)
                        if edge < 0 or length < taken:
                            taken, edge = length, e
                if edge >= 0:
                    step(p, y, turn, regions[0], regions[1], taken, k, new)
                y[:] = new
                left -= taken
                if edge < 0:
                    continue
                if edge == 0:
                    turn += 1.0
                d1, v1, d2, v2 = deflections(p, y, turn)
                rho = softness(p, turn)
                if edge == 0 and room(p.joint_2, rho, regions[1], d2, v2) < 0.0:
                    regions[1] = region_of(p.joint_2, rho, d2, v2)
                elif edge == 1:
                    regions[0] = next_region(p.joint_1, p.joint_1.rho, regions[0], d1, v1)
                elif edge == 2:
                    regions[1] = next_region(p.joint_2, rho, regions[1], d2, v2)
    return out


def entries(fingerprint: int) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
    """The compiled `_started` and `_solved`; `fingerprint` stands for all sources of the equations in the key of
    numba's cache, and is looked at, since numba keeps of a closure only what is used."""

    @numba.njit(cache=True)
    def started(p: Plant, start_angle: float, t: float) -> np.ndarray:
        assert fingerprint > 0
        return _started(p, start_angle, t)

    @numba.njit(cache=True)
    def solved(p: Plant, y: np.ndarray, before: int, samples: int, interval: float, steps: int) -> np.ndarray:
        assert fingerprint > 0
        return _solved(p, y, before, samples, interval, steps)

    return started, solved
