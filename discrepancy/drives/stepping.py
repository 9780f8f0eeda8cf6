"""Rates of all states with the standard effects in them, and one Runge-Kutta step of the forward form."""

from __future__ import annotations

from discrepancy.drives.forces import (
    ERROR,
    MASS,
    PLAY,
    PLAY_SHARE,
    SOFT,
    compiled,
    contact_acceleration,
    dry_level,
    inertia_added,
    is_dry,
    load_level,
    smooth_force,
    soft_acceleration,
    wavered,
)

INNER = 4
"""States inside a joint: place and speed of the load on its spring, and of that behind play."""


@compiled
def net_forces(rates, x, u, t, row, places, joints, z0, q0, moved, out):
    """Rates of all states into `out` as the user's function has them, but at the joints' speeds the force that is left
    for dry friction and inertia; of loads on springs their rates. `moved` is room for the states as the user's function
    sees them."""
    n = len(x) - INNER * len(joints)
    for i in range(n):
        moved[i] = x[i]
    for j in range(len(joints)):
        c, q, v = joints[j], places[j, 0], places[j, 1]
        if c[ERROR] != 0.0:
            angle, first, _ = wavered(c, x[q], x[v])
            moved[q], moved[v] = angle, (1.0 + first) * x[v]
    rates(moved, u, t, row, out)
    for j in range(len(joints)):
        c, q, v, load = joints[j], places[j, 0], places[j, 1], n + INNER * j
        force = c[MASS] * out[v]
        out[load], out[load + 1] = 0.0, 0.0
        if c[ERROR] != 0.0:
            out[q] = x[v]
            force -= c[MASS] * wavered(c, x[q], x[v])[2] * x[v] * x[v]
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
            inertia *= 1.0 + wavered(c, x[q], x[v])[1]
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
