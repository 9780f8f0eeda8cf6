"""The integrator of the forward form: Runge-Kutta of fourth order, landing on events, with true sticking.

    ẋ = rates(x, u, t; p),   at each joint  (m + m_e) v̇ = m rates_v - F_e(q, v, t) - F_dry

A share of m may hang on a spring and another lie behind play, their motions four more states of the joint; the load
behind play has dry friction of its own and strikes flanks as stiff as the steps resolve. `rates` may see the joint
where a transmission that wavers has put it. F_e is the sum of the smooth effects, F_dry Coulomb's law as it is:
against the motion while v ≠ 0; where v is 0 the joint stays at rest as long as the levels of dry friction hold the
force that acts (Moreau's law). A step in which a speed passes 0, a joint breaks loose, or a contact opens or closes is
cut there: the event is bracketed by halving until the bracket is `_BRACKET` of the step. u is linear between samples,
or a sample's value until the next.
The integrator is compiled once per installation; a user's `rates` is handed to it as a function pointer.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

from numba import njit, types

from discrepancy.drives.forces import (
    BILINEAR,
    BILINEAR_PLACE,
    INNER,
    MIDDLE,
    PLAY,
    PRESLIDING,
    PRESLIDING_DISTANCE,
    SETTINGS,
    STOPS,
    STOPS_PLACE,
    acting,
    between,
    bristle,
    compiled,
    contact_acceleration,
    dry_level,
    flank,
    is_dry,
    load_level,
    step,
    whole_rates,
)
from indexer_env.compiled import kernel_fingerprint

_HALVINGS = 20
_BRACKET = 2.0**-_HALVINGS
_MOST_EVENTS = 8
"""Events in one step after which the rest of it is taken without landing: a chatter faster than the step."""

WORK = 14
"""Rows of room that a run needs."""

FAR = 1e8
"""Size of a state, over its scale, beyond which a run counts as lost."""


@compiled
def set_modes(rates, x, u, t, row, places, joints, z0, q0, mode, moved, out):
    """Directions (2 joints,) of the joints and of the loads behind their play: of the motion; at rest of the force, or
    0 where dry friction holds it."""
    m, n = len(joints), len(x) - INNER * len(joints)
    for j in range(m):
        c, load = joints[j], n + INNER * j + 2
        if c[PLAY] != 0.0:
            pushed = contact_acceleration(c, x[places[j, 0]], x[places[j, 1]], x[load], x[load + 1])
            if x[load + 1] != 0.0:
                mode[m + j] = 1.0 if x[load + 1] > 0.0 else -1.0
            else:
                mode[m + j] = 0.0 if abs(pushed) <= load_level(c) else (1.0 if pushed > 0.0 else -1.0)
    for j in range(m):
        if not is_dry(joints[j]):
            mode[j] = 1.0
            continue
        q, v = places[j, 0], places[j, 1]
        if x[v] != 0.0:
            mode[j] = 1.0 if x[v] > 0.0 else -1.0
            continue
        force = acting(rates, x, u, t, row, places, joints, z0, q0, j, moved, out)
        side = 1.0 if force > 0.0 else -1.0
        mode[j] = 0.0 if abs(force) <= dry_level(joints[j], x[q], 0.0, side, u) else side


@compiled
def happened(rates, x, y, u, t, row, places, joints, mode, z0, q0, moved, out):
    """Joint at which something has happened between x and y: 1 + j where its speed has passed 0, 1 + joints + j where
    that of the load behind its play has, -1 - j where one of them has broken loose or a contact has opened or closed; 0
    for nothing."""
    m, n = len(joints), len(x) - INNER * len(joints)
    for j in range(m):
        c, q, v, load = joints[j], places[j, 0], places[j, 1], n + INNER * j + 2
        if c[PLAY] != 0.0:
            if mode[m + j] * y[load + 1] < 0.0:
                return 1 + m + j
            if flank(c, x[q], x[load]) != flank(c, y[q], y[load]):
                return -1 - j
            pushed = contact_acceleration(c, y[q], y[v], y[load], y[load + 1])
            if mode[m + j] == 0.0 and abs(pushed) > load_level(c):
                return -1 - j
        if is_dry(c):
            if mode[j] * y[v] < 0.0:
                return 1 + j
            if mode[j] == 0.0:
                force = acting(rates, y, u, t, row, places, joints, z0, q0, j, moved, out)
                side = 1.0 if force > 0.0 else -1.0
                if abs(force) > dry_level(c, y[q], 0.0, side, u):
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
    ua, ub, last, moved = work[3, : len(u0)], work[4, : len(u0)], work[5, : len(x)], work[13, : len(x)]
    done, events = 0.0, 0
    while done < 1.0 - _BRACKET:
        between(u0, u1, done, ua)
        set_modes(rates, x, ua, t + done * h, row, places, joints, z0, q0, mode, moved, last)
        # The end of the step is tried first; once something has happened before it, the bracket is halved.
        low, high, share, found = 0.0, 1.0, 1.0, 0
        for halving in range(_HALVINGS + 2):
            reach = share * (1.0 - done)
            between(u0, u1, done + reach, ub)
            since, until = t + done * h, t + (done + reach) * h
            step(rates, x, ua, ub, since, reach * h, row, places, joints, mode, z0, q0, work, y)
            what = happened(rates, x, y, ub, until, row, places, joints, mode, z0, q0, moved, last)
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
        if found > len(joints):
            y[len(x) - INNER * (2 * len(joints) - found + 1) + 3] = 0.0
        elif found > 0:
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
def run(rates, start, z_start, u, held, begin, rate, substeps, row, places, joints, measured, scale, work, out):
    """Simulate one window from its start state; `out` (channels, samples) gets what is measured.

    u (samples, inputs) of the window; held (inputs,), whether one keeps a sample's value until the next;
    z_start as of `run_all`. `measured` (channels,) holds the state of each channel, or -1 - j for the acceleration of
    joint j, `work` (WORK, largest count) is room. Returns False where the run is lost.
    """
    n, m = len(start), len(joints)
    whole = n + INNER * m
    states, y, moved = work[6, :whole], work[7, :whole], work[13, :whole]
    mode, z0, q0 = work[8, : 2 * m], work[9, :m], work[10, :m]
    for i in range(n):
        states[i] = start[i]
    for j in range(m):
        mode[j], z0[j], q0[j] = 1.0, z_start[j], start[places[j, 0]]
        # loads: beside the joint, as far as the start says
        for i in range(INNER):
            states[n + INNER * j + i] = start[places[j, i % 2]] + z_start[m + INNER * j + i]
        mode[m + j] = 0.0
    h = 1.0 / (rate * substeps)
    samples = out.shape[1]
    for k in range(samples):
        t = begin + k / rate
        if k > 0:
            for i in range(substeps):
                u0, u1 = work[11, : u.shape[1]], work[12, : u.shape[1]]
                between(u[k - 1], u[k], i / substeps, u0)
                between(u[k - 1], u[k], (i + 1) / substeps, u1)
                for one in range(len(held)):
                    if held[one]:
                        u0[one] = u1[one] = u[k - 1, one]
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
                set_modes(rates, states, u[k], t, row, places, joints, z0, q0, mode, moved, y)
                whole_rates(rates, states, u[k], t, row, places, joints, mode, z0, q0, moved, y)
                accelerated = True
            out[channel, k] = y[places[-1 - measured[channel], 1]]
    return True


_ROW = types.float64[::1]

SIGNATURE = types.void(_ROW, _ROW, types.float64, _ROW, _ROW)
"""Of `rates` as the integrator calls it: f(x, u, t, row, out)."""


def entry(fingerprint: str):
    """The compiled entry point; `fingerprint` stands for all that it calls in the key of numba's cache."""

    @njit(**SETTINGS, cache=True)
    def run_all(
        rates, starts, z_starts, us, held, begins, counts, rate, substeps, rows, places, joints, measured, scale, work,
        out, good,
    ):  # fmt: skip
        """`run` for every job: starts (k, n), z_starts (k, 5 joints): Dahl's deflections, then for each joint where the
        load on its spring is beside it and how fast, and that behind play; us (k, samples, inputs), held (inputs,),
        rows (k, parameters), joints (k, joints, coefficients); out (k, channels, samples), good (k,)."""
        for job in range(len(starts)):
            count = counts[job]
            good[job] = run(
                rates, starts[job], z_starts[job], us[job, :count], held, begins[job], rate, substeps, rows[job],
                places, joints[job], measured, scale, work, out[job, :, :count],
            )  # fmt: skip
        return fingerprint

    return run_all


@functools.cache
def integrator() -> Callable[..., str]:
    """The compiled `run_all`."""
    here = Path(__file__)
    return entry(kernel_fingerprint(here, here.with_name("forces.py")))
