"""The common case in one go: Model B without effects, a whole RK4 step of each lane in registers.

The same arithmetic in the same order as `rk4.rk4_parts` with `rates.rates`, so the same bits (a test holds them
side by side); a third faster because nothing between the stages is written to memory.
"""

from __future__ import annotations

from indexer_env.kernels.compiling import lanes, scalar
from indexer_env.kernels.dynamics import cam_acceleration, follower_law, table_acceleration
from indexer_env.kernels.joints import line_torque
from indexer_env.kernels.layout import *


@scalar
def plain_rates(w, i, cam, cam_rate, table, table_rate, motor, motor_rate):
    """α̈, φ̈, and δ1, δ̇1, M1, δ2, δ̇2, M2 of lane i at a state that need not be the lane's own."""
    b0, b1, b2 = follower_law(
        cam - w[ORIGIN + i], w[C_0 + i], w[C_1 + i], w[C_2 + i], w[C_3 + i], w[C_4 + i], w[C_5 + i]
    )
    d1, v1 = w[REDUCTION + i] * motor - cam, w[REDUCTION + i] * motor_rate - cam_rate
    d2, v2 = table - b0, table_rate - b1 * cam_rate
    M1 = line_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1, 0.0)
    M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2, w[LINE_CUBIC_2 + i])
    cam_acc = cam_acceleration(w[J_CAM + i], w[J_FOLLOWER + i], b1, b2, cam_rate, M1, M2)
    table_acc = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i], M2)
    return cam_acc, table_acc, d1, v1, M1, d2, v2, M2


@lanes
def plain_step(w, low, high):
    """One step of classical RK4 of the lanes over w[STEP], as `rk4.rk4` takes it."""
    for i in range(low, high):
        h = w[STEP + i]
        half = 0.5 * h
        c, cv, ca = w[CAM + i], w[CAM_RATE + i], w[CAM_ACC + i]
        t, tv, ta = w[TABLE + i], w[TABLE_RATE + i], w[TABLE_ACC + i]
        m, mv, ma = w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i]

        middle, middle_rate = ramp(half, m, mv, ma)
        end, end_rate = ramp(h, m, mv, ma)

        cv1, tv1 = cv + half * ca, tv + half * ta
        ca1, ta1, _, _, _, _, _, _ = plain_rates(w, i, c + half * cv, cv1, t + half * tv, tv1, middle, middle_rate)
        cv2, tv2 = cv + half * ca1, tv + half * ta1
        ca2, ta2, _, _, _, _, _, _ = plain_rates(w, i, c + half * cv1, cv2, t + half * tv1, tv2, middle, middle_rate)
        cv3, tv3 = cv + h * ca2, tv + h * ta2
        ca3, ta3, _, _, _, _, _, _ = plain_rates(w, i, c + h * cv2, cv3, t + h * tv2, tv3, end, end_rate)

        w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i] = c, cv, ca
        w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i] = t, tv, ta
        w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACC_0 + i] = m, mv, w[MOTOR_ACC + i]
        cam, cam_rate = rk4_sum(h, c, cv, ca, ca1 + ca2, ca3)
        table, table_rate = rk4_sum(h, t, tv, ta, ta1 + ta2, ta3)
        w[CAM + i], w[CAM_RATE + i] = cam, cam_rate
        w[TABLE + i], w[TABLE_RATE + i] = table, table_rate
        w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i] = end, end_rate, ma

        w[DEFLECTION_1_0 + i], w[DEFLECTION_RATE_1_0 + i] = w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i]
        w[DEFLECTION_2_0 + i], w[DEFLECTION_RATE_2_0 + i] = w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i]
        cam_acc, table_acc, d1, v1, M1, d2, v2, M2 = plain_rates(w, i, cam, cam_rate, table, table_rate, end, end_rate)
        w[CAM_ACC + i], w[TABLE_ACC + i] = cam_acc, table_acc
        w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
        w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, v2, M2


@scalar
def ramp(time, angle, rate, acceleration):
    """Angle and rate of a motor on its commanded ramp after a time."""
    return angle + time * (rate + 0.5 * time * acceleration), rate + time * acceleration


@scalar
def rk4_sum(h, angle, rate, a0, inner, a3):
    """Angle and rate at a step's end from the accelerations of the four stages, `inner` = a1 + a2: weights
    (1, 2, 2, 1)/6 for the rate; for the angle, whose stage rates are sums of accelerations, (1, 1, 1, 0)/6."""
    end_angle = angle + h * (rate + h * (1.0 / 6.0) * (a0 + inner))
    end_rate = rate + h * (1.0 / 6.0) * (a0 + 2.0 * inner + a3)
    return end_angle, end_rate
