"""Model B with a motor that does not slip: a step in which each stage is one loop over the lanes.

The same arithmetic in the same order as `nystrom.nystrom_step` with `rates.rates`, so the same bits (a test holds them
side by side), in half of the time: accelerations and the next stage's state are worked out together, and only what the
next stage reads is written to memory. Effects add what they add before each stage; without any nothing of it is read.
"""

from __future__ import annotations

from .compiling import lanes, merged, scalar
from .drive import RIPPLES, begin_ripples, ripple_between
from .dynamics import cam_acceleration, follower_law, table_acceleration
from .interpolation import ramp
from .joints import line_torque, straight_torque
from .layout import *
from .nystrom import NODE_2, NODE_3, drive, ended, fourth, keep_deflections, second, third
from .rates import block_extras


@merged
def plain_step(w, high, features, extras):
    """The step of lanes 0 … high-1 over w[STEP], as `nystrom.nystrom_step` takes it, with or without what effects
    add."""
    keep_deflections(w, high, features)
    to_second(w, high)
    if extras and features & RIPPLES:
        begin_ripples(w, high, features)
    add_effects(w, high, NODE_2, features, extras)
    to_third(w, high, extras)
    add_effects(w, high, NODE_3, features, extras)
    to_fourth(w, high, extras)
    add_effects(w, high, 1.0, features, extras)
    to_end(w, high, extras)
    if extras:
        block_extras(w, high, features)
    at_end(w, high, extras)


@lanes
def add_effects(w, high, share, features, extras):
    """Work out what effects add at a stage's state."""
    if extras:
        if features & USES_MESH:
            drive(w, high, share, features)
        elif features & RIPPLES:
            ripple_between(w, high, share)
        block_extras(w, high, features)


@scalar
def plain_rates(w, i, share, extras):
    """α̈, φ̈, and γ, γ̇, δ1, δ̇1, M1, δ2, δ̇2, M2, β', β'' of lane i after a share of the step."""
    cam, cam_rate, table, table_rate = w[CAM + i], w[CAM_RATE + i], w[TABLE + i], w[TABLE_RATE + i]
    motor, motor_rate = ramp(share * w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i])
    b0, b1, b2 = follower_law(
        cam - w[ORIGIN + i], w[C_0 + i], w[C_1 + i], w[C_2 + i], w[C_3 + i], w[C_4 + i], w[C_5 + i]
    )
    driven, driven_rate, load = w[REDUCTION + i] * motor, w[REDUCTION + i] * motor_rate, w[LOAD_TORQUE + i]
    if extras:
        driven, driven_rate = driven + w[DRIVE_EXTRA + i], driven_rate + w[DRIVE_RATE_EXTRA + i]
        b0, b1, b2 = b0 + w[BETA_EXTRA + i], b1 + w[BETA_1_EXTRA + i], b2 + w[BETA_2_EXTRA + i]
        load += w[LOAD_EXTRA + i]
    d1, v1 = driven - cam, driven_rate - cam_rate
    d2, v2 = table - b0, table_rate - b1 * cam_rate
    M1 = straight_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1)
    M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2, w[LINE_CUBIC_2 + i])
    if extras:
        M1 = w[MESH_FACTOR + i] * M1
    cam_acc = cam_acceleration(w[J_CAM + i], w[J_FOLLOWER + i], b1, b2, cam_rate, M1, M2)
    return cam_acc, table_acceleration(w[J_TABLE + i], load, M2), motor, motor_rate, d1, v1, M1, d2, v2, M2, b1, b2


@lanes
def to_second(w, high):
    """Keep the step's start, and go on to the second stage's state."""
    for i in range(high):
        h = w[STEP + i]
        c, cv, ca = w[CAM + i], w[CAM_RATE + i], w[CAM_ACC + i]
        t, tv, ta = w[TABLE + i], w[TABLE_RATE + i], w[TABLE_ACC + i]
        w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i] = c, cv, ca
        w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i] = t, tv, ta
        w[MOTOR_0 + i], w[MOTOR_RATE_0 + i] = w[MOTOR + i], w[MOTOR_RATE + i]
        w[CAM + i], w[CAM_RATE + i] = second(h, c, cv, ca)
        w[TABLE + i], w[TABLE_RATE + i] = second(h, t, tv, ta)


@lanes
def to_third(w, high, extras):
    """Evaluate the second stage, and go on to the third stage's state."""
    for i in range(high):
        h = w[STEP + i]
        ca, ta, _, _, _, _, _, _, _, _, _, _ = plain_rates(w, i, NODE_2, extras)
        w[CAM_ACC_1 + i], w[TABLE_ACC_1 + i] = ca, ta
        w[CAM + i], w[CAM_RATE + i] = third(h, w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i], ca)
        w[TABLE + i], w[TABLE_RATE + i] = third(h, w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i], ta)


@lanes
def to_fourth(w, high, extras):
    """Evaluate the third stage, and go on to the fourth stage's state."""
    for i in range(high):
        h, ca1, ta1 = w[STEP + i], w[CAM_ACC_1 + i], w[TABLE_ACC_1 + i]
        ca, ta, _, _, _, _, _, _, _, _, _, _ = plain_rates(w, i, NODE_3, extras)
        w[CAM_ACC_2 + i], w[TABLE_ACC_2 + i] = ca, ta
        w[CAM + i], w[CAM_RATE + i] = fourth(h, w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i], ca1, ca)
        w[TABLE + i], w[TABLE_RATE + i] = fourth(h, w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i], ta1, ta)


@lanes
def to_end(w, high, extras):
    """Evaluate the fourth stage, and go on to the state at the step's end."""
    for i in range(high):
        h, ca2, ta2 = w[STEP + i], w[CAM_ACC_2 + i], w[TABLE_ACC_2 + i]
        ca, ta, _, _, _, _, _, _, _, _, _, _ = plain_rates(w, i, 1.0, extras)
        w[CAM + i], w[CAM_RATE + i] = ended(h, w[CAM_0 + i], w[CAM_RATE_0 + i], w[CAM_ACC_0 + i], ca2, ca)
        w[TABLE + i], w[TABLE_RATE + i] = ended(h, w[TABLE_0 + i], w[TABLE_RATE_0 + i], w[TABLE_ACC_0 + i], ta2, ta)


@lanes
def at_end(w, high, extras):
    """Evaluate the state at the step's end."""
    for i in range(high):
        ca, ta, motor, motor_rate, d1, v1, M1, d2, v2, M2, b1, b2 = plain_rates(w, i, 1.0, extras)
        ma, cv = w[MOTOR_ACCELERATION + i], w[CAM_RATE + i]
        driven_acc = w[REDUCTION + i] * ma
        if extras:
            driven_acc += w[DRIVE_ACC_EXTRA + i]
        w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i] = motor, motor_rate, ma
        w[CAM_ACC + i], w[TABLE_ACC + i] = ca, ta
        w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
        w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, v2, M2
        w[DEFLECTION_ACC_1 + i] = driven_acc - ca
        w[DEFLECTION_ACC_2 + i] = ta - b1 * ca - b2 * cv * cv
