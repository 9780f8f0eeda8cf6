"""One step of classical RK4 of a whole block or of one lane, every joint on its present line."""

from __future__ import annotations

from indexer_env.kernels.compiling import lanes
from indexer_env.kernels.layout import *
from indexer_env.kernels.plain import plain_step, ramp, rk4_sum
from indexer_env.kernels.rates import stage_rates, state_rates


@lanes
def first_stage(w, low, high, model, features):
    """Keep state and accelerations as the step's start, and go on to the second stage's state."""
    first_stage_pair(w, low, high, CAM, CAM_0, CAM_ACC)
    first_stage_pair(w, low, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        first_stage_pair(w, low, high, HOUSING, HOUSING_0, HOUSING_ACC)
    first_stage_pair(w, low, high, MOTOR, MOTOR_0, MOTOR_ACC)
    if not features & USES_SLIP:
        drive(w, low, high, 0.5)
    for i in range(low, high):
        w[STAGE_TIME + i] = 0.5 * w[STEP + i]


@lanes
def first_stage_pair(w, low, high, angle, start, acc):
    for i in range(low, high):
        h, x, v, a = 0.5 * w[STEP + i], w[angle + i], w[angle + LANES + i], w[acc + i]
        w[start + i], w[start + LANES + i], w[acc + CAM_ACC_0 - CAM_ACC + i] = x, v, a
        w[angle + i] = x + h * v
        w[angle + LANES + i] = v + h * a


@lanes
def drive(w, low, high, share):
    """Put the motors where their commanded ramp has them after a share of the step."""
    for i in range(low, high):
        w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
            share * w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
        )


@lanes
def stage(w, low, high, model, features, share, kept):
    """Keep the present stage's accelerations in the rows `kept`, and go on to the next stage's state with its rates."""
    stage_pair(w, low, high, share, CAM, CAM_0, CAM_ACC, kept)
    stage_pair(w, low, high, share, TABLE, TABLE_0, TABLE_ACC, kept)
    if model == MODEL_B_ON_BASE:
        stage_pair(w, low, high, share, HOUSING, HOUSING_0, HOUSING_ACC, kept)
    if features & USES_SLIP:
        stage_pair(w, low, high, share, MOTOR, MOTOR_0, MOTOR_ACC, kept)
    elif share == 1.0:
        drive(w, low, high, share)
    for i in range(low, high):
        w[STAGE_TIME + i] = share * w[STEP + i]


@lanes
def stage_pair(w, low, high, share, angle, start, acc, kept):
    for i in range(low, high):
        h, a = share * w[STEP + i], w[acc + i]
        w[kept + acc - CAM_ACC + i] = a
        w[angle + i] = w[start + i] + h * w[angle + LANES + i]
        w[angle + LANES + i] = w[start + LANES + i] + h * a


@lanes
def finish(w, low, high, model, features):
    """State at the step's end from the four stages' accelerations."""
    finish_pair(w, low, high, CAM, CAM_0, CAM_ACC)
    finish_pair(w, low, high, TABLE, TABLE_0, TABLE_ACC)
    if model == MODEL_B_ON_BASE:
        finish_pair(w, low, high, HOUSING, HOUSING_0, HOUSING_ACC)
    if features & USES_SLIP:
        finish_pair(w, low, high, MOTOR, MOTOR_0, MOTOR_ACC)
    for i in range(low, high):
        w[STAGE_TIME + i] = w[STEP + i]


@lanes
def finish_pair(w, low, high, angle, start, acc):
    kept_0, kept_1, kept_2 = acc + CAM_ACC_0 - CAM_ACC, acc + CAM_ACC_1 - CAM_ACC, acc + CAM_ACC_2 - CAM_ACC
    for i in range(low, high):
        w[angle + i], w[angle + LANES + i] = rk4_sum(
            w[STEP + i],
            w[start + i],
            w[start + LANES + i],
            w[kept_0 + i],
            w[kept_1 + i] + w[kept_2 + i],
            w[acc + i],
        )


@lanes
def rk4(w, low, high, model, features):
    """One step of classical RK4 over w[STEP] from the present state, whose accelerations are at hand, to the state
    reached and its accelerations. `low`, `high` are the whole block or one lane."""
    if model == MODEL_B and not features & USES_ANY_EFFECT:
        plain_step(w, low, high)
    else:
        rk4_parts(w, low, high, model, features)


@lanes
def rk4_parts(w, low, high, model, features):
    """The step for every model and effect, stage by stage through the workspace. A motor that does not slip stands at
    the same angle in both middle stages, and in the last one where the step ends, so what depends on it is worked out
    once for both."""
    whole = high - low == LANES
    first_stage(w, low, high, model, features)
    stage_rates(w, low, whole, model, features, True)
    stage(w, low, high, model, features, 0.5, CAM_ACC_1)
    stage_rates(w, low, whole, model, features, False)
    stage(w, low, high, model, features, 1.0, CAM_ACC_2)
    stage_rates(w, low, whole, model, features, True)
    finish(w, low, high, model, features)
    state_rates(w, low, whole, model, features, False)
