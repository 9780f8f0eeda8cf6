"""A lane's own clock: loaded, on its way by steps or by strides, ended.

Lanes wait for nobody but where a dwell begins: behind an edge a lane takes the rest of its step while its neighbours
take whole ones.
"""

from __future__ import annotations

import math

import numpy as np

from .compiling import lanes, outlined
from .dwell import LARGEST_STRIDE, begin_strides
from .edges import settle_regions
from .layout import *
from .pieces import find_piece, load_piece, set_lines, set_turn
from .rates import lane_rates
from .recording import judge


@outlined
def load_lane(w, i, state, coefficients, pieces, model, features):
    """Fill lane i from an item's state and coefficients.

    The state holds the piece on which its accelerations were evaluated, even where its cam has just left that: they
    come out as they were, and a run in parts has the bits of a run in one.
    """
    for row in range(STATE_ROWS):
        w[np.uint64(row) * LANES + i] = state[row]
    for row in range(COEFFICIENT_ROWS):
        w[np.uint64(STATE_ROWS + row) * LANES + i] = coefficients[row]
    w[MESH_FACTOR + i] = 1.0
    w[STATION_RATIO_2 + i] = -1.0
    w[MARK + i] = 1.0
    if w[PIECE + i] < 0.0:
        find_piece(w, i, pieces)
    else:
        set_turn(w, i, w[CAM_TURN + i], pieces)
        load_piece(w, i, int(w[PIECE + i]), pieces)
    set_lines(w, i)
    lane_rates(w, i, model, features)
    if state[REGION_1 // LANES] > 1.0:
        w[TABLE + i], w[TABLE_RATE + i] = 0.0, 0.0
        lane_rates(w, i, model, features)
        w[TABLE + i], w[TABLE_RATE + i] = -w[DEFLECTION_2 + i], -w[DEFLECTION_RATE_2 + i]
        lane_rates(w, i, model, features)
    if abs(state[REGION_1 // LANES]) > 1.0:
        settle_regions(w, i, features)
        lane_rates(w, i, model, features)


@outlined
def set_clock(w, i, step, n_steps, every):
    """Start lane i on its steps. Its strides are of the most steps that divide a sampling interval and keep the phase
    of its oscillators, on the stiffer flanks, and of the harmonics of its drive within LARGEST_STRIDE."""
    w[OWN_STEP + i], w[LEFT + i], w[TO_SAMPLE + i], w[SEE + i] = step, float(n_steps), 0.0, 1.0
    stiffness_1 = w[K_1 + i] / (1.0 - w[MESH_FRICTION + i])
    frequency = math.sqrt(max(stiffness_1 / w[J_CAM + i], w[K_2 + i] / w[J_TABLE + i]))
    for amplitude, order in ((RIPPLE_AMPLITUDE, RIPPLE_ORDER), (TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER)):
        if w[amplitude + i] != 0.0:
            frequency = max(frequency, abs(w[order + i] * w[MOTOR_RATE + i]))
    most = LARGEST_STRIDE / (frequency * step)
    stride = every
    while stride > 1 and (every % stride != 0 or stride > most):
        stride -= 1
    w[STRIDE + i] = float(stride)


@lanes
def stepped(w, high):
    """Put the clocks of the lanes on that have taken a whole step; those that landed on an edge have a rest of theirs
    to take. How many samples are due and how many lanes are to be seen to."""
    due, see = 0, 0
    for i in range(high):
        whole = w[STEP + i] > 0.0 and w[MARK + i] != 2.0
        time, one = (w[OWN_STEP + i], 1.0) if whole else (0.0, 0.0)
        w[TIME + i] += time
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * time
        left, to_sample = w[LEFT + i] - one, w[TO_SAMPLE + i] - one
        w[LEFT + i], w[TO_SAMPLE + i] = left, to_sample
        w[STEP + i] = w[OWN_STEP + i] if whole else w[STEP + i]
        w[TAKEN + i] = 0.0 if whole else w[TAKEN + i]
        w[EDGES + i] = 0.0 if whole else w[EDGES + i]
        seen = whole and (left <= 0.0 or w[DWELLS + i] > 0.0)
        w[SEE + i] = 1.0 if seen else 0.0
        due += 1 if to_sample == 0.0 else 0
        see += 1 if seen else 0
    return due, see


@lanes
def strode(w, high):
    """Put the clocks of the lanes on that have taken a stride; those that could not go on by steps. Numbers as from
    `stepped`."""
    due, see = 0, 0
    for i in range(high):
        strides = w[STRIDE_TIME + i] > 0.0
        whole = strides and w[MARK + i] != 2.0
        time, steps = (w[STRIDE_TIME + i], w[STRIDE + i]) if whole else (0.0, 0.0)
        w[TIME + i] += time
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * time
        left, to_sample = w[LEFT + i] - steps, w[TO_SAMPLE + i] - steps
        w[LEFT + i], w[TO_SAMPLE + i] = left, to_sample
        ends = strides and not whole
        w[STEP + i] = w[OWN_STEP + i] if ends else w[STEP + i]
        w[STRIDE_TIME + i] = 0.0 if ends else w[STRIDE_TIME + i]
        seen = ends or (whole and left < w[STRIDE + i])
        w[SEE + i] = 1.0 if whole and left < w[STRIDE + i] else 0.0
        due += 1 if to_sample == 0.0 else 0
        see += 1 if seen else 0
    return due, see


@outlined
def go_on(w, i, item, last, limit, status, status_time, features):
    """How lane i, which stands between two steps, goes on: in its dwell by strides, as soon as they fall on its samples
    and as long as they fit; else by steps, until none is left but the last, shorter one."""
    w[SEE + i] = 0.0
    if w[LEFT + i] <= 0.0 and (last == 0.0 or w[LEFT + i] < 0.0):
        judge(w, i, item, limit, status, status_time)
        w[LEFT + i] = math.inf
    if status[item] != RUNNING or w[LEFT + i] == math.inf:
        w[STEP + i], w[STRIDE_TIME + i], w[LEFT + i], w[TO_SAMPLE + i] = 0.0, 0.0, math.inf, math.inf
    elif w[LEFT + i] == 0.0:
        w[OWN_STEP + i], w[STEP + i], w[STRIDE_TIME + i], w[TO_SAMPLE + i] = last, last, 0.0, math.inf
    elif w[DWELLS + i] > 0.0 and w[TO_SAMPLE + i] % w[STRIDE + i] == 0.0 and w[LEFT + i] >= w[STRIDE + i]:
        if w[STRIDE_TIME + i] == 0.0:
            begin_strides(w, i, features)
    else:
        w[STEP + i], w[STRIDE_TIME + i] = w[OWN_STEP + i], 0.0
