"""Model B as compiled scalar functions on plain arrays, and a fixed-step RK4 that does not care for edges."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

PI = math.pi


@njit(cache=True, error_model="numpy")
def law(alpha, advance, share):
    """β, β', β'' of the modified sine in closed form (indexer_env.motion_law.modified_sine)."""
    turns = math.floor(alpha / (2.0 * PI))
    s = min((alpha / (2.0 * PI) - turns) / share, 1.0)
    if s >= 1.0:
        return advance * (turns + 1.0), 0.0, 0.0
    late = s > 0.5
    u = 1.0 - s if late else s
    if u <= 0.125:
        angle, size, lead = 4.0 * PI * u, 1.0, 0.0
    else:
        angle, size, lead = 4.0 * PI * u / 3.0 + PI / 3.0, 3.0, 2.0
    y = (lead + PI * u - (0.25 if size == 1.0 else 2.25) * math.sin(angle)) / (4.0 + PI)
    v = PI * (1.0 - size * math.cos(angle)) / (4.0 + PI)
    a = 4.0 * PI * PI * math.sin(angle) / (4.0 + PI)
    y, a = (1.0 - y, -a) if late else (y, a)
    per_rad = 1.0 / (2.0 * PI * share)
    return advance * (turns + y), advance * per_rad * v, advance * per_rad * per_rad * a


@njit(cache=True, error_model="numpy")
def contact_torque(deflection, rate, k, r, edge):
    """The clipped law: k x + r δ̇ beyond either flank where that pushes, else 0."""
    if deflection > edge:
        return max(k * (deflection - edge) + r * rate, 0.0)
    if deflection < -edge:
        return min(k * (deflection + edge) + r * rate, 0.0)
    return 0.0


@njit(cache=True, error_model="numpy")
def deflections(t, y, p):
    """δ1, δ̇1, δ2, δ̇2, β', β''."""
    b0, b1, b2 = law(y[0], p[9], p[10])
    return p[12] * t - y[0], p[12] - y[1], y[2] - b0, y[3] - b1 * y[1], b1, b2


@njit(cache=True, error_model="numpy")
def accelerations(p, b1, b2, w, m1, m2):
    """α̈ and φ̈ from the joints' torques."""
    cam = (m1 + b1 * (m2 - p[1] * b2 * w * w)) / (p[0] + p[1] * b1 * b1)
    return cam, -(p[11] + m2) / p[2]


@njit(cache=True, error_model="numpy")
def rates(t, y, p, dy):
    """Right-hand side of the state (α, α̇, φ, φ̇) into dy."""
    d1, v1, d2, v2, b1, b2 = deflections(t, y, p)
    m1 = contact_torque(d1, v1, p[3], p[4], p[5])
    m2 = contact_torque(d2, v2, p[6], p[7], p[8])
    dy[0], dy[2] = y[1], y[3]
    dy[1], dy[3] = accelerations(p, b1, b2, y[1], m1, m2)


@njit(cache=True, error_model="numpy")
def right_hand_side(t, y, p):
    """The right-hand side as a new array, as SciPy wants it."""
    dy = np.empty(4)
    rates(t, y, p, dy)
    return dy


@njit(cache=True, error_model="numpy")
def table_accelerations(times, states, p):
    """φ̈ [rad/s²] (n,) at times (n,) of states (n, 4)."""
    out, dy = np.empty(len(times)), np.empty(4)
    for i in range(len(times)):
        rates(times[i], states[i], p, dy)
        out[i] = dy[3]
    return out


@njit(cache=True, error_model="numpy")
def plain_rk4(p, y, sample_rate, samples, steps_per_sample):
    """φ̈ [rad/s²] (samples,) by classical RK4 with the same step everywhere, edges or not."""
    h = 1.0 / (sample_rate * steps_per_sample)
    y, out = y.copy(), np.empty(samples)
    a, b, c, d = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    for n in range(samples * steps_per_sample):
        t = n * h
        rates(t, y, p, a)
        if n % steps_per_sample == 0:
            out[n // steps_per_sample] = a[3]
        rates(t + h / 2.0, y + h / 2.0 * a, p, b)
        rates(t + h / 2.0, y + h / 2.0 * b, p, c)
        rates(t + h, y + h * c, p, d)
        y += h / 6.0 * (a + 2.0 * (b + c) + d)
    return out
