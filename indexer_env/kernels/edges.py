"""Edges inside a step: where a joint enters or leaves contact, or the cam a segment of its law, the vector field has a
kink or a jump, and a step across it loses its order. A lane that crossed one is put back on it (`land`), and takes the
rest of its step from there on its new line; between edges every joint stays on one line and the law on one polynomial.

Edge and state there are taken from the quintic Hermite interpolants of the step, through angles, rates and
accelerations at both ends: the step itself ran smoothly beyond the edge on the old line, so their error is of order h⁶.
"""

from __future__ import annotations

import numpy as np

from .compiling import lanes, outlined, scalar
from .interpolation import bend, hermite, ramp, slope, value
from .joints import (
    penetration_minus,
    penetration_plus,
    region_after,
    region_guard,
    region_of,
)
from .layout import *
from .pieces import find_piece, load_piece, set_lines
from .rates import lane_rates

LAW_LOW, LAW_HIGH, JOINT_1, JOINT_2, JOINT_3 = 0, 1, 2, 3, 4
"""Which guard ran out."""

MOST_EDGES = 16
"""Edges landed on within one step; beyond that (contact that chatters faster than the step) the regions are set from
the state that the rest of the step reached on the present lines."""

_SEARCHES = 60
"""Bound on the bracketing search for an edge on the interpolant; bisection alone would need 50 for float64."""

_NEAR = 1e-10
"""A guard this near to zero, as a share of its change over the step, is on the edge: below the interpolant's error."""

_AT_END = 1.0 - 1e-6
"""An edge at this share of a step or behind is at its end: the rates of an interpolant over the rest, should that cross
an edge again, would be differences of equal angles over hardly any time."""


@scalar
def joint_guard(w, i, region, edge, deflection, rate):
    """Guard of the joint whose EDGE row is `edge`."""
    plus, minus = edge + RELEASE_1 - EDGE_1 + i, edge + RELEASE_MINUS_1 - EDGE_1 + i
    return region_guard(
        w[region + i], deflection, rate, w[edge + i], w[plus], w[plus + LANES], w[minus], w[minus + LANES]
    )


@lanes
def mark(w, high, features):
    """Mark the lanes that left their piece of the law (1) or crossed an edge (2); return whether there is any."""
    for i in range(high):
        cam = w[CAM + i]
        left = 1.0 if (cam >= w[REACH_HIGH + i]) or (cam < w[REACH_LOW + i]) else 0.0
        broke = (cam >= w[BREAK_HIGH + i]) or (cam < w[BREAK_LOW + i])
        w[MARK + i] = 2.0 if broke else left
    if features & HAS_EDGES_1:
        mark_joint(w, high, REGION_1, EDGE_1, DEFLECTION_1)
    if features & HAS_EDGES_2:
        mark_joint(w, high, REGION_2, EDGE_2, DEFLECTION_2)
    if features & HAS_EDGES_3:
        mark_joint(w, high, REGION_3, EDGE_3, DEFLECTION_3)
    return any_above(w, high, MARK, 0.0)


@lanes
def mark_joint(w, high, region, edge, deflection):
    for i in range(high):
        marked = w[MARK + i]
        guard = joint_guard(w, i, region, edge, w[deflection + i], w[deflection + LANES + i])
        w[MARK + i] = 2.0 if guard < 0.0 else marked


@lanes
def any_above(w, high, row, bound):
    """Whether a value of a row is above a bound; counted, since a largest value would be looked for lane by lane."""
    count = 0
    for i in range(high):
        count += 1 if w[row + i] > bound else 0
    return count > 0


@scalar
def joint_rows(joint):
    """Rows of the region, the edge and the deflection of joint 0, 1 or 2."""
    n = np.uint64(joint)
    return REGION_1 + n * LANES, EDGE_1 + n * (EDGE_2 - EDGE_1), DEFLECTION_1 + np.uint64(3) * n * LANES


@outlined
def find_edge(w, i, h, features):
    """The first edge that lane i crossed in its step of length h: share of the step, which edge, deflection there."""
    first, which, at = 1.0, LAW_HIGH, 0.0
    if w[CAM + i] >= w[BREAK_HIGH + i]:
        first = find_angle(w, i, h, w[BREAK_HIGH + i])
    elif w[CAM + i] < w[BREAK_LOW + i]:
        first, which = find_angle(w, i, h, w[BREAK_LOW + i]), LAW_LOW
    for joint in range(3):
        if features & (HAS_EDGES_1 << joint):
            region, edge, row = joint_rows(joint)
            if joint_guard(w, i, region, edge, w[row + i], w[row + LANES + i]) < 0.0:
                share, deflection = find_joint_edge(w, i, h, region, edge, row)
                if share < first:
                    first, which, at = share, JOINT_1 + joint, deflection
    return first if first < _AT_END else 1.0, which, at


@scalar
def find_angle(w, i, h, angle):
    """Share of the step at which the cam passes `angle`."""
    s0, s1, y0, y1 = 0.0, 1.0, w[CAM_0 + i], w[CAM + i]
    c1, c2, c3, c4, c5 = hermite(h, y0, w[CAM_RATE_0 + i], w[CAM_ACC_0 + i], y1, w[CAM_RATE + i], w[CAM_ACC + i])
    g0, g1 = y0 - angle, y1 - angle
    near = _NEAR * abs(g1 - g0)
    side = 0.0
    for _ in range(_SEARCHES):
        s = false_position(s0, g0, s1, g1)
        g = value(s, y0 - angle, c1, c2, c3, c4, c5)
        if abs(g) <= near:
            return s
        s0, g0, s1, g1, side = narrow(s0, g0, s1, g1, s, g, side)
    return s1


@scalar
def flank_guard(w, i, region, edge, flank, deflection, rate):
    """Guard of one flank: inside the play the distance to that flank alone."""
    if flank > 0.0:
        plus = edge + RELEASE_1 - EDGE_1 + i
        depth = penetration_plus(deflection, rate, w[edge + i], w[plus], w[plus + LANES])
    else:
        minus = edge + RELEASE_MINUS_1 - EDGE_1 + i
        depth = penetration_minus(deflection, rate, w[edge + i], w[minus], w[minus + LANES])
    return -depth if w[region + i] == 0.0 else depth


@scalar
def flank_slope(w, i, region, edge, flank, deflection, rate, deflection_change, rate_change):
    """Its derivative, where deflection and rate change by so much."""
    row = (edge + RELEASE_1 - EDGE_1 if flank > 0.0 else edge + RELEASE_MINUS_1 - EDGE_1) + i
    x = flank * deflection - w[edge + i]
    change = (1.0 + 3.0 * w[row + LANES] * x * x) * flank * deflection_change
    change += w[row] * flank * rate_change if flank * rate < 0.0 else 0.0
    return -change if w[region + i] == 0.0 else change


@scalar
def find_joint_edge(w, i, h, region, edge, row):
    """Share of the step at which the guard of a joint runs out, and its deflection there, by Newton's method; where
    that leaves the bracket, the bracket is halved."""
    start, end = row + DEFLECTION_1_0 - DEFLECTION_1 + i, row + i
    y0, v0, y1, v1 = w[start], w[start + LANES], w[end], w[end + LANES]
    flank = w[region + i]
    if flank == 0.0:
        flank = 1.0 if y1 > 0.0 else -1.0
    s0, s1, deflection = 0.0, 1.0, y0
    g0, g1 = flank_guard(w, i, region, edge, flank, y0, v0), flank_guard(w, i, region, edge, flank, y1, v1)
    if g0 <= 0.0:
        return s0, deflection
    c1, c2, c3, c4, c5 = hermite(h, y0, v0, w[start + TWO * LANES], y1, v1, w[end + TWO * LANES])
    frequency, near = 1.0 / h, _NEAR * (g0 - g1)
    s = false_position(s0, g0, s1, g1)
    for _ in range(_SEARCHES):
        change = slope(s, c1, c2, c3, c4, c5)
        deflection, rate = value(s, y0, c1, c2, c3, c4, c5), frequency * change
        g = flank_guard(w, i, region, edge, flank, deflection, rate)
        if abs(g) <= near:
            return s, deflection
        s0, s1 = (s0, s) if g < 0.0 else (s, s1)
        s -= g / flank_slope(w, i, region, edge, flank, deflection, rate, change, frequency * bend(s, c2, c3, c4, c5))
        if not s0 < s < s1:
            s = 0.5 * (s0 + s1)
    return s1, deflection


@scalar
def false_position(s0, g0, s1, g1):
    """Next trial point of a bracketed root: the secant's, or the middle where rounding puts that outside."""
    s = s1 - g1 * (s1 - s0) / (g1 - g0)
    return s if s0 < s < s1 else 0.5 * (s0 + s1)


@scalar
def narrow(s0, g0, s1, g1, s, g, side):
    """The bracket after trial (s, g); the value of an end that stays a second time is halved (Illinois rule)."""
    if (g < 0.0) == (g1 < 0.0):
        return s0, (0.5 * g0 if side > 0.0 else g0), s, g, 1.0
    return s, g, s1, (0.5 * g1 if side < 0.0 else g1), -1.0


@outlined
def cross(w, i, which, deflection, pieces):
    """Go over the edge that was landed on: the next piece of the law, or the joint's next region."""
    if which == LAW_HIGH:
        load_piece(w, i, int(w[PIECE + i]) + 1, pieces)
    elif which == LAW_LOW:
        load_piece(w, i, int(w[PIECE + i]) - 1, pieces)
    else:
        region, edge, _ = joint_rows(which - JOINT_1)
        w[region + i] = region_after(w[region + i], deflection, w[edge + i])
        set_lines(w, i)


@outlined
def settle_regions(w, i, features):
    """Regions of lane i from its state alone, without history; a joint without edges is always in region +1."""
    for joint in range(3):
        region, edge, row = joint_rows(joint)
        w[region + i] = 1.0
        if features & (HAS_EDGES_1 << joint):
            plus, minus = edge + RELEASE_1 - EDGE_1 + i, edge + RELEASE_MINUS_1 - EDGE_1 + i
            w[region + i] = region_of(
                w[row + i], w[row + LANES + i], w[edge + i], w[plus], w[plus + LANES], w[minus], w[minus + LANES]
            )
    set_lines(w, i)


@scalar
def put_back(w, i, h, share, angle, start, acc):
    """Angle and rate at a share of the step, of one of the state's pairs."""
    x0, v0, a0 = w[start + i], w[start + LANES + i], w[acc + CAM_ACC_0 - CAM_ACC + i]
    c1, c2, c3, c4, c5 = hermite(h, x0, v0, a0, w[angle + i], w[angle + LANES + i], w[acc + i])
    w[angle + i] = value(share, x0, c1, c2, c3, c4, c5)
    w[angle + LANES + i] = slope(share, c1, c2, c3, c4, c5) / h


@outlined
def land(w, i, model, features, pieces):
    """Put lane i, which crossed an edge in its step, on the first one it crossed and over it, with the rest of the step
    to be taken. Its mark goes where nothing is left of the step."""
    h = w[STEP + i]
    if w[EDGES + i] < MOST_EDGES:
        share, which, deflection = find_edge(w, i, h, features)
        put_back(w, i, h, share, CAM, CAM_0, CAM_ACC)
        put_back(w, i, h, share, TABLE, TABLE_0, TABLE_ACC)
        if features & USES_SLIP:
            put_back(w, i, h, share, MOTOR, MOTOR_0, MOTOR_ACC)
        else:
            w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
                share * h, w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
            )
        if model == MODEL_B_ON_BASE:
            put_back(w, i, h, share, HOUSING, HOUSING_0, HOUSING_ACC)
        cross(w, i, which, deflection, pieces)
        w[TAKEN + i] += share * h
        w[STEP + i] = h - share * h
        w[EDGES + i] += 1.0
    else:
        settle_regions(w, i, features)
        find_piece(w, i, pieces)
        w[TAKEN + i] += h
        w[STEP + i] = 0.0
    w[STAGE_TIME + i] = w[TAKEN + i]
    lane_rates(w, i, model, features)
    if w[STEP + i] == 0.0:
        w[STEP + i], w[MARK + i] = w[OWN_STEP + i], 0.0
