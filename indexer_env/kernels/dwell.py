"""The dwell in closed form: where β' = β'' = 0, cam and table are two oscillators that know nothing of each other.

With every joint on its present line, x the deflection beyond the line's offset and c a constant,

    δ̈1 = τ γ̈ - (k1 x1 + r1 δ̇1)/J_C          δ̈2 = -(T_L + k2 x2 + (r2 + c_viscous) δ̇2)/J_t

are linear with constant coefficients, so (x, ẋ) goes over any time t by one matrix, which is exact: `propagator`. A
lane in its dwell takes strides of several steps by matrices worked out once per contact region; a stride in which it
would cross an edge of a play or leave the dwell is repeated in parts that end there, by roots of the closed form.
"""

from __future__ import annotations

import math

from indexer_env.kernels.compiling import lanes, outlined, scalar
from indexer_env.kernels.dynamics import table_acceleration
from indexer_env.kernels.edges import (
    MOST_EDGES,
    cross,
    crossed,
    find_edge,
    find_joint_edge,
    joint_guard,
    joint_rows,
    set_lines,
)
from indexer_env.kernels.joints import line_torque, region_after
from indexer_env.kernels.layout import *
from indexer_env.kernels.plain import ramp

LARGEST_STRIDE = 0.25
"""rad; most that the faster oscillator's phase goes on in a stride. The cubic on which an edge is found is then off by
at most 1e-5 of the oscillation, and a touch that begins and ends within a stride is as light."""

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
def cam_propagator(w, i, t):
    """Of the deflection of joint 1 beyond its line's offset."""
    return propagator(t, w[LINE_K_1 + i], w[LINE_R_1 + i], w[J_CAM + i], w[REDUCTION + i] * w[MOTOR_ACCELERATION + i])


@scalar
def table_propagator(w, i, t):
    """Of the deflection of joint 2 beyond its line's offset."""
    r = w[LINE_R_2 + i] + w[VISCOUS + i]
    return propagator(t, w[LINE_K_2 + i], r, w[J_TABLE + i], -w[LOAD_TORQUE + i] / w[J_TABLE + i])


@outlined
def set_stride(w, i, t):
    """Have the moves of lane i go over the time t, on its present lines."""
    w[STRIDE_TIME + i] = t
    (w[CAM_A + i], w[CAM_B + i], w[CAM_D + i], w[CAM_E + i], w[CAM_F + i], w[CAM_G + i]) = cam_propagator(w, i, t)
    (w[TABLE_A + i], w[TABLE_B + i], w[TABLE_D + i], w[TABLE_E + i], w[TABLE_F + i], w[TABLE_G + i]) = table_propagator(
        w, i, t
    )


@lanes
def move(w, low, high):
    """Take the lanes in their dwell over their stride, and evaluate the state reached; the start is kept."""
    for i in range(low, high):
        t = w[STRIDE_TIME + i]
        if t > 0.0:
            x1, v1 = w[DEFLECTION_1 + i] - w[LINE_OFFSET_1 + i], w[DEFLECTION_RATE_1 + i]
            x2, v2 = w[DEFLECTION_2 + i] - w[LINE_OFFSET_2 + i], w[DEFLECTION_RATE_2 + i]
            w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i] = w[CAM + i], w[CAM_RATE + i], w[CAM_ACC + i]
            w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i] = w[TABLE + i], w[TABLE_RATE + i], w[TABLE_ACC + i]
            w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACC_0 + i] = w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i]
            w[DEFLECTION_1_0 + i], w[DEFLECTION_RATE_1_0 + i] = w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i]
            w[DEFLECTION_2_0 + i], w[DEFLECTION_RATE_2_0 + i] = w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i]

            motor, motor_rate = ramp(t, w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i])
            d1 = w[CAM_A + i] * x1 + w[CAM_B + i] * v1 + w[CAM_F + i] + w[LINE_OFFSET_1 + i]
            u1 = w[CAM_D + i] * x1 + w[CAM_E + i] * v1 + w[CAM_G + i]
            d2 = w[TABLE_A + i] * x2 + w[TABLE_B + i] * v2 + w[TABLE_F + i] + w[LINE_OFFSET_2 + i]
            table_rate = w[TABLE_D + i] * x2 + w[TABLE_E + i] * v2 + w[TABLE_G + i]
            cam, cam_rate = w[REDUCTION + i] * motor - d1, w[REDUCTION + i] * motor_rate - u1
            table = d2 + w[C_0 + i]

            # from the state itself, as where a run goes on from it
            d1, v1 = w[REDUCTION + i] * motor - cam, w[REDUCTION + i] * motor_rate - cam_rate
            d2 = table - w[C_0 + i]
            M1 = line_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1, 0.0)
            M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, table_rate, 0.0)
            w[MOTOR + i], w[MOTOR_RATE + i] = motor, motor_rate
            w[CAM + i], w[CAM_RATE + i], w[CAM_ACC + i] = cam, cam_rate, M1 / w[J_CAM + i]
            w[TABLE + i], w[TABLE_RATE + i] = table, table_rate
            w[TABLE_ACC + i] = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i] + w[VISCOUS + i] * table_rate, M2)
            w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
            w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, table_rate, M2


@lanes
def mark_strides(w, low, high, features):
    """Mark (2) the lanes that left the dwell or crossed an edge in their stride; return whether there is any."""
    for i in range(low, high):
        left = (w[CAM + i] >= w[BREAK_HIGH + i]) or (w[CAM + i] < w[BREAK_LOW + i])
        w[MARK + i] = 2.0 if left else 0.0
    if features & HAS_EDGES_1:
        mark_edges(w, low, high, REGION_1, EDGE_1, DEFLECTION_1)
    if features & HAS_EDGES_2:
        mark_edges(w, low, high, REGION_2, EDGE_2, DEFLECTION_2)
    count = 0
    for i in range(low, high):
        w[MARK + i] = w[MARK + i] if w[STRIDE_TIME + i] > 0.0 else 0.0
        count += 1 if w[MARK + i] > 0.0 else 0
    return count > 0


@lanes
def mark_edges(w, low, high, region, edge, row):
    for i in range(low, high):
        guard = joint_guard(w, i, region, edge, w[row + i], w[row + LANES + i])
        w[MARK + i] = 2.0 if guard < 0.0 else w[MARK + i]


@scalar
def put_cam(w, i):
    """The cam where its joint's deflection has it, and all that follows from that."""
    w[CAM + i] = w[REDUCTION + i] * w[MOTOR + i] - w[DEFLECTION_1 + i]
    w[CAM_RATE + i] = w[REDUCTION + i] * w[MOTOR_RATE + i] - w[DEFLECTION_RATE_1 + i]
    d1 = w[REDUCTION + i] * w[MOTOR + i] - w[CAM + i]
    v1 = w[REDUCTION + i] * w[MOTOR_RATE + i] - w[CAM_RATE + i]
    M1 = line_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1, 0.0)
    w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i], w[CAM_ACC + i] = d1, v1, M1, M1 / w[J_CAM + i]


@scalar
def put_table(w, i):
    """The table where its joint's deflection has it, and all that follows from that."""
    w[TABLE + i], w[TABLE_RATE + i] = w[DEFLECTION_2 + i] + w[C_0 + i], w[DEFLECTION_RATE_2 + i]
    d2, v2 = w[TABLE + i] - w[C_0 + i], w[TABLE_RATE + i]
    M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2, 0.0)
    w[DEFLECTION_2 + i], w[TORQUE_2 + i] = d2, M2
    w[TABLE_ACC + i] = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i] + w[VISCOUS + i] * v2, M2)


@outlined
def joint_propagator(w, i, joint, t):
    """The propagator of joint 0 or 1 on its present line, and the offset of that line."""
    if joint == 0:
        a, b, d, e, f, g = cam_propagator(w, i, t)
        return a, b, d, e, f, g, w[LINE_OFFSET_1 + i]
    a, b, d, e, f, g = table_propagator(w, i, t)
    return a, b, d, e, f, g, w[LINE_OFFSET_2 + i]


@outlined
def mend_stride(w, i, features):
    """Repeat the stride of the joints of lane i that crossed an edge of their play, landing on each; the other joint,
    which knows nothing of it, stays where the stride took it. False where the cam has left the dwell, or a joint's
    contact chatters: then the lane stands where the stride began."""
    begin_1, begin_2 = w[REGION_1 + i], w[REGION_2 + i]
    sound = True
    for joint in range(2):
        region, edge, row = joint_rows(joint)
        start = row + DEFLECTION_1_0 - DEFLECTION_1 + i
        d0, v0 = w[start], w[start + LANES]
        rest, edges = w[STRIDE_TIME + i], 0
        while (
            features & (HAS_EDGES_1 << joint)
            and joint_guard(w, i, region, edge, w[row + i], w[row + LANES + i]) < 0.0
            and edges < MOST_EDGES
        ):
            share, deflection = find_joint_edge(w, i, rest, region, edge, row)
            a, b, d, e, f, g, offset = joint_propagator(w, i, joint, share * rest)
            x, v = w[start] - offset, w[start + LANES]
            x, v = a * x + b * v + f + offset, d * x + e * v + g
            w[region + i] = region_after(w[region + i], deflection, w[edge + i])
            set_lines(w, i)
            rest, edges = rest - share * rest, edges + 1
            a, b, d, e, f, g, offset = joint_propagator(w, i, joint, rest)
            w[start], w[start + LANES] = x, v
            x = x - offset
            w[row + i], w[row + LANES + i] = a * x + b * v + f + offset, d * x + e * v + g
        w[start], w[start + LANES] = d0, v0
        sound = sound and edges < MOST_EDGES
    put_cam(w, i)
    put_table(w, i)
    if sound and w[CAM + i] < w[BREAK_HIGH + i] and w[CAM + i] >= w[BREAK_LOW + i]:
        time = w[STRIDE_TIME + i]
        if w[REGION_1 + i] != begin_1:
            (w[CAM_A + i], w[CAM_B + i], w[CAM_D + i], w[CAM_E + i], w[CAM_F + i], w[CAM_G + i]) = cam_propagator(
                w, i, time
            )
        if w[REGION_2 + i] != begin_2:
            (w[TABLE_A + i], w[TABLE_B + i], w[TABLE_D + i], w[TABLE_E + i], w[TABLE_F + i], w[TABLE_G + i]) = (
                table_propagator(w, i, time)
            )
        return True
    w[REGION_1 + i], w[REGION_2 + i] = begin_1, begin_2
    set_lines(w, i)
    restore(w, i)
    return False


@outlined
def restore(w, i):
    """Put lane i back to the start of its stride."""
    for row in range(8):
        w[CAM + row * LANES + i] = w[CAM_0 + row * LANES + i]
    for row in range(4):
        w[CAM_ACC + row * LANES + i] = w[CAM_ACC_0 + row * LANES + i]
    for row in range(4):
        w[DEFLECTION_1 + row * LANES + i] = w[DEFLECTION_1_0 + row * LANES + i]


@outlined
def move_part(w, i, rest, features, pieces):
    """Take lane i over the time `rest` in its dwell, or to the first edge before, which it crosses; the time that is
    then left, 0 where there was no edge. Its accelerations are to be evaluated anew behind an edge."""
    stride = w[STRIDE_TIME + i]
    set_stride(w, i, rest)
    move(w, i, i + 1)
    left = 0.0
    if crossed(w, i, features):
        share, which, deflection = find_edge(w, i, rest, features)
        restore(w, i)
        if share > 0.0:
            set_stride(w, i, share * rest)
            move(w, i, i + 1)
        left = rest - share * rest
        cross(w, i, which, deflection, pieces)
    w[STRIDE_TIME + i] = stride
    return left
