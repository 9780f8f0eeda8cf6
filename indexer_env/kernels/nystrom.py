"""One step of Nyström's scheme: four evaluations, each joint on its present line.

Stages at 0, 1/5, 2/3 and 1 of the step. The angles take Nyström's weights of fifth order for ẍ = f(t, x) (Nyström 1925;
Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, table II.14.1), the rates those of the Runge-Kutta
scheme of fourth order with the same nodes. So forces that depend on rates are met to fourth order and all others to
fifth: a lightly damped machine has some fifty times less error than with classical RK4 at the same cost.
"""

from __future__ import annotations

from indexer_env.kernels.compiling import lanes, scalar
from indexer_env.kernels.layout import *
from indexer_env.kernels.rates import block_rates

NODE_2, NODE_3 = 1.0 / 5.0, 2.0 / 3.0
"""Shares of the step at which the second and third stage lie; the fourth lies at its end."""


@scalar
def second(h, x, v, a0):
    """Angle and rate at the second stage, from those at the step's start and the acceleration there."""
    return x + h * ((1.0 / 5.0) * v + h * ((1.0 / 50.0) * a0)), v + h * ((1.0 / 5.0) * a0)


@scalar
def third(h, x, v, a0, a1):
    """Angle and rate at the third stage."""
    angle = x + h * ((2.0 / 3.0) * v + h * ((7.0 / 27.0) * a1 - (1.0 / 27.0) * a0))
    return angle, v + h * ((35.0 / 27.0) * a1 - (17.0 / 27.0) * a0)


@scalar
def fourth(h, x, v, a0, a1, a2):
    """Angle and rate at the fourth stage."""
    angle = x + h * (v + h * ((3.0 / 10.0) * a0 - (2.0 / 35.0) * a1 + (9.0 / 35.0) * a2))
    return angle, v + h * ((13.0 / 5.0) * a0 - (22.0 / 7.0) * a1 + (54.0 / 35.0) * a2)


@scalar
def ended(h, x, v, a0, a1, a2, a3):
    """Angle and rate at the step's end."""
    angle = x + h * (v + h * ((1.0 / 24.0) * a0 + (25.0 / 84.0) * a1 + (9.0 / 56.0) * a2))
    return angle, v + h * ((1.0 / 24.0) * a0 + (125.0 / 336.0) * a1 + (27.0 / 56.0) * a2 + (5.0 / 48.0) * a3)


@scalar
def ramp(time, angle, rate, acceleration):
    """Angle and rate of a motor on its commanded ramp after a time."""
    return angle + time * (rate + 0.5 * time * acceleration), rate + time * acceleration


@lanes
def nystrom_step(w, high, model, features):
    """The step of lanes 0 … high-1 over w[STEP] for every model and effect, stage by stage through the workspace, from
    the present state, whose accelerations are at hand, to the state reached and its accelerations. A motor that does
    not slip stands at the fourth stage where the step ends, so what depends on it is worked out once for both."""
    keep_deflections(w, high, features)
    to_second(w, high, CAM, CAM_0, CAM_ACC)
    to_second(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_second(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    to_second(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    drive(w, high, NODE_2, features)
    block_rates(w, high, model, features, True)
    to_third(w, high, CAM, CAM_0, CAM_ACC)
    to_third(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_third(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_third(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    drive(w, high, NODE_3, features)
    block_rates(w, high, model, features, True)
    to_fourth(w, high, CAM, CAM_0, CAM_ACC)
    to_fourth(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_fourth(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_fourth(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    drive(w, high, 1.0, features)
    block_rates(w, high, model, features, True)
    to_end(w, high, CAM, CAM_0, CAM_ACC)
    to_end(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_end(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_end(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    block_rates(w, high, model, features, False)


@lanes
def keep_deflections(w, high, features):
    """Keep deflections, rates and accelerations of the joints that have edges, which are looked for from there."""
    if features & HAS_EDGES_1:
        for i in range(high):
            w[DEFLECTION_1_0 + i], w[DEFLECTION_RATE_1_0 + i] = w[DEFLECTION_1 + i], w[DEFLECTION_RATE_1 + i]
            w[DEFLECTION_ACC_1_0 + i] = w[DEFLECTION_ACC_1 + i]
    if features & HAS_EDGES_2:
        for i in range(high):
            w[DEFLECTION_2_0 + i], w[DEFLECTION_RATE_2_0 + i] = w[DEFLECTION_2 + i], w[DEFLECTION_RATE_2 + i]
            w[DEFLECTION_ACC_2_0 + i] = w[DEFLECTION_ACC_2 + i]
    if features & HAS_EDGES_3:
        for i in range(high):
            w[DEFLECTION_3_0 + i], w[DEFLECTION_RATE_3_0 + i] = w[DEFLECTION_3 + i], w[DEFLECTION_RATE_3 + i]
            w[DEFLECTION_ACC_3_0 + i] = w[DEFLECTION_ACC_3 + i]


@lanes
def to_second(w, high, angle, start, acc):
    """Keep state and acceleration as the step's start, and go on to the second stage's state."""
    for i in range(high):
        h, x, v, a = w[STEP + i], w[angle + i], w[angle + LANES + i], w[acc + i]
        w[start + i], w[start + LANES + i], w[acc + CAM_ACC_0 - CAM_ACC + i] = x, v, a
        w[angle + i], w[angle + LANES + i] = second(h, x, v, a)


@lanes
def to_third(w, high, angle, start, acc):
    """Keep the second stage's acceleration, and go on to the third stage's state."""
    for i in range(high):
        a0, a1 = w[acc + CAM_ACC_0 - CAM_ACC + i], w[acc + i]
        w[acc + CAM_ACC_1 - CAM_ACC + i] = a1
        w[angle + i], w[angle + LANES + i] = third(w[STEP + i], w[start + i], w[start + LANES + i], a0, a1)


@lanes
def to_fourth(w, high, angle, start, acc):
    """Keep the third stage's acceleration, and go on to the fourth stage's state."""
    for i in range(high):
        a0, a1, a2 = w[acc + CAM_ACC_0 - CAM_ACC + i], w[acc + CAM_ACC_1 - CAM_ACC + i], w[acc + i]
        w[acc + CAM_ACC_2 - CAM_ACC + i] = a2
        w[angle + i], w[angle + LANES + i] = fourth(w[STEP + i], w[start + i], w[start + LANES + i], a0, a1, a2)


@lanes
def to_end(w, high, angle, start, acc):
    """Go on to the state at the step's end."""
    for i in range(high):
        a0, a1 = w[acc + CAM_ACC_0 - CAM_ACC + i], w[acc + CAM_ACC_1 - CAM_ACC + i]
        a2, a3 = w[acc + CAM_ACC_2 - CAM_ACC + i], w[acc + i]
        w[angle + i], w[angle + LANES + i] = ended(w[STEP + i], w[start + i], w[start + LANES + i], a0, a1, a2, a3)


@lanes
def drive(w, high, share, features):
    """Put the motors where their commanded ramp has them after a share of the step, or tell those that slip the time."""
    if features & USES_SLIP:
        for i in range(high):
            w[STAGE_TIME + i] = w[TAKEN + i] + share * w[STEP + i]
    else:
        for i in range(high):
            w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
                share * w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
            )
