"""Accelerations of lanes `low`..`high` of a block from their stage state, with every joint on its present line.

Effects first add what they add to the drive side, the law and the load (each costs one comparison when it is off for
the whole call); then one loop over the lanes evaluates the machine without a branch.
"""

from __future__ import annotations

from .compiling import lanes, outlined
from .drive import RIPPLES, lever, mesh, ripples
from .dynamics import (
    cam_acceleration,
    cam_and_housing_acceleration,
    follower_law,
    table_acceleration,
)
from .effects import (
    bump,
    coulomb_torque,
    imbalance_torque,
    mesh_share,
    slip_acceleration,
    stribeck_torque,
    tabulated,
)
from .joints import line_torque, straight_torque
from .layout import *

_LOAD = USES_VISCOUS | USES_COULOMB | USES_STRIBECK | USES_IMBALANCE | USES_PROCESS | USES_TABLE
"""Effects that act on the table."""


@lanes
def rates(w, low, high, model, features, rippling):
    """Accelerations, deflections and torques of the lanes at their present state.

    Without `rippling` what ripples on the drive is at hand. Model A's cam follows the drive side.
    """
    if rippling and features & RIPPLES:
        ripples(w, low, high, features, DRIVE_EXTRA)
    if features & USES_MESH:
        mesh(w, low, high)
    if model == MODEL_A:
        for i in range(low, high):
            w[CAM + i] = w[REDUCTION + i] * w[MOTOR + i] + w[DRIVE_EXTRA + i]
            w[CAM_RATE + i] = w[REDUCTION + i] * w[MOTOR_RATE + i] + w[DRIVE_RATE_EXTRA + i]
            w[CAM_ACC + i] = w[REDUCTION + i] * w[MOTOR_ACCELERATION + i] + w[DRIVE_ACC_EXTRA + i]
    if features & (_LOAD | USES_BUMP):
        load_and_law_extras(w, low, high, features)
    if model == MODEL_B_ON_BASE:
        for i in range(low, high):
            housing, housing_rate = w[HOUSING + i], w[HOUSING_RATE + i]
            b1, b2, M1, M2 = joints(w, i, housing, housing_rate)
            M3 = straight_torque(w[LINE_K_3 + i], w[LINE_OFFSET_3 + i], w[LINE_R_3 + i], housing, housing_rate)
            table_acc = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i] + w[LOAD_EXTRA + i], M2)
            cam_acc, housing_acc = cam_and_housing_acceleration(
                w[J_CAM + i], w[J_FOLLOWER + i], w[J_HOUSING + i], b1, b2, w[CAM_RATE + i], M1, M2, M3
            )
            w[CAM_ACC + i], w[TABLE_ACC + i], w[HOUSING_ACC + i] = cam_acc, table_acc, housing_acc
            w[DEFLECTION_ACC_2 + i] = table_acc - b1 * cam_acc - b2 * w[CAM_RATE + i] * w[CAM_RATE + i] - housing_acc
            w[DEFLECTION_3 + i], w[DEFLECTION_RATE_3 + i], w[DEFLECTION_ACC_3 + i] = housing, housing_rate, housing_acc
            w[TORQUE_3 + i] = M3
    else:
        for i in range(low, high):
            b1, b2, M1, M2 = joints(w, i, 0.0, 0.0)
            table_acc = table_acceleration(w[J_TABLE + i], w[LOAD_TORQUE + i] + w[LOAD_EXTRA + i], M2)
            cam_acc = w[CAM_ACC + i]
            if model == MODEL_B:
                cam_acc = cam_acceleration(w[J_CAM + i], w[J_FOLLOWER + i], b1, b2, w[CAM_RATE + i], M1, M2)
            w[CAM_ACC + i], w[TABLE_ACC + i] = cam_acc, table_acc
            w[DEFLECTION_ACC_2 + i] = table_acc - b1 * cam_acc - b2 * w[CAM_RATE + i] * w[CAM_RATE + i]
    motor(w, low, high, features)
    for i in range(low, high):
        acc = w[REDUCTION + i] * w[MOTOR_ACC + i] + w[DRIVE_ACC_EXTRA + i] - w[CAM_ACC + i]
        w[DEFLECTION_ACC_1 + i] = acc


@outlined
def block_extras(w, high, features):
    """What effects add at the present state of lanes 0 … high-1, but for what ripples on their drives."""
    if features & USES_MESH:
        mesh(w, FIRST_LANE, high)
    if features & (_LOAD | USES_BUMP):
        load_and_law_extras(w, FIRST_LANE, high, features)


@outlined
def block_rates(w, high, model, features):
    """The same as `rates` of lanes 0 … high-1 at a stage of a step."""
    rates(w, FIRST_LANE, high, model, features, features & USES_SLIP != 0)


@outlined
def lane_rates(w, i, model, features):
    """The same of lane i alone."""
    rates(w, i, i + ONE, model, features, YES)


@lanes
def joints(w, i, housing, housing_rate):
    """β', β'', M1, M2 of one lane; δ1 = τγ - α, δ2 = φ - β - θ, their rates and torques are kept."""
    b0, b1, b2 = follower_law(
        w[CAM + i] - w[ORIGIN + i], w[C_0 + i], w[C_1 + i], w[C_2 + i], w[C_3 + i], w[C_4 + i], w[C_5 + i]
    )
    b0, b1, b2 = b0 + w[BETA_EXTRA + i], b1 + w[BETA_1_EXTRA + i], b2 + w[BETA_2_EXTRA + i]
    d1 = w[REDUCTION + i] * w[MOTOR + i] + w[DRIVE_EXTRA + i] - w[CAM + i]
    v1 = w[REDUCTION + i] * w[MOTOR_RATE + i] + w[DRIVE_RATE_EXTRA + i] - w[CAM_RATE + i]
    d2 = w[TABLE + i] - b0 - housing
    v2 = w[TABLE_RATE + i] - b1 * w[CAM_RATE + i] - housing_rate
    M1 = w[MESH_FACTOR + i] * straight_torque(w[LINE_K_1 + i], w[LINE_OFFSET_1 + i], w[LINE_R_1 + i], d1, v1)
    M2 = line_torque(w[LINE_K_2 + i], w[LINE_OFFSET_2 + i], w[LINE_R_2 + i], d2, v2, w[LINE_CUBIC_2 + i])
    w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i], w[TORQUE_1 + i] = d1, v1, M1
    w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i], w[TORQUE_2 + i] = d2, v2, M2
    return b1, b2, M1, M2


@lanes
def load_and_law_extras(w, low, high, features):
    """What opposes the table beside joint 2 and the constant load: friction, gravity and the process, which depends on
    the cam's phase; the bump on the cam's profile; and what is tabulated of either."""
    if features & _LOAD:
        for i in range(low, high):
            w[LOAD_EXTRA + i] = w[VISCOUS + i] * w[TABLE_RATE + i]
    if features & USES_COULOMB:
        for i in range(low, high):
            w[LOAD_EXTRA + i] += coulomb_torque(w[TABLE_RATE + i], w[COULOMB_TORQUE + i], w[COULOMB_SPEED + i])
    if features & USES_STRIBECK:
        for i in range(low, high):
            w[LOAD_EXTRA + i] += stribeck_torque(
                w[TABLE_RATE + i], w[STRIBECK_TORQUE + i], w[STRIBECK_SPEED + i], w[STRIBECK_SMOOTHING + i]
            )
    if features & USES_IMBALANCE:
        for i in range(low, high):
            w[LOAD_EXTRA + i] += imbalance_torque(w[TABLE + i], w[IMBALANCE_TORQUE + i], w[IMBALANCE_PHASE + i])
    if features & USES_PROCESS:
        for i in range(low, high):
            height, _, _ = bump(PER_TURN * w[CAM + i], w[PROCESS_CENTRE + i], w[PROCESS_HALF_WIDTH + i])
            w[LOAD_EXTRA + i] += w[PROCESS_TORQUE + i] * height
    # without a bump its height is 0, and what a table adds begins there
    if features & (USES_BUMP | USES_TABLE):
        for i in range(low, high):
            height, scale = w[BUMP_HEIGHT + i], 1.0 / (TWO_PI * w[BUMP_HALF_WIDTH + i])
            y0, y1, y2 = bump(PER_TURN * w[CAM + i], w[BUMP_CENTRE + i], w[BUMP_HALF_WIDTH + i])
            w[BETA_EXTRA + i] = height * y0
            w[BETA_1_EXTRA + i] = height * scale * y1
            w[BETA_2_EXTRA + i] = height * scale * scale * y2
    if features & USES_TABLE:
        tabulated_extra(w, low, high)


@outlined
def tabulated_extra(w, low, high):
    """What a table adds to the table's load, or to the cam's motion."""
    for i in range(low, high):
        b0, b1, _ = follower_law(
            w[CAM + i] - w[ORIGIN + i], w[C_0 + i], w[C_1 + i], w[C_2 + i], w[C_3 + i], w[C_4 + i], w[C_5 + i]
        )
        deflection = w[TABLE + i] - b0 - w[BETA_EXTRA + i] - w[HOUSING + i]
        rate = w[TABLE_RATE + i] - (b1 + w[BETA_1_EXTRA + i]) * w[CAM_RATE + i] - w[HOUSING_RATE + i]
        over = w[TABULATED_OVER_1 + i]
        x = w[TABLE + i] if over == 1.0 else w[TABLE_RATE + i]
        x = w[CAM + i] if over == 2.0 else x
        w[TABULATED_X + i] = deflection if over == 3.0 else x
        over = w[TABULATED_OVER_2 + i]
        y = w[TABLE + i] if over == 1.0 else w[CAM + i]
        w[TABULATED_Y + i] = rate if over == 4.0 else y
    for i in range(low, high):
        s0, s1, s2 = tabulated(w, TABULATED_FIRST_1 + i, LANES, w[TABULATED_X + i], w[TABULATED_Y + i])
        moves = w[TABULATED_MOVES + i]
        w[LOAD_EXTRA + i] += (1.0 - moves) * s0
        w[BETA_EXTRA + i] += moves * s0
        w[BETA_1_EXTRA + i] += moves * s1
        w[BETA_2_EXTRA + i] += moves * s2


@lanes
def motor(w, low, high, features):
    """Motor on its commanded ramp, or slipping under its share of the input joint's torque, at which the drive side's
    angle by the motor's is the lever."""
    if features & USES_SLIP:
        lever(w, low, high, features, DRIVE_LEVER)
        for i in range(low, high):
            command = w[COMMAND + i] + w[MOTOR_ACCELERATION + i] * w[STAGE_TIME + i]
            share = mesh_share(w[REGION_1 + i], w[MESH_FRICTION + i])
            reaction = w[DRIVE_LEVER + i] * w[TORQUE_1 + i] / share
            w[MOTOR_ACC + i] = slip_acceleration(
                command, w[MOTOR_RATE + i], w[SLIP_COMPLIANCE + i], reaction, w[J_MOTOR + i]
            )
    else:
        for i in range(low, high):
            w[MOTOR_ACC + i] = w[MOTOR_ACCELERATION + i]
    # what ripples was worked out with the command's ramp for the motor's acceleration
    if features & USES_SLIP and features & RIPPLES:
        for i in range(low, high):
            beyond = w[MOTOR_ACC + i] - w[MOTOR_ACCELERATION + i]
            w[DRIVE_ACC_EXTRA + i] += (w[DRIVE_LEVER + i] - w[REDUCTION + i]) * beyond
