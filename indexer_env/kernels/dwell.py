"""The dwell in closed form: where β' = β'' = 0, cam and table are two oscillators that know nothing of each other.

With every joint on its present line, x the deflection beyond the line's offset and c a constant,

    δ̈1 = τ γ̈ + D̈ - (k1 x1 + r1 δ̇1)/J_C      δ̈2 = -(T_L + k2 x2 + (r2 + c_viscous) δ̇2)/J_t

are linear with constant coefficients, so (x, ẋ) goes over any time t by one matrix, which is exact: `propagator`. What
a harmonic D of the drive and an imbalance of the table add is in `forced`. A lane in its dwell takes strides of several
steps by matrices worked out once per contact region. A joint that crosses an edge of its play is taken again from
there, by the matrix of its next region; a stride that would leave the dwell is taken by steps.
"""

from __future__ import annotations

import math

import numpy as np

from .compiling import lanes, outlined, scalar
from .drive import RIPPLES
from .dynamics import table_acceleration
from .edges import (
    MOST_EDGES,
    any_above,
    find_joint_edge,
    joint_guard,
    joint_rows,
)
from .effects import mesh_share
from .forced import (
    FORCES,
    begin_forced,
    drift,
    end_forced,
    forced,
    lane_forces,
    left_over,
    misses_both,
    use_forces,
    weight,
)
from .interpolation import hermite, ramp, slope
from .joints import region_after, region_line, straight_torque
from .layout import *
from .nystrom import keep_deflections
from .pieces import set_lines

LARGEST_STRIDE = 0.25
"""rad; most that the faster oscillator's phase goes on in a stride. A touch that begins and ends within one is then not
deeper than 1e-2 of the oscillation; the quintic on which an edge is found is off by 1e-8 of it."""

_SERIES = 1e-3
"""Argument below which differences that cancel are taken from their series; three terms leave less than 1e-16."""


@scalar
def propagator(t, k, r, inertia, c):
    """(a, b, d, e, f, g) of x(t) = a x0 + b v0 + f, v(t) = d x0 + e v0 + g for ẍ = c - (k x + r ẋ)/inertia."""
    decay = 0.5 * r / inertia
    square = k / inertia
    if square == 0.0:
        z = 2.0 * decay * t
        if z < _SERIES:
            first, second = (
                1.0 - z * (0.5 - z * (1.0 / 6.0 - z / 24.0)),
                0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z / 120.0)),
            )
        else:
            first = -math.expm1(-z) / z
            second = (1.0 - first) / z
        return 1.0, first * t, 0.0, 1.0 - z * first, c * second * t * t, c * first * t
    difference = square - decay * decay
    phase = difference * t * t
    if abs(phase) < _SERIES:
        damped = math.exp(-decay * t)
        cosine = damped * (1.0 - phase * (0.5 - phase * (1.0 / 24.0 - phase / 720.0)))
        sine = damped * t * (1.0 - phase * (1.0 / 6.0 - phase * (1.0 / 120.0 - phase / 5040.0)))
    elif phase > 0.0:
        frequency, damped = math.sqrt(difference), math.exp(-decay * t)
        cosine, sine = damped * math.cos(frequency * t), damped * math.sin(frequency * t) / frequency
    else:
        rate = math.sqrt(-difference)
        slow, fast = math.exp((rate - decay) * t), math.exp(-(rate + decay) * t)
        cosine, sine = 0.5 * (slow + fast), 0.5 * (slow - fast) / rate
    a = cosine + decay * sine
    return a, sine, -square * sine, cosine - decay * sine, (1.0 - a) * c / square, sine * c


@scalar
def oscillator(w, i, joint, region):
    """The oscillator on joint 0 or 1 in a region: stiffness, offset, damping, inertia, constant acceleration, and the
    imbalance's torque and stiffness in it."""
    row, ratio = K_1 + np.uint64(joint) * (K_2 - K_1) + i, w[RATIO_1 + i] if joint == 0 else w[STATION_RATIO_2 + i]
    k, offset, r = region_line(
        region, w[row], w[row + R_1 - K_1], w[row + EDGE_1 - K_1], ratio, w[row + FREE_R_1 - K_1]
    )  # fmt: skip
    if joint == 0:
        share = mesh_share(region, w[MESH_FRICTION + i])
        k, r = share * k, share * r
        return k, offset, r, w[J_CAM + i], w[REDUCTION + i] * w[MOTOR_ACCELERATION + i], 0.0, 0.0
    torque, stiffness = weight(w, i, offset, k)
    c = -(w[LOAD_TORQUE + i] + torque) / w[J_TABLE + i]
    return k + stiffness, offset, r + w[VISCOUS + i], w[J_TABLE + i], c, torque, stiffness


@outlined
def begin_strides(w, i, features):
    """Have lane i go through its dwell by strides: their matrices in each region of its joints, and the present. Not
    where a harmonic of its drive meets an undamped resonance: that dwell is gone through by steps."""
    t = w[STRIDE + i] * w[OWN_STEP + i]
    w[STEP + i], w[STRIDE_TIME + i] = 0.0, t
    missed = True
    for joint in range(2):
        for region in range(-1, 2):
            if region == 1 or features & (HAS_EDGES_1 << joint):
                k, _, r, inertia, c, _, _ = oscillator(w, i, joint, float(region))
                if joint == 0:
                    missed = missed and misses_both(w, i, k, r)
                row = STRIDES + np.uint64(18 * joint + 6 * (region + 1)) * LANES + i
                a, b, d, e, f, g = propagator(t, k, r, inertia, c)
                w[row], w[row + LANES], w[row + TWO * LANES] = a, b, d
                w[row + THREE * LANES], w[row + FOUR * LANES], w[row + FIVE * LANES] = e, f, g
        use_region(w, i, joint, features)
    if not missed:
        w[STEP + i], w[STRIDE_TIME + i], w[DWELLS + i] = w[OWN_STEP + i], 0.0, 0.0


@scalar
def use_region(w, i, joint, features):
    """Take for the strides of a joint the matrices of its present region, and what forces it there."""
    region = int(w[REGION_1 + np.uint64(joint) * LANES + i])
    row = STRIDES + np.uint64(18 * joint + 6 * (region + 1)) * LANES + i
    for place in range(6):
        w[CAM_A + np.uint64(6 * joint + place) * LANES + i] = w[row + np.uint64(place) * LANES]
    if features & FORCES:
        use_forces(w, i, joint, features)


@lanes
def move(w, high, features, extras):
    """Take the lanes in their dwell over their stride, and evaluate the state reached, with or without what forces
    them; the start is kept."""
    keep_deflections(w, high, features)
    if extras:
        begin_forced(w, high, features)
    for i in range(high):
        t = w[STRIDE_TIME + i]
        if t > 0.0:
            x1, v1 = w[DEFLECTION_1 + i] - w[LINE_OFFSET_1 + i], w[DEFLECTION_RATE_1 + i]
            x2, v2 = w[DEFLECTION_2 + i] - w[LINE_OFFSET_2 + i], w[DEFLECTION_RATE_2 + i]
            w[CAM_0 + i], w[CAM_RATE_0 + i] = w[CAM + i], w[CAM_RATE + i]
            w[TABLE_0 + i], w[TABLE_RATE_0 + i] = w[TABLE + i], w[TABLE_RATE + i]
            w[MOTOR_0 + i], w[MOTOR_RATE_0 + i] = w[MOTOR + i], w[MOTOR_RATE + i]

            motor, motor_rate = ramp(t, w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i])
            d1 = w[CAM_A + i] * x1 + w[CAM_B + i] * v1 + w[CAM_F + i] + w[LINE_OFFSET_1 + i]
            u1 = w[CAM_D + i] * x1 + w[CAM_E + i] * v1 + w[CAM_G + i]
            d2 = w[TABLE_A + i] * x2 + w[TABLE_B + i] * v2 + w[TABLE_F + i] + w[LINE_OFFSET_2 + i]
            driven, driven_rate = w[REDUCTION + i] * motor, w[REDUCTION + i] * motor_rate
            if extras:
                d1, u1 = d1 + w[FORCED + i], u1 + w[FORCED_RATE + i]
                driven, driven_rate = driven + w[DRIVE_EXTRA + i], driven_rate + w[DRIVE_RATE_EXTRA + i]
            w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i] = motor, motor_rate, w[MOTOR_ACCELERATION + i]
            w[CAM + i], w[CAM_RATE + i] = driven - d1, driven_rate - u1
            w[TABLE + i] = d2 + w[C_0 + i]
            w[TABLE_RATE + i] = w[TABLE_D + i] * x2 + w[TABLE_E + i] * v2 + w[TABLE_G + i]
            if not extras:
                dwell_rates(w, i, extras)
    if extras:
        end_forced(w, high, features)
        for i in range(high):
            if w[STRIDE_TIME + i] > 0.0:
                dwell_rates(w, i, extras)


@scalar
def dwell_rates(w, i, extras):
    """Deflections, torques and accelerations of lane i in its dwell from its state, as where a run goes on from it."""
    driven, driven_rate = w[REDUCTION + i] * w[MOTOR + i], w[REDUCTION + i] * w[MOTOR_RATE + i]
    driven_acc = w[REDUCTION + i] * w[MOTOR_ACC + i]
    d2, v2 = w[TABLE + i] - w[C_0 + i], w[TABLE_RATE + i]
    load = w[VISCOUS + i] * v2
    if extras:
        driven, driven_rate = driven + w[DRIVE_EXTRA + i], driven_rate + w[DRIVE_RATE_EXTRA + i]
        driven_acc, load = driven_acc + w[DRIVE_ACC_EXTRA + i], w[LOAD_EXTRA + i]
    d1, v1 = driven - w[CAM + i], driven_rate - w[CAM_RATE + i]
    M1 = straight_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1)
    M2 = straight_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2)
    cam_acc = M1 * (1.0 / w[J_CAM + i])
    table_acc = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i] + load, M2)
    w[CAM_ACC + i], w[TABLE_ACC + i] = cam_acc, table_acc
    w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
    w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, v2, M2
    w[DEFLECTION_ACC_1 + i] = driven_acc - cam_acc
    w[DEFLECTION_ACC_2 + i] = table_acc


@lanes
def mark_strides(w, high, features):
    """Mark the lanes that left the dwell or crossed an edge in their stride (2); return whether there is any."""
    for i in range(high):
        left = (w[CAM + i] >= w[BREAK_HIGH + i]) or (w[CAM + i] < w[BREAK_LOW + i])
        w[MARK + i] = 2.0 if left else 0.0
    if features & HAS_EDGES_1:
        mark_edges(w, high, REGION_1, EDGE_1, DEFLECTION_1)
    if features & HAS_EDGES_2:
        mark_edges(w, high, REGION_2, EDGE_2, DEFLECTION_2)
    for i in range(high):
        w[MARK + i] = w[MARK + i] if w[STRIDE_TIME + i] > 0.0 else 0.0
    return any_above(w, high, MARK, 0.0)


@lanes
def mark_edges(w, high, region, edge, row):
    for i in range(high):
        marked = w[MARK + i]
        guard = joint_guard(w, i, region, edge, w[row + i], w[row + LANES + i])
        w[MARK + i] = 2.0 if guard < 0.0 else marked


@outlined
def mend_joint(w, i, joint, features):
    """Repeat the stride of joint 0 or 1 of lane i from edge to edge of its play; its deflection and rate at the end,
    whether its contact chatters."""
    region, edge, row = joint_rows(joint)
    start, end, rest, edges = row + DEFLECTION_1_0 - DEFLECTION_1 + i, row + i, w[STRIDE_TIME + i], 0
    kept = w[start], w[start + LANES], w[start + TWO * LANES]
    while joint_guard(w, i, region, edge, w[end], w[end + LANES]) < 0.0 and edges < MOST_EDGES:
        share, x = find_joint_edge(w, i, rest, region, edge, row)
        c1, c2, c3, c4, c5 = hermite(
            rest, w[start], w[start + LANES], w[start + TWO * LANES], w[end], w[end + LANES], w[end + TWO * LANES]
        )
        v = slope(share, c1, c2, c3, c4, c5) / rest
        w[region + i] = region_after(w[region + i], x, w[edge + i])
        rest, edges = rest - share * rest, edges + 1
        k, offset, r, inertia, c, torque, stiffness = oscillator(w, i, joint, w[region + i])
        x0, v0, push0, x1, v1, push1, kick = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if joint == 0 and features & RIPPLES:
            at_edge, _ = ramp(-rest, w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i])
            x0, v0, push0 = forced(w, i, at_edge, k, r, features)
            x1, v1, push1 = forced(w, i, w[MOTOR + i], k, r, features)
        if joint == 1 and features & USES_IMBALANCE:
            push0 = -left_over(w, i, x - offset, offset, torque, stiffness)
            kick, x0 = 0.5 * rest * push0, drift(w, i, rest, x + w[C_0 + i], v, k - stiffness)
        a, b, d, e, f, g = propagator(rest, k, r, inertia, c)
        w[start], w[start + LANES] = x, v
        w[start + TWO * LANES] = c - (k * (x - offset) + r * v) / inertia + push0
        x, v = x - offset - x0, v - v0 + kick
        x, v = a * x + b * v + f + x1, d * x + e * v + g + v1
        if joint == 1 and features & USES_IMBALANCE:
            push1 = -left_over(w, i, x, offset, torque, stiffness)
            v += 0.5 * rest * push1
        w[end], w[end + LANES] = x + offset, v
        w[end + TWO * LANES] = c - (k * x + r * v) / inertia + push1
    w[start], w[start + LANES], w[start + TWO * LANES] = kept
    return edges < MOST_EDGES


@outlined
def mend_stride(w, i, features):
    """Repeat the stride of the joints of lane i that crossed an edge of their play, landing on each; the other joint,
    which knows nothing of it, stays where the stride took it. False where the cam has left the dwell, or a joint's
    contact chatters: then the lane stands where the stride began, to go on by steps."""
    begin_1, begin_2 = w[REGION_1 + i], w[REGION_2 + i]
    sound = True
    for joint in range(2):  # a number in place of the variable would be compiled as a version of its own
        if features & (HAS_EDGES_1 << joint):
            sound = mend_joint(w, i, joint, features) and sound
    w[CAM + i] = w[REDUCTION + i] * w[MOTOR + i] + w[DRIVE_EXTRA + i] - w[DEFLECTION_1 + i]
    w[CAM_RATE + i] = w[REDUCTION + i] * w[MOTOR_RATE + i] + w[DRIVE_RATE_EXTRA + i] - w[DEFLECTION_RATE_1 + i]
    w[TABLE + i], w[TABLE_RATE + i] = w[DEFLECTION_2 + i] + w[C_0 + i], w[DEFLECTION_RATE_2 + i]
    stays = sound and w[CAM + i] < w[BREAK_HIGH + i] and w[CAM + i] >= w[BREAK_LOW + i]
    if not stays:
        w[REGION_1 + i], w[REGION_2 + i] = begin_1, begin_2
        for row in range(8):
            place = np.uint64(row) * LANES
            w[CAM + place + i] = w[CAM_0 + place + i]
    set_lines(w, i)
    w[LOAD_EXTRA + i] = w[VISCOUS + i] * w[TABLE_RATE + i]
    if features & FORCES:
        lane_forces(w, i, features)
    if stays:
        for joint in range(2):
            use_region(w, i, joint, features)
    dwell_rates(w, i, YES)
    return stays
