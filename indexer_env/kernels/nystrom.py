"""One step of Nyström's scheme: four evaluations, each joint on its present line.

Stages at 0, 1/5, 2/3 and 1 of the step. The angles take Nyström's weights of fifth order for ẍ = f(t, x) (Nyström 1925;
Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, table II.14.1), the rates those of the Runge-Kutta
scheme of fourth order with the same nodes. So forces that depend on rates are met to fourth order and all others to
fifth: a lightly damped machine has some fifty times less error than with classical RK4 at the same cost.
"""

from __future__ import annotations

import numpy as np

from indexer_env.kernels.compiling import lanes, scalar
from indexer_env.kernels.layout import *
from indexer_env.kernels.rates import rates

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
    the present state, whose accelerations are at hand, to the state reached and its accelerations."""
    for row in range(DEFLECTIONS):
        place = np.uint64(row) * LANES
        for i in range(high):
            w[DEFLECTION_1_0 + place + i] = w[DEFLECTION_1 + place + i]
    for number in range(1, 5):
        stage(w, high, number, CAM, CAM_0, CAM_ACC)
        stage(w, high, number, TABLE, TABLE_0, TABLE_ACC)
        if model == MODEL_B_ON_BASE:
            stage(w, high, number, HOUSING, HOUSING_0, HOUSING_ACC)
        if features & USES_SLIP:
            stage(w, high, number, MOTOR, MOTOR_0, MOTOR_ACC)
        else:
            drive(w, high, number)
        for i in range(high):
            share = NODE_2 if number == 1 else (NODE_3 if number == 2 else 1.0)
            w[STAGE_TIME + i] = w[TAKEN + i] + share * w[STEP + i]
        rates(w, FIRST_LANE, high, model, features, number < 4)


@lanes
def stage(w, high, number, angle, start, acc):
    """Go on from stage `number` to the state of the next one, or of the step's end; the accelerations of the stages
    before are kept."""
    first, second_, third_ = acc + CAM_ACC_0 - CAM_ACC, acc + CAM_ACC_1 - CAM_ACC, acc + CAM_ACC_2 - CAM_ACC
    if number == 1:
        for i in range(high):
            x, v, a = w[angle + i], w[angle + LANES + i], w[acc + i]
            w[start + i], w[start + LANES + i], w[first + i] = x, v, a
            w[angle + i], w[angle + LANES + i] = second(w[STEP + i], x, v, a)
    elif number == 2:
        for i in range(high):
            a = w[acc + i]
            w[second_ + i] = a
            w[angle + i], w[angle + LANES + i] = third(
                w[STEP + i], w[start + i], w[start + LANES + i], w[first + i], a
            )
    elif number == 3:
        for i in range(high):
            a = w[acc + i]
            w[third_ + i] = a
            w[angle + i], w[angle + LANES + i] = fourth(
                w[STEP + i], w[start + i], w[start + LANES + i], w[first + i], w[second_ + i], a
            )
    else:
        for i in range(high):
            w[angle + i], w[angle + LANES + i] = ended(
                w[STEP + i], w[start + i], w[start + LANES + i], w[first + i], w[second_ + i], w[third_ + i], w[acc + i]
            )


@lanes
def drive(w, high, number):
    """Put the motors where their commanded ramp has them at the next stage."""
    if number == 1:
        for i in range(high):
            w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACC_0 + i] = w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACC + i]
    share = NODE_2 if number == 1 else (NODE_3 if number == 2 else 1.0)
    if number < 4:
        for i in range(high):
            w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
                share * w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
            )
