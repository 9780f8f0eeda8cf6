"""SciPy's solve_ivp with a compiled right-hand side."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.peers import start
from benchmarks.peers.model_b import right_hand_side, table_accelerations

METHODS = ("RK45", "DOP853", "LSODA")


def record(
    p: np.ndarray, sample_rate: float, samples: int, *, method: str, rtol: float, max_step: float = math.inf
) -> np.ndarray:
    """φ̈ [rad/s²] (samples,); the absolute tolerance is a thousandth of the relative one."""
    times = np.arange(samples) / sample_rate
    solution = solve_ivp(
        right_hand_side, (0.0, times[-1]), start(p), method=method, t_eval=times, args=(p,),
        rtol=rtol, atol=1e-3 * rtol, max_step=max_step,
    )  # fmt: skip
    if not solution.success:
        raise ArithmeticError(f"SciPy's {method} stopped at {solution.t[-1]:.3g} s: {solution.message}.")
    return table_accelerations(times, np.ascontiguousarray(solution.y.T), p)
