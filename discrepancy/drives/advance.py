"""The integrator of the forward form: Runge-Kutta of fourth order, landing on events, with true sticking.

    ẋ = rates(x, u, t; p),   at each joint  v̇ = rates_v·m/(m + m_e) - (F_e(q, v, t) + F_dry)/(m + m_e)

F_e is the sum of the smooth effects, F_dry Coulomb's law as it is: against the motion while v ≠ 0; where v is 0 the
joint stays at rest as long as the levels of dry friction hold the force that acts (Moreau's law). A step in which a
speed passes 0, a joint breaks loose, or a contact opens or closes is cut there: the event is bracketed by halving until
the bracket is `_BRACKET` of the step. u is linear between samples.

The integrator is compiled once per installation; a user's `rates` is handed to it as a function pointer.
"""

from __future__ import annotations

import math

from numba import njit, types

from indexer_env.kernels.effects import imbalance_torque, knot_weight, spline_place

_SETTINGS = {"error_model": "numpy", "_nrt": False}
"""Nothing is allocated here, so arrays need not be counted as references."""

compiled = njit(**_SETTINGS)

COLUMNS = (
    "viscous", "quadratic", "coulomb", "asymmetric", "stribeck", "stribeck_speed", "tilted", "offset", "imbalance",
    "imbalance_phase", "linear", "cubic", "bilinear", "bilinear_place", "stops", "stops_place", "presliding",
    "presliding_distance", "cogging", "cogging_wavenumber", "cogging_phase", "ripple", "ripple_order", "ripple_phase",
    "inertia", "middle", "stroke", "mass", "tabulated_over", "tabulated_first", "tabulated_per",
    *(f"tabulated_{k}" for k in range(11)),
)  # fmt: skip
"""Coefficients of one joint; those that no effect sets are 0."""

(
    VISCOUS, QUADRATIC, COULOMB, ASYMMETRIC, STRIBECK, STRIBECK_SPEED, TILTED, OFFSET, IMBALANCE, IMBALANCE_PHASE,
    LINEAR, CUBIC, BILINEAR, BILINEAR_PLACE, STOPS, STOPS_PLACE, PRESLIDING, PRESLIDING_DISTANCE, COGGING,
    COGGING_WAVENUMBER, COGGING_PHASE, RIPPLE, RIPPLE_ORDER, RIPPLE_PHASE, INERTIA, MIDDLE, STROKE, MASS,
    TABULATED_OVER, TABULATED_FIRST, TABULATED_PER, TABULATED_0,
) = range(len(COLUMNS) - 10)  # fmt: skip

_HALVINGS = 20
_BRACKET = 2.0**-_HALVINGS
_MOST_EVENTS = 8
"""Events in one step after which the rest of it is taken without landing: a chatter faster than the step."""

WORK = 13
"""Rows of room that a run needs."""

FAR = 1e8
"""Size of a state, over its scale, beyond which a run counts as lost."""


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
    if c[TABULATED_OVER] != 0.0:
        place = spline_place(v if c[TABULATED_OVER] == 1.0 else q, c[TABULATED_FIRST], c[TABULATED_PER], 0.0)
        for k in range(11):
            total += c[TABULATED_0 + k] * knot_weight(place, float(k), 0.0)
    return total


@compiled
def bristle(q, z0, q0, distance):
    """Dahl's deflection at q, exact along a path without a reversal from q0."""
    side = 1.0 if q > q0 else -1.0
    return side + (z0 - side) * math.exp(-abs(q - q0) / distance)


@compiled
def dry_level(c, q, v, side):
    """Level [F] of dry friction against a motion in the direction `side`."""
    level = c[COULOMB] + c[ASYMMETRIC] * side + c[TILTED] * (q - c[MIDDLE]) / c[STROKE]
    if c[STRIBECK] != 0.0:
        s = v / c[STRIBECK_SPEED]
        level += c[STRIBECK] / (1.0 + s * s)
    return max(level, 0.0)


@compiled
def is_dry(c):
    """Whether a joint has dry friction."""
    return c[COULOMB] != 0.0 or c[ASYMMETRIC] != 0.0 or c[STRIBECK] != 0.0 or c[TILTED] != 0.0


@compiled
def whole_rates(rates, x, u, t, row, places, joints, mode, z0, q0, out):
    """Rates of all states with the effects in them; a joint whose mode is 0 stays at rest."""
    rates(x, u, t, row, out)
    for j in range(len(joints)):
        c, q, v = joints[j], places[j, 0], places[j, 1]
        mass = c[MASS]
        force = mass * out[v] - smooth_force(c, x[q], x[v], z0[j], q0[j])
        if is_dry(c):
            if mode[j] == 0.0:
                out[v] = 0.0
                out[q] = 0.0
                continue
            force -= mode[j] * dry_level(c, x[q], x[v], mode[j])
        out[v] = force / (mass + c[INERTIA])


@compiled
def acting(rates, x, u, t, row, places, joints, z0, q0, j, out):
    """Force [F] that dry friction has to hold at a joint at rest."""
    rates(x, u, t, row, out)
    c = joints[j]
    return c[MASS] * out[places[j, 1]] - smooth_force(c, x[places[j, 0]], 0.0, z0[j], q0[j])


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
        whole_rates(rates, y[:n], u, t + at * h, row, places, joints, mode, z0, q0, k[:n])
        weight = h / 3.0 if stage == 1 or stage == 2 else h / 6.0
        ahead = h if stage == 2 else 0.5 * h
        for i in range(n):
            out[i] += weight * k[i]
            y[i] = x[i] + ahead * k[i]


@compiled
def set_modes(rates, x, u, t, row, places, joints, z0, q0, mode, out):
    """Directions of the joints: of the motion; at rest of the force, or 0 where dry friction holds it."""
    for j in range(len(joints)):
        if not is_dry(joints[j]):
            mode[j] = 1.0
            continue
        q, v = places[j, 0], places[j, 1]
        if x[v] != 0.0:
            mode[j] = 1.0 if x[v] > 0.0 else -1.0
            continue
        force = acting(rates, x, u, t, row, places, joints, z0, q0, j, out)
        side = 1.0 if force > 0.0 else -1.0
        mode[j] = 0.0 if abs(force) <= dry_level(joints[j], x[q], 0.0, side) else side


@compiled
def happened(rates, x, y, u, t, row, places, joints, mode, z0, q0, out):
    """Joint at which something has happened between x and y: 1 + j where its speed has passed 0, -1 - j where it has
    broken loose or a contact has opened or closed; 0 for nothing."""
    for j in range(len(joints)):
        c, q, v = joints[j], places[j, 0], places[j, 1]
        if is_dry(c):
            if mode[j] * y[v] < 0.0:
                return 1 + j
            if mode[j] == 0.0:
                force = acting(rates, y, u, t, row, places, joints, z0, q0, j, out)
                side = 1.0 if force > 0.0 else -1.0
                if abs(force) > dry_level(c, y[q], 0.0, side):
                    return -1 - j
        a, b = x[q] - c[MIDDLE], y[q] - c[MIDDLE]
        if c[BILINEAR] != 0.0 and (a - c[BILINEAR_PLACE]) * (b - c[BILINEAR_PLACE]) < 0.0:
            return -1 - j
        if c[STOPS] != 0.0 and (abs(a) - c[STOPS_PLACE]) * (abs(b) - c[STOPS_PLACE]) < 0.0:
            return -1 - j
    return 0


@compiled
def landed(rates, x, u0, u1, t, h, row, places, joints, mode, z0, q0, work, y):
    """Advance x by h in place, cut at events; x, z0 and q0 hold the end."""
    ua, ub, last = work[3, : len(u0)], work[4, : len(u0)], work[5, : len(x)]
    done, events = 0.0, 0
    while done < 1.0 - _BRACKET:
        between(u0, u1, done, ua)
        set_modes(rates, x, ua, t + done * h, row, places, joints, z0, q0, mode, last)
        # The end of the step is tried first; once something has happened before it, the bracket is halved.
        low, high, share, found = 0.0, 1.0, 1.0, 0
        for halving in range(_HALVINGS + 2):
            reach = share * (1.0 - done)
            between(u0, u1, done + reach, ub)
            since, until = t + done * h, t + (done + reach) * h
            step(rates, x, ua, ub, since, reach * h, row, places, joints, mode, z0, q0, work, y)
            what = happened(rates, x, y, ub, until, row, places, joints, mode, z0, q0, last)
            if halving == 0 and (what == 0 or events == _MOST_EVENTS):
                break
            if what != 0:
                high, found = share, what
            else:
                low = share
            if halving == _HALVINGS + 1:
                break
            # The last step of all is to the end of the bracket, just beyond the event.
            share = high if halving == _HALVINGS else 0.5 * (low + high)
        if found > 0:
            y[places[found - 1, 1]] = 0.0
        keep(x, y, places, joints, z0, q0)
        done += share * (1.0 - done)
        events += 1


@compiled
def keep(x, y, places, joints, z0, q0):
    """Take y over into x, and Dahl's deflection with it."""
    for j in range(len(joints)):
        if joints[j, PRESLIDING] != 0.0:
            q = y[places[j, 0]]
            if q != q0[j]:
                z0[j] = bristle(q, z0[j], q0[j], joints[j, PRESLIDING_DISTANCE])
            q0[j] = q
    for i in range(len(x)):
        x[i] = y[i]


@compiled
def run(rates, start, z_start, u, begin, rate, substeps, row, places, joints, measured, scale, work, out):
    """Simulate one window from its start state; `out` (channels, samples) gets what is measured.

    u (samples, inputs) of the window; `measured` (channels,) holds the state of each channel, or -1 - j for the
    acceleration of joint j, `work` (WORK, largest count) is room. Returns False where the run is lost.
    """
    n, m = len(start), len(joints)
    states, y, mode, z0, q0 = work[6, :n], work[7, :n], work[8, :m], work[9, :m], work[10, :m]
    for i in range(n):
        states[i] = start[i]
    for j in range(m):
        mode[j], z0[j], q0[j] = 1.0, z_start[j], start[places[j, 0]]
    h = 1.0 / (rate * substeps)
    samples = out.shape[1]
    for k in range(samples):
        t = begin + k / rate
        if k > 0:
            for i in range(substeps):
                u0, u1 = work[11, : u.shape[1]], work[12, : u.shape[1]]
                between(u[k - 1], u[k], i / substeps, u0)
                between(u[k - 1], u[k], (i + 1) / substeps, u1)
                since = begin + (k - 1) / rate + i * h
                landed(rates, states, u0, u1, since, h, row, places, joints, mode, z0, q0, work, y)
        for i in range(n):
            if not abs(states[i]) < FAR * scale[i]:
                return False
        accelerated = False
        for channel in range(len(measured)):
            if measured[channel] >= 0:
                out[channel, k] = states[measured[channel]]
                continue
            if not accelerated:
                set_modes(rates, states, u[k], t, row, places, joints, z0, q0, mode, y)
                whole_rates(rates, states, u[k], t, row, places, joints, mode, z0, q0, y)
                accelerated = True
            out[channel, k] = y[places[-1 - measured[channel], 1]]
    return True


_ROW = types.float64[::1]

SIGNATURE = types.void(_ROW, _ROW, types.float64, _ROW, _ROW)
"""Of `rates` as the integrator calls it: f(x, u, t, row, out)."""


@njit(**_SETTINGS, cache=True)
def run_all(
    rates, starts, z_starts, us, begins, counts, rate, substeps, rows, places, joints, measured, scale, work, out, good
):
    """`run` for every job: starts (k, n), z_starts (k, joints), us (k, samples, inputs), rows (k, parameters),
    joints (k, joints, coefficients); out (k, channels, samples), good (k,)."""
    for job in range(len(starts)):
        count = counts[job]
        good[job] = run(
            rates, starts[job], z_starts[job], us[job, :count], begins[job], rate, substeps, rows[job], places,
            joints[job], measured, scale, work, out[job, :, :count],
        )  # fmt: skip
