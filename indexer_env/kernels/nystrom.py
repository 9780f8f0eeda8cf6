"""One step of a Runge-Kutta-Nyström scheme: four evaluations, each joint on its present line.

Stages at 0, 1/4, 1/2 and 1 of the step; the rates follow the Runge-Kutta scheme of fourth order with these nodes. The
angles of the stages have weights of their own, which also meet the conditions of fifth order by which angles act on
themselves: b·Ā c² = 1/60 and b·c Ā c = 1/30 (Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I,
section II.14). So what a stiffness does to fifth order only a damper keeps at fourth: a lightly damped machine has some
sixty times less error than with classical RK4 at the same cost.
"""

from __future__ import annotations

from .compiling import lanes, merged, scalar
from .drive import RIPPLES, begin_ripples, ripple_between
from .interpolation import ramp
from .layout import *
from .rates import block_rates

NODE_2, NODE_3 = 0.25, 0.5
"""Shares of the step at which the second and third stage lie; the fourth lies at its end."""


@scalar
def second(h, x, v, a0):
    """Angle and rate at the second stage, from those at the step's start and the acceleration there."""
    return x + h * (0.25 * v + h * (1.0 / 32.0 * a0)), v + h * (0.25 * a0)


@scalar
def third(h, x, v, a0, a1):
    """Angle and rate at the third stage."""
    return x + h * (0.5 * v + h * (1.0 / 40.0 * a0 + 1.0 / 10.0 * a1)), v + h * (0.5 * a1)


@scalar
def fourth(h, x, v, a0, a1, a2):
    """Angle and rate at the fourth stage."""
    return x + h * (v + h * (1.0 / 5.0 * a0 + 3.0 / 10.0 * a2)), v + h * (a0 + 2.0 * (a2 - a1))


@scalar
def ended(h, x, v, a0, a2, a3):
    """Angle and rate at the step's end; the second stage has the weight 0."""
    return x + h * (v + h * (1.0 / 6.0 * a0 + 1.0 / 3.0 * a2)), v + h * (1.0 / 6.0 * (a0 + a3) + 2.0 / 3.0 * a2)


@merged
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
    if features & RIPPLES and not features & USES_SLIP:
        begin_ripples(w, high, features)
    drive(w, high, NODE_2, features)
    block_rates(w, high, model, features)
    to_third(w, high, CAM, CAM_0, CAM_ACC)
    to_third(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_third(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_third(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    drive(w, high, NODE_3, features)
    block_rates(w, high, model, features)
    to_fourth(w, high, CAM, CAM_0, CAM_ACC)
    to_fourth(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_fourth(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_fourth(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    drive(w, high, 1.0, features)
    block_rates(w, high, model, features)
    to_end(w, high, CAM, CAM_0, CAM_ACC)
    to_end(w, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        to_end(w, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        to_end(w, high, MOTOR, MOTOR_0, MOTOR_ACC)
    block_rates(w, high, model, features)


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
        a0, a2, a3 = w[acc + CAM_ACC_0 - CAM_ACC + i], w[acc + CAM_ACC_2 - CAM_ACC + i], w[acc + i]
        w[angle + i], w[angle + LANES + i] = ended(w[STEP + i], w[start + i], w[start + LANES + i], a0, a2, a3)


@lanes
def drive(w, high, share, features):
    """Put the motors, and what ripples on them, where they are after a share of the step, or tell those that slip the
    time."""
    if features & USES_SLIP:
        for i in range(high):
            w[STAGE_TIME + i] = w[TAKEN + i] + share * w[STEP + i]
    else:
        for i in range(high):
            w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
                share * w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
            )
        if features & RIPPLES:
            ripple_between(w, high, share)
