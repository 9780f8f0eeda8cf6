"""Classical RK4 with a fixed step over lanes of machines, compiled by numba: what a loop that ignores edges can do."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

LANES = 32
"""Machines in the inner loop."""

PI = math.pi
_HALF_PI = 0.5 * PI
_ODD = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(10))
_EVEN = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(11))
"""Taylor's series of sine and cosine, to 1e-14 within ±π/2; a call of the C library would keep the lanes scalar."""


@njit(error_model="numpy", forceinline=True)
def sine_and_cosine(x):
    """sin x and cos x of 0 <= x <= π."""
    x -= _HALF_PI
    q = x * x
    odd, even = _ODD[9], _EVEN[10]
    for k in range(9):
        odd = odd * q + _ODD[8 - k]
    for k in range(10):
        even = even * q + _EVEN[9 - k]
    return even, -odd * x


@njit(error_model="numpy", forceinline=True)
def law(alpha, advance, share):
    """β, β', β'' of the modified sine in closed form, without a branch."""
    turns = math.floor(alpha / (2.0 * PI))
    s = (alpha / (2.0 * PI) - turns) / share
    s = s if s < 1.0 else 1.0
    late, u = s > 0.5, (1.0 - s if s > 0.5 else s)
    early = u <= 0.125
    angle = 4.0 * PI * u if early else 4.0 * PI * u / 3.0 + PI / 3.0
    sine, cosine = sine_and_cosine(angle)
    y = ((0.0 if early else 2.0) + PI * u - (0.25 if early else 2.25) * sine) / (4.0 + PI)
    v = PI * (1.0 - (1.0 if early else 3.0) * cosine) / (4.0 + PI)
    a = 4.0 * PI * PI * sine / (4.0 + PI)
    y, a = (1.0 - y if late else y), (-a if late else a)
    per_rad = 1.0 / (2.0 * PI * share)
    return advance * (turns + y), advance * per_rad * v, advance * per_rad * per_rad * a


@njit(error_model="numpy", forceinline=True)
def contact_torque(deflection, rate, k, r, edge):
    """The clipped law: k x + r δ̇ beyond either flank where that pushes, else 0."""
    plus, minus = k * (deflection - edge) + r * rate, k * (deflection + edge) + r * rate
    plus, minus = (plus if plus > 0.0 else 0.0), (minus if minus < 0.0 else 0.0)
    return plus if deflection > edge else (minus if deflection < -edge else 0.0)


@njit(error_model="numpy", forceinline=True)
def rates(t, cam, cam_rate, table, table_rate, p, i):
    """α̈ and φ̈ of lane i; p (13, n) in the order of peers.PARAMETERS."""
    b0, b1, b2 = law(cam, p[9, i], p[10, i])
    m1 = contact_torque(p[12, i] * t - cam, p[12, i] - cam_rate, p[3, i], p[4, i], p[5, i])
    m2 = contact_torque(table - b0, table_rate - b1 * cam_rate, p[6, i], p[7, i], p[8, i])
    acc = (m1 + b1 * (m2 - p[1, i] * b2 * cam_rate * cam_rate)) / (p[0, i] + p[1, i] * b1 * b1)
    return acc, -(p[11, i] + m2) / p[2, i]


@njit(error_model="numpy")
def block(p, sample_rate, samples, steps_per_sample, out):
    """φ̈ [rad/s²] of a block of machines (samples, n) from parameters (13, n), from kinematic motion at cam angle 0."""
    h, count = 1.0 / (sample_rate * steps_per_sample), np.uint64(p.shape[1])
    half, y = 0.5 * h, np.zeros((4, LANES))
    for i in range(count):
        y[1, i] = p[12, i]
    for n in range(samples * steps_per_sample):
        t, sample = n * h, n // steps_per_sample
        for i in range(count):
            c, cv, x, xv = y[0, i], y[1, i], y[2, i], y[3, i]
            ca, xa = rates(t, c, cv, x, xv, p, i)
            c2, x2 = cv + half * ca, xv + half * xa
            cb, xb = rates(t + half, c + half * cv, c2, x + half * xv, x2, p, i)
            c3, x3 = cv + half * cb, xv + half * xb
            cc, xc = rates(t + half, c + half * c2, c3, x + half * x2, x3, p, i)
            c4, x4 = cv + h * cc, xv + h * xc
            cd, xd = rates(t + h, c + h * c3, c4, x + h * x3, x4, p, i)
            y[0, i], y[1, i] = c + h / 6.0 * (cv + 2.0 * (c2 + c3) + c4), cv + h / 6.0 * (ca + 2.0 * (cb + cc) + cd)
            y[2, i], y[3, i] = x + h / 6.0 * (xv + 2.0 * (x2 + x3) + x4), xv + h / 6.0 * (xa + 2.0 * (xb + xc) + xd)
            if n == sample * steps_per_sample:
                out[sample, i] = xa


def records(p: np.ndarray, sample_rate: float, samples: int, steps_per_sample: int) -> np.ndarray:
    """Records φ̈ [rad/s²] (n, samples) from parameters (n, 13), on one core."""
    out = np.empty((len(p), samples))
    for first in range(0, len(p), LANES):
        rows = np.ascontiguousarray(p[first : first + LANES].T)
        found = np.empty((samples, rows.shape[1]))
        block(rows, sample_rate, samples, steps_per_sample, found)
        out[first : first + LANES] = found.T
    return out
