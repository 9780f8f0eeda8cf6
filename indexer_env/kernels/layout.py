"""Rows of the workspace of one block: row NAME of lane l stands at index ``NAME + l``.

The first STATE_ROWS rows are what survives from call to call, in the order of the columns of the `states` array;
the next COEFFICIENT_ROWS are a machine's coefficients, in the order of the columns of the `coefficients` array.

Rows and lanes are unsigned numpy integers: a signed index would be looked at, each time, whether it counts from the
end, and of Python's own numba compiles a version for every constant that is an argument.
"""

from __future__ import annotations

import math

import numpy as np

from .compiling import LANES

FIRST_LANE = np.uint64(0)

ONE, TWO, THREE, FOUR, FIVE = (np.uint64(number) for number in range(1, 6))
"""A plain number in its place would make an index signed."""

NO, YES = np.bool_(False), np.bool_(True)
"""Arguments that choose a variant of a function that is inlined."""

TWO_PI = 2.0 * math.pi
"""One turn [rad]."""

PER_TURN = 1.0 / TWO_PI
"""Turns in a radian."""

# --- state: angles [rad] and rates [rad/s] of cam, table, housing, motor; then what the integrator must remember
STATE_NAMES = (
    "cam_angle", "cam_rate", "table_angle", "table_rate", "housing_angle", "housing_rate", "motor_angle", "motor_rate",
    "motor_command", "time", "region_1", "region_2", "region_3", "piece", "cam_turn",
)  # fmt: skip
STATE_ROWS = len(STATE_NAMES)
(
    CAM, CAM_RATE, TABLE, TABLE_RATE, HOUSING, HOUSING_RATE, MOTOR, MOTOR_RATE,
    COMMAND, TIME, REGION_1, REGION_2, REGION_3, PIECE, CAM_TURN,
) = (LANES * row for row in range(STATE_ROWS))  # fmt: skip

LARGEST_TABLE = 49
"""Most coefficients of a table: seven by seven."""

# --- coefficients of the machine: one float each, filled by indexer_env.coefficients and by the effects
COEFFICIENT_NAMES = (
    # inertias [kg m²]; reduction τ [-]; follower advance per cam turn h [rad]; stations [-]
    "cam_inertia", "follower_inertia", "table_inertia", "housing_inertia", "motor_inertia",
    "reduction", "advance", "stations",
    # joints: k [N m/rad], r [N m s/rad], edges of the play [rad] (-inf: no edge), ρ [-],
    # r/k [s] and k_c/k [1/rad²] of the clipped law's guards, damping inside the play
    "stiffness_1", "damping_1", "edge_1", "ratio_1", "release_1", "hardening_1", "release_minus_1", "hardening_minus_1",
    "free_damping_1",
    "stiffness_2", "damping_2", "edge_2", "ratio_2", "release_2", "hardening_2", "release_minus_2", "hardening_minus_2",
    "free_damping_2",
    "stiffness_3", "damping_3", "edge_3", "ratio_3", "release_3", "hardening_3", "release_minus_3", "hardening_minus_3",
    "free_damping_3",
    "cubic_2", "single_ratio_2", "single_station",
    # operating point: load torque [N m], motor acceleration (ramp of the command) [rad/s²]
    "load_torque", "motor_acceleration",
    # friction of the table bearing
    "coulomb_torque", "coulomb_speed", "viscous", "stribeck_torque", "stribeck_speed", "stribeck_smoothing",
    # loads
    "imbalance_torque", "imbalance_phase", "process_torque", "process_centre", "process_half_width",
    # drive
    "slip_compliance", "ripple_amplitude", "ripple_order", "ripple_phase",
    "transmission_amplitude", "transmission_order", "transmission_phase",
    "mesh_depth", "mesh_order", "mesh_phase", "mesh_friction",
    # cam
    "bump_height", "bump_centre", "bump_half_width", "spacing_error", "spacing_station",
    # a table: its variables, whether it is an error of the cam's motion (1) or a torque (0); then as
    # effects.tabulated takes it
    "tabulated_over_1", "tabulated_over_2", "tabulated_moves",
    "tabulated_first_1", "tabulated_per_1", "tabulated_count_1", "tabulated_closed_1",
    "tabulated_first_2", "tabulated_per_2", "tabulated_count_2", "tabulated_closed_2", "tabulated_stride",
    *(f"tabulated_{k}" for k in range(LARGEST_TABLE)),
    # the motion law's pieces of this machine in the table of pieces; whether its dwell is linear (1, else 0)
    "law_first", "law_count", "linear_dwell",
)  # fmt: skip
COEFFICIENT_ROWS = len(COEFFICIENT_NAMES)
(
    J_CAM, J_FOLLOWER, J_TABLE, J_HOUSING, J_MOTOR,
    REDUCTION, ADVANCE, STATIONS,
    K_1, R_1, EDGE_1, RATIO_1, RELEASE_1, HARDENING_1, RELEASE_MINUS_1, HARDENING_MINUS_1, FREE_R_1,
    K_2, R_2, EDGE_2, RATIO_2, RELEASE_2, HARDENING_2, RELEASE_MINUS_2, HARDENING_MINUS_2, FREE_R_2,
    K_3, R_3, EDGE_3, RATIO_3, RELEASE_3, HARDENING_3, RELEASE_MINUS_3, HARDENING_MINUS_3, FREE_R_3,
    CUBIC_2, SINGLE_RATIO_2, SINGLE_STATION,
    LOAD_TORQUE, MOTOR_ACCELERATION,
    COULOMB_TORQUE, COULOMB_SPEED, VISCOUS, STRIBECK_TORQUE, STRIBECK_SPEED, STRIBECK_SMOOTHING,
    IMBALANCE_TORQUE, IMBALANCE_PHASE, PROCESS_TORQUE, PROCESS_CENTRE, PROCESS_HALF_WIDTH,
    SLIP_COMPLIANCE, RIPPLE_AMPLITUDE, RIPPLE_ORDER, RIPPLE_PHASE,
    TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER, TRANSMISSION_PHASE,
    MESH_DEPTH, MESH_ORDER, MESH_PHASE, MESH_FRICTION,
    BUMP_HEIGHT, BUMP_CENTRE, BUMP_HALF_WIDTH, SPACING_ERROR, SPACING_STATION,
    TABULATED_OVER_1, TABULATED_OVER_2, TABULATED_MOVES, TABULATED_FIRST_1, *_,
    LAW_FIRST, LAW_COUNT, LINEAR_DWELL,
) = (LANES * row for row in range(STATE_ROWS, STATE_ROWS + COEFFICIENT_ROWS))  # fmt: skip

# --- work rows, filled by the kernel itself
_FIRST_WORK = STATE_ROWS + COEFFICIENT_ROWS
(
    # accelerations of cam, table, housing, motor [rad/s²] at the present state, in the order of the state's pairs
    CAM_ACC, TABLE_ACC, HOUSING_ACC, MOTOR_ACC,
    # deflection, rate and acceleration of the three joints, and their torques
    DEFLECTION_1, DEFLECTION_RATE_1, DEFLECTION_ACC_1, DEFLECTION_2, DEFLECTION_RATE_2, DEFLECTION_ACC_2,
    DEFLECTION_3, DEFLECTION_RATE_3, DEFLECTION_ACC_3, TORQUE_1, TORQUE_2, TORQUE_3,
    # the joints' present straight lines: stiffness, offset, damping of the region they are in; cubic term of joint 2
    LINE_K_1, LINE_OFFSET_1, LINE_R_1, LINE_K_2, LINE_OFFSET_2, LINE_R_2, LINE_K_3, LINE_OFFSET_3, LINE_R_3,
    LINE_CUBIC_2,
    # ρ of the output joint at the present station (a single cracked roller is soft only where it carries the load)
    STATION_RATIO_2,
    # the law's present piece: origin and reach [rad], where a break must be landed on, coefficients in (α - origin)
    ORIGIN, REACH_LOW, REACH_HIGH, BREAK_LOW, BREAK_HIGH, C_0, C_1, C_2, C_3, C_4, C_5,
    # where the present cam turn begins [rad], its rise of the table there [rad], factor on the law's own
    TURN_START, TURN_TABLE, TURN_FACTOR,
    # what effects add: to the drive side of joint 1, to the follower law, to the table's load; factor on joint 1
    DRIVE_EXTRA, DRIVE_RATE_EXTRA, DRIVE_ACC_EXTRA, BETA_EXTRA, BETA_1_EXTRA, BETA_2_EXTRA, LOAD_EXTRA, MESH_FACTOR,
    # what ripples on the drive at the step's start and end: angle, rate, acceleration
    DRIVE_0, DRIVE_RATE_0, DRIVE_ACC_0, DRIVE_1, DRIVE_RATE_1, DRIVE_ACC_1,
    # the step: its length (0: the lane takes none), the time into it of a stage, the marks of lanes to mend
    STEP, STAGE_TIME, MARK,
    # values at the step's start: state pairs (8 rows), accelerations (4), deflections with rates and accelerations (9)
    CAM_0, CAM_RATE_0, TABLE_0, TABLE_RATE_0, HOUSING_0, HOUSING_RATE_0, MOTOR_0, MOTOR_RATE_0,
    CAM_ACC_0, TABLE_ACC_0, HOUSING_ACC_0, MOTOR_ACC_0,
    DEFLECTION_1_0, DEFLECTION_RATE_1_0, DEFLECTION_ACC_1_0, DEFLECTION_2_0, DEFLECTION_RATE_2_0, DEFLECTION_ACC_2_0,
    DEFLECTION_3_0, DEFLECTION_RATE_3_0, DEFLECTION_ACC_3_0,
    # accelerations at the second and third stage
    CAM_ACC_1, TABLE_ACC_1, HOUSING_ACC_1, MOTOR_ACC_1, CAM_ACC_2, TABLE_ACC_2, HOUSING_ACC_2, MOTOR_ACC_2,
    # whether the lane is in a dwell that is linear; its stride there: steps, time, the present matrices of both joints
    DWELLS, STRIDE, STRIDE_TIME, CAM_A, CAM_B, CAM_D, CAM_E, CAM_F, CAM_G, TABLE_A, TABLE_B, TABLE_D, TABLE_E, TABLE_F,
    TABLE_G,
    # a lane's own clock: length of its step, the part of it that edges took already and their number, steps left to its
    # end and to its next sample, number of that sample; whether it is to be looked how the lane goes on
    OWN_STEP, TAKEN, EDGES, LEFT, TO_SAMPLE, SAMPLE, SEE,
    # matrices of a stride in each region of joint 1, then of joint 2 (6 rows for each of the regions -1, 0, 1)
    STRIDES,
) = (LANES * row for row in range(_FIRST_WORK, _FIRST_WORK + 110))  # fmt: skip
_FIRST_FORCED = int(STRIDES // LANES) + 36
(
    # the shares (P, Q) of both harmonics on joint 1's present line, the deflection and rate that they force; torque and
    # stiffness of the imbalance on joint 2's, its half kick, and how far its change takes the table in free flight
    RIPPLE_P, RIPPLE_Q, TRANSMISSION_P, TRANSMISSION_Q, FORCED, FORCED_RATE, WEIGHT, WEIGHT_STIFFNESS, KICK, DRIFT,
    # what a table is over; derivative of the drive side's angle by the motor's, where the motor slips
    TABULATED_X, TABULATED_Y, DRIVE_LEVER,
) = (LANES * row for row in range(_FIRST_FORCED, _FIRST_FORCED + 13))  # fmt: skip
WORKSPACE = int(DRIVE_LEVER + LANES)

DEFLECTIONS = 9
"""Rows of deflections, their rates and accelerations."""

# --- columns of the table of motion-law pieces
PIECE_COLUMNS = 11
PIECE_LOW, PIECE_HIGH, PIECE_BREAK_LOW, PIECE_BREAK_HIGH, PIECE_STILL, PIECE_C_0 = 0, 1, 2, 3, 4, 5

# --- models, and the features (bits) that are switched on for a whole call: joints with edges, families of effects
MODEL_A, MODEL_B, MODEL_B_ON_BASE = 0, 1, 2
(
    HAS_EDGES_1, HAS_EDGES_2, HAS_EDGES_3,
    USES_VISCOUS, USES_COULOMB, USES_STRIBECK, USES_IMBALANCE, USES_PROCESS, USES_SLIP,
    USES_RIPPLE, USES_TRANSMISSION, USES_MESH, USES_BUMP, USES_TABLE,
) = (1 << bit for bit in range(14))  # fmt: skip

USES_ANY_EFFECT = ~(HAS_EDGES_1 | HAS_EDGES_2 | HAS_EDGES_3)

# --- status of an item
RUNNING, NOT_FINITE, OUT_OF_RANGE = 0, 1, 2
