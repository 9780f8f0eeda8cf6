"""Forces of the standard effects at one joint, rates of all states with them, and one Runge-Kutta step: plain numbers,
for the integrator of the forward form."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from indexer_env.effects.spline import NUMBERS
from indexer_env.kernels.effects import harmonic, imbalance_torque, tabulated
from indexer_env.kernels.joints import line_torque, region_line

SETTINGS = {"error_model": "numpy", "_nrt": False}
"""Nothing is allocated here, so arrays need not be counted as references."""

compiled = njit(**SETTINGS)

COLUMNS = (
    "viscous", "quadratic", "coulomb", "asymmetric", "stribeck", "stribeck_speed", "tilted", "offset", "imbalance",
    "imbalance_phase", "linear", "cubic", "bilinear", "bilinear_place", "stops", "stops_place", "presliding",
    "presliding_distance", "cogging", "cogging_wavenumber", "cogging_phase", "ripple", "ripple_order", "ripple_phase",
    "inertia", "varying", "varying_wavenumber", "varying_phase", "middle", "stroke", "mass", "load",
    "error", "error_phase", "error_order", "soft", "soft_inverse_square", "soft_damping",
    "play", "play_share", "play_friction", "play_law", "contact",
    "tabulated_over", *(f"tabulated_{k}" for k in range(NUMBERS)),
)  # fmt: skip
"""Coefficients of one joint; those that no effect sets are 0."""

(
    VISCOUS, QUADRATIC, COULOMB, ASYMMETRIC, STRIBECK, STRIBECK_SPEED, TILTED, OFFSET, IMBALANCE, IMBALANCE_PHASE,
    LINEAR, CUBIC, BILINEAR, BILINEAR_PLACE, STOPS, STOPS_PLACE, PRESLIDING, PRESLIDING_DISTANCE, COGGING,
    COGGING_WAVENUMBER, COGGING_PHASE, RIPPLE, RIPPLE_ORDER, RIPPLE_PHASE, INERTIA, VARYING, VARYING_WAVENUMBER,
    VARYING_PHASE, MIDDLE, STROKE, MASS, LOAD, ERROR, ERROR_PHASE, ERROR_ORDER, SOFT, SOFT_INVERSE_SQUARE,
    SOFT_DAMPING, PLAY, PLAY_SHARE, PLAY_FRICTION, PLAY_LAW, CONTACT, TABULATED_OVER, TABULATED_0,
) = range(len(COLUMNS) - NUMBERS + 1)  # fmt: skip


_TABLE, _NEXT = np.uint64(TABULATED_0), np.uint64(1)
"""Where a table's numbers begin, and how far apart they stand; it is over speed (1) or position (2), and over the
position where it has a second variable."""


@compiled
def smooth_force(c, q, v, z0, q0):
    """Force [F] of a joint's smooth effects against the motion; z0 is Dahl's deflection where the joint was at q0."""
    x = q - c[MIDDLE]
    total = c[VISCOUS] * v + c[QUADRATIC] * abs(v) * v + c[OFFSET] + c[LINEAR] * x + c[CUBIC] * x * x * x
    if c[IMBALANCE] != 0.0:
        total += imbalance_torque(q, c[IMBALANCE], c[IMBALANCE_PHASE])
    if c[BILINEAR] > 0.0:
        total += c[BILINEAR] * max(x - c[BILINEAR_PLACE], 0.0)
    elif c[BILINEAR] < 0.0:
        total -= c[BILINEAR] * min(x - c[BILINEAR_PLACE], 0.0)
    if c[STOPS] != 0.0:
        total += c[STOPS] * (max(x - c[STOPS_PLACE], 0.0) + min(x + c[STOPS_PLACE], 0.0))
    if c[COGGING] != 0.0:
        total += c[COGGING] * math.sin(c[COGGING_WAVENUMBER] * q + c[COGGING_PHASE])
    if c[RIPPLE] != 0.0:
        total += c[RIPPLE] * math.sin(c[RIPPLE_ORDER] * q + c[RIPPLE_PHASE])
    if c[PRESLIDING] != 0.0:
        total += c[PRESLIDING] * bristle(q, z0, q0, c[PRESLIDING_DISTANCE])
    if c[VARYING] != 0.0:
        k = c[VARYING_WAVENUMBER]
        total += 0.5 * c[VARYING] * k * math.cos(k * q + c[VARYING_PHASE]) * v * v
    if c[TABULATED_OVER] != 0.0:
        force, _, _ = tabulated(c, _TABLE, _NEXT, v if c[TABULATED_OVER] == 1.0 else q, q)
        total += force
    return total


@compiled
def inertia_added(c, q):
    """What moves beside a joint's own mass."""
    added = c[INERTIA]
    if c[VARYING] != 0.0:
        added += c[VARYING] * math.sin(c[VARYING_WAVENUMBER] * q + c[VARYING_PHASE])
    return added


@compiled
def bristle(q, z0, q0, distance):
    """Dahl's deflection at q, exact along a path without a reversal from q0."""
    side = 1.0 if q > q0 else -1.0
    return side + (z0 - side) * math.exp(-abs(q - q0) / distance)


@compiled
def dry_level(c, q, v, side, u):
    """Level [F] of dry friction against a motion in the direction `side`; u (inputs,), of which the first drives it."""
    level = c[COULOMB] + c[ASYMMETRIC] * side + c[TILTED] * (q - c[MIDDLE]) / c[STROKE]
    if c[STRIBECK] != 0.0:
        s = v / c[STRIBECK_SPEED]
        level += c[STRIBECK] / (1.0 + s * s)
    if c[LOAD] != 0.0 and len(u) > 0:
        # c |f| of the force f that is left for the load: f = u - c |f| side
        level += c[LOAD] * abs(u[0]) / (1.0 + c[LOAD] * (side if u[0] > 0.0 else -side))
    return max(level, 0.0)


@compiled
def is_dry(c):
    """Whether a joint has dry friction."""
    return c[COULOMB] != 0.0 or c[ASYMMETRIC] != 0.0 or c[STRIBECK] != 0.0 or c[TILTED] != 0.0 or c[LOAD] != 0.0


@compiled
def wavered(c, q, v):
    """Angle of the load where its transmission wavers about the joint's, q + e sin(n q + φ), and its first two
    derivatives by q."""
    angle, first, second = harmonic(q, 1.0, 0.0, c[ERROR], c[ERROR_ORDER], c[ERROR_PHASE])
    return q + angle, first, second


@compiled
def soft_acceleration(c, q, v, x, y):
    """Acceleration of a load at x, y on its spring: ẍ = -2 ζ ω (y - v) - ω² (x - q)."""
    omega = 1.0 / math.sqrt(c[SOFT_INVERSE_SQUARE])
    return -2.0 * c[SOFT_DAMPING] * omega * (y - v) - omega * omega * (x - q)


CONTACT_DAMPING = 0.5
"""Damping ratio of a load on the contact of its play."""


@compiled
def flank(c, q, x):
    """Side at which a load behind play is in contact: 1 where the joint pushes it forwards, -1 backwards, else 0."""
    d = q - x
    if d > 0.5 * c[PLAY]:
        return 1.0
    return -1.0 if d < -0.5 * c[PLAY] else 0.0


@compiled
def contact_acceleration(c, q, v, x, y):
    """Force of the contact over the mass of a load behind play at x, y; c[CONTACT] is the load's frequency [rad/s]."""
    region, omega, law = flank(c, q, x), c[CONTACT], c[PLAY_LAW]
    damping = 2.0 * CONTACT_DAMPING * omega
    stiffness, offset, r = region_line(
        region, omega * omega, damping, 0.5 * c[PLAY], 1.0, damping if law == 2.0 else 0.0
    )
    force = line_torque(stiffness, offset, r, q - x, v - y, 0.0)
    if law == 0.0 and region * force < 0.0:
        force = 0.0
    return force


@compiled
def load_level(c):
    """Dry friction of a load behind play over its mass."""
    return c[PLAY_FRICTION] / max(c[PLAY_SHARE] * c[MASS], 1e-300)


INNER = 4
"""States inside a joint: place and speed of the load on its spring, and of that behind play."""


@compiled
def net_forces(rates, x, u, t, row, places, joints, z0, q0, moved, out):
    """Rates of all states into `out` as the user's function has them, but at the joints' speeds the force that is left
    for dry friction and inertia; of loads on springs their rates. `moved` is room for the states as the user's function
    sees them, and for each joint's rate without the first input.

    Where a transmission wavers, the load at x = q + e(q) asks the joint for (1 + e') times its own force, by virtual
    work; the first input acts at the joint itself."""
    n = len(x) - INNER * len(joints)
    wavers = False
    for i in range(n):
        moved[i] = x[i]
    for j in range(len(joints)):
        c, q, v = joints[j], places[j, 0], places[j, 1]
        if c[ERROR] != 0.0:
            angle, first, _ = wavered(c, x[q], x[v])
            moved[q], moved[v], wavers = angle, (1.0 + first) * x[v], True
    if wavers and len(u) > 0:
        driving = u[0]
        u[0] = 0.0
        rates(moved, u, t, row, out)
        u[0] = driving
        for j in range(len(joints)):
            moved[n + INNER * j] = out[places[j, 1]]
    rates(moved, u, t, row, out)
    for j in range(len(joints)):
        c, q, v, load = joints[j], places[j, 0], places[j, 1], n + INNER * j
        force = c[MASS] * out[v]
        out[load], out[load + 1] = 0.0, 0.0
        if c[ERROR] != 0.0:
            out[q] = x[v]
            _, first, second = wavered(c, x[q], x[v])
            alone = c[MASS] * moved[n + INNER * j] if len(u) > 0 else force
            force += first * alone - (1.0 + first) * c[MASS] * second * x[v] * x[v]
        if c[SOFT] != 0.0:
            pulled = soft_acceleration(c, x[q], x[v], x[load], x[load + 1])
            out[load], out[load + 1] = x[load + 1], pulled
            force -= c[SOFT] * c[MASS] * pulled
        out[load + 2], out[load + 3] = 0.0, 0.0
        if c[PLAY] != 0.0:
            pushed = contact_acceleration(c, x[q], x[v], x[load + 2], x[load + 3])
            out[load + 2], out[load + 3] = x[load + 3], pushed
            force -= c[PLAY_SHARE] * c[MASS] * pushed
        out[v] = force - smooth_force(c, x[q], x[v], z0[j], q0[j])


@compiled
def whole_rates(rates, x, u, t, row, places, joints, mode, z0, q0, moved, out):
    """Rates of all states with the effects in them; a joint or a load behind play whose mode is 0 stays at rest."""
    net_forces(rates, x, u, t, row, places, joints, z0, q0, moved, out)
    m, n = len(joints), len(x) - INNER * len(joints)
    for j in range(m):
        c, q, v, load = joints[j], places[j, 0], places[j, 1], n + INNER * j + 2
        if c[PLAY] != 0.0:
            if mode[m + j] == 0.0:
                out[load], out[load + 1] = 0.0, 0.0
            else:
                out[load + 1] -= mode[m + j] * load_level(c)
        force = out[v]
        if is_dry(c):
            if mode[j] == 0.0:
                out[v] = 0.0
                out[q] = 0.0
                continue
            force -= mode[j] * dry_level(c, x[q], x[v], mode[j], u)
        inertia = c[MASS] * (1.0 - c[SOFT] - (c[PLAY_SHARE] if c[PLAY] != 0.0 else 0.0))
        if c[ERROR] != 0.0:
            inertia *= (1.0 + wavered(c, x[q], x[v])[1]) ** 2
        out[v] = force / (inertia + inertia_added(c, x[q]))


@compiled
def acting(rates, x, u, t, row, places, joints, z0, q0, j, moved, out):
    """Force [F] that dry friction has to hold at a joint at rest."""
    net_forces(rates, x, u, t, row, places, joints, z0, q0, moved, out)
    return out[places[j, 1]]


@compiled
def between(a, b, share, out):
    """a + share (b - a), element by element."""
    for i in range(len(out)):
        out[i] = a[i] + share * (b[i] - a[i])


@compiled
def step(rates, x, u0, u1, t, h, row, places, joints, mode, z0, q0, work, out):
    """One Runge-Kutta step from x, u linear from u0 to u1, into `out`."""
    n = len(x)
    k, y, u = work[0], work[1], work[2, : len(u0)]
    for i in range(n):
        out[i] = y[i] = x[i]
    for stage in range(4):
        at = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
        between(u0, u1, at, u)
        whole_rates(rates, y[:n], u, t + at * h, row, places, joints, mode, z0, q0, work[13, :n], k[:n])
        weight = h / 3.0 if stage == 1 or stage == 2 else h / 6.0
        ahead = h if stage == 2 else 0.5 * h
        for i in range(n):
            out[i] += weight * k[i]
            y[i] = x[i] + ahead * k[i]
