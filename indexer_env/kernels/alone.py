"""One lane on its own: over edges, through its dwell, to its samples and its end."""

from __future__ import annotations

import math

from indexer_env.kernels.compiling import outlined
from indexer_env.kernels.dwell import LARGEST_STRIDE, mark_strides, mend_stride, move, move_part, set_stride
from indexer_env.kernels.edges import (
    LAW_HIGH,
    MOST_EDGES,
    cross,
    crossed,
    find_edge,
    find_piece,
    load_piece,
    settle_regions,
)
from indexer_env.kernels.layout import *
from indexer_env.kernels.rates import state_rates
from indexer_env.kernels.recording import sample_lane
from indexer_env.kernels.rk4 import rk4


@outlined
def one_lane_step(w, i, step, model, features):
    """Take lane i alone over a step of its own length."""
    w[STEP + i] = step
    rk4(w, i, i + 1, model, features)


@outlined
def restore_start(w, i):
    """Put lane i back to the start of its step."""
    for row in range(8):
        w[CAM + row * LANES + i] = w[CAM_0 + row * LANES + i]
    for row in range(4):
        w[CAM_ACC + row * LANES + i] = w[CAM_ACC_0 + row * LANES + i]


@outlined
def go_on(w, i, rest, tried, model, features, pieces):
    """Take lane i over the time `rest`, landing on every edge in it. With `tried` the block took the step already, and
    it crossed one."""
    whole, command = w[STEP + i], w[COMMAND + i]
    edges, landing, which, deflection = 0, -1.0, LAW_HIGH, 0.0
    while True:
        if landing < 0.0 and w[DWELLS + i] > 0.0 and edges < MOST_EDGES:
            left = move_part(w, i, rest, features, pieces)
            w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * (rest - left)
            rest, edges = left, edges + 1
            if rest == 0.0:
                break
            state_rates(w, i, False, model, features, True)
            continue
        if not tried:
            one_lane_step(w, i, landing if landing >= 0.0 else rest, model, features)
        tried = False
        if landing >= 0.0:
            cross(w, i, which, deflection, pieces)
            w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * landing
            rest, landing = rest - landing, -1.0
        elif not crossed(w, i, features):
            break
        elif edges < MOST_EDGES:
            share, which, deflection = find_edge(w, i, rest, features)
            landing, edges = share * rest, edges + 1
            restore_start(w, i)
            continue
        else:
            settle_regions(w, i, features)
            find_piece(w, i, pieces)
            rest = 0.0
        w[STAGE_TIME + i] = 0.0
        state_rates(w, i, False, model, features, True)
        if rest == 0.0:
            break
    w[STEP + i], w[COMMAND + i] = whole, command


@outlined
def follow_pieces(w, i, pieces):
    """Load the law's piece that the cam has reached. Smooth junctions need no landing and no new rates: the two
    polynomials agree there far below the step's error. A cam that jumped further (a run about to be rejected) is looked
    up, never walked to."""
    piece, turn = int(w[PIECE + i]), w[CAM_TURN + i]
    if w[CAM + i] >= w[REACH_HIGH + i]:
        load_piece(w, i, piece + 1, turn, pieces)
    elif w[CAM + i] < w[REACH_LOW + i]:
        load_piece(w, i, piece - 1, turn, pieces)
    if w[CAM + i] >= w[REACH_HIGH + i] or w[CAM + i] < w[REACH_LOW + i]:
        find_piece(w, i, pieces)


@outlined
def see_to(w, i, alone, wide, item, every, limit, rows, out, status, status_time, last, model, features, pieces):
    """Take lane i over `alone` steps on its own (the first has been tried where it is stepping), then see how it goes
    on: in its dwell by strides, as soon as they fall on its samples and as long as they fit; else by steps, behind a
    dwell from a sample on, so that lanes are recorded together, until none is left but the last, shorter one. A lane of
    a narrow block goes to its end alone."""
    step, stride = w[OWN_STEP + i], w[STRIDE + i]
    w[ALONE + i] = -1.0
    in_step = w[STEP + i] > 0.0
    tried = alone > 0.0 and in_step
    ending = False
    while True:
        if alone == 0.0:
            if w[TO_SAMPLE + i] == 0.0:
                sample_lane(w, i, item, every, limit, rows, out, status, status_time)
            if status[item] != RUNNING:
                break
            ending = w[LEFT + i] == 0.0
            if ending and last == 0.0:
                break
            strides = w[DWELLS + i] > 0.0 and w[TO_SAMPLE + i] % stride == 0.0 and w[LEFT + i] >= stride
            if wide and strides:
                set_stride(w, i, stride * step)
                w[STEP + i] = 0.0
                return
            in_step = in_step and w[DWELLS + i] == 0.0
            if wide and w[DWELLS + i] == 0.0 and not ending and (in_step or w[TO_SAMPLE + i] == every):
                w[STEP + i], w[STRIDE_TIME + i], w[MARK + i] = step, 0.0, 1.0
                return
            if strides:
                set_stride(w, i, stride * step)
                move(w, i, i + 1)
                if mark_strides(w, i, i + 1, features) and not mend_stride(w, i, features):
                    alone = stride
                else:
                    w[TIME + i] += w[STRIDE_TIME + i]
                    w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * w[STRIDE_TIME + i]
                    w[LEFT + i] -= stride
                    w[TO_SAMPLE + i] -= stride
                    continue
        length = last if ending else step
        if not tried:
            follow_pieces(w, i, pieces)
        go_on(w, i, length, tried, model, features, pieces)
        tried = False
        w[TIME + i] += length
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * length
        if ending:
            break
        w[LEFT + i] -= 1.0
        w[TO_SAMPLE + i] -= 1.0
        alone = max(alone - 1.0, 0.0)
    w[STEP + i], w[STRIDE_TIME + i], w[LEFT + i], w[TO_SAMPLE + i] = 0.0, 0.0, math.inf, math.inf


@outlined
def choose_stride(w, i, every):
    """Steps in a stride of lane i: the most that divide a sampling interval and keep the phase of its oscillators, on
    the stiffer flanks, within LARGEST_STRIDE."""
    frequency = math.sqrt(max(w[K_1 + i] / w[J_CAM + i], w[K_2 + i] / w[J_TABLE + i]))
    most = LARGEST_STRIDE / (frequency * w[OWN_STEP + i])
    stride = every
    while stride > 1 and (every % stride != 0 or stride > most):
        stride -= 1
    w[STRIDE + i] = float(stride)
