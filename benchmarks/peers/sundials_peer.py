"""CVODE (scikit-sundae) with root finding: stopped at each edge of contact and motion law, then started again."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from benchmarks.peers import start
from benchmarks.peers.model_b import accelerations, deflections, table_accelerations

_STOPPED_AT_EDGE = 2
"""CVODE's status CV_ROOT_RETURN."""

_LAW_EDGES = (0.0, 1 / 8, 7 / 8, 1.0)
"""Shares of the motion at which the modified sine's derivatives jump."""


@njit(cache=True, error_model="numpy")
def _line(region, deflection, rate, k, r, edge):
    return k * (deflection - region * edge) + r * rate if region != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _rates(t, y, dy, p, regions):
    """Right-hand side with each joint on the line of its region, so that it is smooth up to the next edge."""
    d1, v1, d2, v2, b1, b2 = deflections(t, y, p)
    m1 = _line(regions[0], d1, v1, p[3], p[4], p[5])
    m2 = _line(regions[1], d2, v2, p[6], p[7], p[8])
    dy[0], dy[2] = y[1], y[3]
    dy[1], dy[3] = accelerations(p, b1, b2, y[1], m1, m2)


@njit(cache=True, error_model="numpy")
def _guards(t, y, guards, p, edges):
    """Depths of contact at the positive and negative flank of both joints, then the law's edges."""
    d1, v1, d2, v2, _, _ = deflections(t, y, p)
    guards[0] = d1 - p[5] + p[4] / p[3] * min(v1, 0.0)
    guards[1] = -d1 - p[5] + p[4] / p[3] * min(-v1, 0.0)
    guards[2] = d2 - p[8] + p[7] / p[6] * min(v2, 0.0)
    guards[3] = -d2 - p[8] + p[7] / p[6] * min(-v2, 0.0)
    for i in range(len(edges)):
        guards[4 + i] = math.sin(0.5 * (y[0] - edges[i]))


def record(p: np.ndarray, sample_rate: float, samples: int, *, rtol: float) -> np.ndarray:
    """φ̈ [rad/s²] (samples,) by the Adams method; the absolute tolerance is a thousandth of the relative one."""
    from sksundae.cvode import CVODE

    times, regions = np.arange(samples + 1) / sample_rate, np.zeros(2)  # one more: a span of two means all steps
    edges = 2.0 * math.pi * p[10] * np.array(_LAW_EDGES)

    def rates(t, y, dy):
        _rates(t, y, dy, p, regions)

    def guards(t, y, values):
        _guards(t, y, values, p, edges)

    count = 4 + len(edges)
    guards.terminal, guards.direction = [True] * count, [0] * count  # pyright: ignore[reportFunctionMemberAccess]
    solver = CVODE(
        rates, method="Adams", rtol=rtol, atol=1e-3 * rtol, eventsfn=guards, num_events=count, max_num_steps=100_000
    )
    states, y, t, done = np.empty((samples, 4)), start(p), 0.0, 0
    while done < samples:
        solution = solver.solve(np.concatenate([[t], times[times > t]]), y)
        if solution.status < 0:
            raise ArithmeticError(f"CVODE stopped at {solution.t[-1]:.3g} s: {solution.message}.")
        sampled = np.isin(solution.t, times[done:samples])
        states[done : done + sampled.sum()] = solution.y[sampled]
        done += int(sampled.sum())
        if solution.status == _STOPPED_AT_EDGE:
            t, y = float(solution.t[-1]), np.array(solution.y[-1])
            _switch(regions, np.asarray(solution.i_events[-1]))
    return table_accelerations(times[:samples], states, p)


def _switch(regions: np.ndarray, fired: np.ndarray) -> None:
    """Enter or leave contact at the flanks whose guards fired."""
    for joint in (0, 1):
        for flank, sign in ((2 * joint, 1.0), (2 * joint + 1, -1.0)):
            if fired[flank]:
                regions[joint] = 0.0 if regions[joint] == sign else sign
