"""One control period of a fleet: what the drive is told before it, what is seen and what it is worth after it.

Plain functions of one item (begin_item, end_item, observe), and the three compiled loops over a fleet's items that call
them; the motion in between is `integrate.advance`.
"""

from __future__ import annotations

import math

from numba import njit

from .compiling import scalar
from .layout import *

OBSERVED = 7
"""Numbers in an observation."""

# columns of the table of items: nominal motor speed [rad/s], cam phase at which the dwell begins [rad], load torque
# [N m], whether the motor slips (1 or 0)
ITEM_COLUMNS = 4
NOMINAL_SPEED, DWELL_BEGIN, BASE_LOAD, SLIPS = range(ITEM_COLUMNS)

# places in the row of the task's numbers: control period [s], largest change of the command in it [share], brake torque
# at its full command [N m], limits of the observation (acceleration in the sensor's unit, table rate [rad/s], motor
# speed [share of nominal]), weight of the vibration, its scale [rad/s²], penalty of the end, and the sensor's reading
# per acceleration where it has no more than a range, 0 where it is a chain that is read elsewhere
TASK_NUMBERS = 10
(
    PERIOD, MOST_CHANGE, BRAKE, LIMIT_ACCELERATION, LIMIT_RATE, LIMIT_SPEED, WEIGHT, SCALE, PENALTY, READING,
) = range(TASK_NUMBERS)  # fmt: skip

MOST_THROUGHPUT, MOST_VIBRATION = 2.0, 4.0
"""Bounds of the reward's two terms: cams that swing in their play pass for no more."""


@scalar
def ramped(share, target, most):
    """The drive's command [share of nominal] at the period's end: the target, or as far towards it as its ramp goes."""
    change = target - share
    if change > most:
        return share + most
    if change < -most:
        return share - most
    return target


@scalar
def within(value, limit):
    """value / limit, clipped to ±1."""
    return min(max(value / limit, -1.0), 1.0)


@scalar
def observation(reading, table, table_rate, cam, motor_speed, stations, acceleration_limit, rate_limit, speed_limit):
    """What is seen of one machine: seven numbers in [-1, 1] (docs/reference/environments/indexer.md)."""
    station = stations * table
    return (
        within(reading, acceleration_limit),
        math.cos(station),
        math.sin(station),
        within(table_rate, rate_limit),
        math.cos(cam),
        math.sin(cam),
        within(motor_speed, speed_limit),
    )


@scalar
def in_dwell(cam, dwell_begin):
    """Whether the cam is in its dwell."""
    return cam - TWO_PI * math.floor(cam / TWO_PI) >= dwell_begin


@scalar
def reward(throughput, vibration, weight):
    """Throughput [share of nominal] less the weighted vibration [share of its scale], each within its bounds."""
    return min(max(throughput, 0.0), MOST_THROUGHPUT) - weight * min(vibration, MOST_VIBRATION)


@scalar
def observe(i, reading, states, coefficients, items, task, observations):
    """Write the observation of item i."""
    seen = observation(
        reading,
        states[i, TABLE // LANES],
        states[i, TABLE_RATE // LANES],
        states[i, CAM // LANES],
        states[i, MOTOR_RATE // LANES] / items[i, NOMINAL_SPEED],
        coefficients[i, STATIONS // LANES - STATE_ROWS],
        task[LIMIT_ACCELERATION],
        task[LIMIT_RATE],
        task[LIMIT_SPEED],
    )
    for k in range(OBSERVED):
        observations[i, k] = seen[k]


@scalar
def begin_item(i, actions, states, coefficients, items, task, shares, cams, status):
    """Set ramp and brake of a period of item i from actions (n, 1 or 2); shares (n,) go from its start's to its end's,
    cams (n,) [rad] keep where it began. Without slip the motor is put on its command to the last bit."""
    status[i] = RUNNING
    nominal, share = items[i, NOMINAL_SPEED], shares[i]
    reached = ramped(share, actions[i, 0], task[MOST_CHANGE])
    speed = share * nominal
    states[i, COMMAND // LANES] = speed
    if items[i, SLIPS] == 0.0:
        states[i, MOTOR_RATE // LANES] = speed
    acceleration = (reached - share) * nominal / task[PERIOD]
    coefficients[i, MOTOR_ACCELERATION // LANES - STATE_ROWS] = acceleration
    if actions.shape[1] > 1:
        load = items[i, BASE_LOAD] + actions[i, 1] * task[BRAKE]
        coefficients[i, LOAD_TORQUE // LANES - STATE_ROWS] = load
    shares[i] = reached
    cams[i] = states[i, CAM // LANES]


@scalar
def end_item(
    i, out, readings, states, coefficients, items, task, cams, status, n_steps, observations, rewards, terminated
):
    """Observation (n, OBSERVED), reward (n,) and terminated (n,) of item i after a period with samples out (n, c,
    m + 1), whose first two rows are φ̈ and α, and readings (n, m), which are filled in where the sensor is no chain. An
    item that left its range pays, keeps its observation and stands still (n_steps) until it is started anew."""
    samples = out.shape[2]
    terminated[i] = status[i] != RUNNING
    if task[READING] != 0.0:
        for sample in range(1, samples):
            limit = task[LIMIT_ACCELERATION]
            readings[i, sample - 1] = max(min(task[READING] * out[i, 0, sample], limit), -limit)
    if terminated[i]:
        rewards[i] = -task[PENALTY]
        n_steps[i] = 0
        return
    squares, count = 0.0, 0
    for sample in range(1, samples):
        if in_dwell(out[i, 1, sample], items[i, DWELL_BEGIN]):
            squares += out[i, 0, sample] * out[i, 0, sample]
            count += 1
    vibration = math.sqrt(squares / count) / task[SCALE] if count > 0 else 0.0
    way = coefficients[i, REDUCTION // LANES - STATE_ROWS] * items[i, NOMINAL_SPEED] * task[PERIOD]
    throughput = (states[i, CAM // LANES] - cams[i]) / way
    rewards[i] = reward(throughput, vibration, task[WEIGHT])
    observe(i, readings[i, samples - 2], states, coefficients, items, task, observations)


def entries(fingerprint: int):
    """The compiled loops begin, end, look; `fingerprint` stands for all kernel sources in the key of numba's cache.

    They return it, since numba keeps of a closure only what is used; as a number, which costs less than a word.
    """

    @njit(error_model="numpy", nogil=True, cache=True)
    def begin(actions, states, coefficients, items, task, shares, cams, status):
        """`begin_item` of all items."""
        for i in range(actions.shape[0]):
            begin_item(i, actions, states, coefficients, items, task, shares, cams, status)
        return fingerprint

    @njit(error_model="numpy", nogil=True, cache=True)
    def end(out, readings, states, coefficients, items, task, cams, status, n_steps, observations, rewards, terminated):
        """`end_item` of all items."""
        for i in range(out.shape[0]):
            end_item(
                i, out, readings, states, coefficients, items, task, cams, status, n_steps, observations, rewards,
                terminated,
            )  # fmt: skip
        return fingerprint

    @njit(error_model="numpy", nogil=True, cache=True)
    def look(index, readings, states, coefficients, items, task, observations):
        """Observations of items index (k,) at their start, whose last readings are readings (k, m)."""
        for k in range(index.shape[0]):
            observe(index[k], readings[k, readings.shape[1] - 1], states, coefficients, items, task, observations)
        return fingerprint

    return begin, end, look
