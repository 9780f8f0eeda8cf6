"""The common case in one go: Model B without effects, a whole step of each lane in registers.

The same arithmetic in the same order as `nystrom.nystrom_step` with `rates.rates`, so the same bits (a test holds them
side by side); a third faster because nothing between the stages is written to memory.
"""

from __future__ import annotations

from indexer_env.kernels.compiling import lanes, scalar
from indexer_env.kernels.dynamics import cam_acceleration, follower_law, table_acceleration
from indexer_env.kernels.joints import line_torque, straight_torque
from indexer_env.kernels.layout import *
from indexer_env.kernels.nystrom import NODE_2, NODE_3, ended, fourth, ramp, second, third


@scalar
def plain_rates(w, i, cam, cam_rate, table, table_rate, motor, motor_rate):
    """α̈, φ̈, and δ1, δ̇1, M1, δ2, δ̇2, M2, β', β'' of lane i at a state that need not be the lane's own."""
    b0, b1, b2 = follower_law(
        cam - w[ORIGIN + i], w[C_0 + i], w[C_1 + i], w[C_2 + i], w[C_3 + i], w[C_4 + i], w[C_5 + i]
    )
    d1, v1 = w[REDUCTION + i] * motor - cam, w[REDUCTION + i] * motor_rate - cam_rate
    d2, v2 = table - b0, table_rate - b1 * cam_rate
    M1 = straight_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1)
    M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2, w[LINE_CUBIC_2 + i])
    cam_acc = cam_acceleration(w[J_CAM + i], w[J_FOLLOWER + i], b1, b2, cam_rate, M1, M2)
    table_acc = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i], M2)
    return cam_acc, table_acc, d1, v1, M1, d2, v2, M2, b1, b2


@lanes
def plain_step(w, high):
    """The step of lanes 0 … high-1 over w[STEP], as `nystrom.nystrom_step` takes it."""
    for i in range(high):
        h = w[STEP + i]
        c, cv, ca = w[CAM + i], w[CAM_RATE + i], w[CAM_ACC + i]
        t, tv, ta = w[TABLE + i], w[TABLE_RATE + i], w[TABLE_ACC + i]
        m, mv, ma = w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i]

        x, xv = second(h, c, cv, ca)
        y, yv = second(h, t, tv, ta)
        z, zv = ramp(NODE_2 * h, m, mv, ma)
        ca1, ta1, _, _, _, _, _, _, _, _ = plain_rates(w, i, x, xv, y, yv, z, zv)
        x, xv = third(h, c, cv, ca, ca1)
        y, yv = third(h, t, tv, ta, ta1)
        z, zv = ramp(NODE_3 * h, m, mv, ma)
        ca2, ta2, _, _, _, _, _, _, _, _ = plain_rates(w, i, x, xv, y, yv, z, zv)
        x, xv = fourth(h, c, cv, ca, ca1, ca2)
        y, yv = fourth(h, t, tv, ta, ta1, ta2)
        z, zv = ramp(h, m, mv, ma)
        ca3, ta3, _, _, _, _, _, _, _, _ = plain_rates(w, i, x, xv, y, yv, z, zv)

        w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i] = c, cv, ca
        w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i] = t, tv, ta
        w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACC_0 + i] = m, mv, w[MOTOR_ACC + i]
        x, xv = ended(h, c, cv, ca, ca2, ca3)
        y, yv = ended(h, t, tv, ta, ta2, ta3)
        w[CAM + i], w[CAM_RATE + i] = x, xv
        w[TABLE + i], w[TABLE_RATE + i] = y, yv
        w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i] = z, zv, ma

        w[DEFLECTION_1_0 + i], w[DEFLECTION_RATE_1_0 + i] = w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i]
        w[DEFLECTION_2_0 + i], w[DEFLECTION_RATE_2_0 + i] = w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i]
        w[DEFLECTION_ACC_1_0 + i], w[DEFLECTION_ACC_2_0 + i] = w[DEFLECTION_ACC_1 + i], w[DEFLECTION_ACC_2 + i]
        cam_acc, table_acc, d1, v1, M1, d2, v2, M2, b1, b2 = plain_rates(w, i, x, xv, y, yv, z, zv)
        w[CAM_ACC + i], w[TABLE_ACC + i] = cam_acc, table_acc
        w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
        w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, v2, M2
        w[DEFLECTION_ACC_1 + i] = w[REDUCTION + i] * ma - cam_acc
        w[DEFLECTION_ACC_2 + i] = table_acc - b1 * cam_acc - b2 * xv * xv
