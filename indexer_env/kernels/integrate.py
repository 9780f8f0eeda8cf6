"""Whole steps of lanes and blocks, edges and pieces included, and `entry`, which makes the one entry point."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from indexer_env.kernels.compiling import lanes, outlined, scalar
from indexer_env.kernels.dwell import LARGEST_STRIDE, mark_strides, mend_stride, move, move_part, set_stride
from indexer_env.kernels.edges import (
    LAW_HIGH,
    MOST_EDGES,
    cross,
    crossed,
    find_edge,
    find_piece,
    load_piece,
    mark,
    set_lines,
    settle_regions,
)
from indexer_env.kernels.layout import *
from indexer_env.kernels.rates import state_rates
from indexer_env.kernels.rk4 import rk4

_NARROW = 6
"""Up to so many items are taken lane by lane, which is faster than a whole block for few; the numbers are the same."""


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


@scalar
def largest_deflection(w, i):
    return max(max(abs(w[DEFLECTION_1 + i]), abs(w[DEFLECTION_2 + i])), abs(w[DEFLECTION_3 + i]))


@lanes
def any_fault(w, limit):
    """Whether a lane has left the physical range or is no longer finite (NaN fails every comparison)."""
    good = 0
    for i in range(LANES):
        good += 1 if sound(w, i, limit) else 0
    return good < LANES


@scalar
def sound(w, i, limit):
    return (
        (largest_deflection(w, i) <= limit)
        & (abs(w[TABLE_ACC + i]) < math.inf)
        & (abs(w[CAM_ACC + i]) < math.inf)
        & (abs(w[HOUSING_ACC + i]) < math.inf)
        & (abs(w[MOTOR_RATE + i]) < math.inf)
    )


@outlined
def fault(w, i):
    """What is wrong with lane i, whose state is not sound."""
    total = abs(w[TABLE_ACC + i]) + abs(w[CAM_ACC + i]) + abs(w[HOUSING_ACC + i]) + abs(w[MOTOR_RATE + i])
    return OUT_OF_RANGE if math.isfinite(total + largest_deflection(w, i)) else NOT_FINITE


@outlined
def sample_lane(w, i, item, every, limit, rows, out, status, status_time):
    """Judge and record lane i, whose next sample is due."""
    if status[item] == RUNNING and not sound(w, i, limit):
        status[item], status_time[item] = fault(w, i), w[TIME + i]
    number = int(w[SAMPLE + i])
    if number < out.shape[2]:
        for c in range(rows.shape[0]):
            out[item, c, number] = w[rows[c] + i]
    w[SAMPLE + i] += 1.0
    w[TO_SAMPLE + i] = float(every)


@lanes
def sample_block(w, block, width, every, limit, rows, out, status, status_time):
    """Judge and record the lanes whose next sample is due."""
    samples = out.shape[2]
    if any_fault(w, limit):
        for i in range(width):
            if w[TO_SAMPLE + i] == 0.0:
                sample_lane(w, i, block + i, every, limit, rows, out, status, status_time)
                w[ALONE + i] = w[ALONE + i] if status[block + i] == RUNNING else 0.0
    for c in range(rows.shape[0]):
        for i in range(width):
            if w[TO_SAMPLE + i] == 0.0 and w[SAMPLE + i] < samples:
                out[block + i, c, int(w[SAMPLE + i])] = w[rows[c] + i]
    for i in range(LANES):
        due = w[TO_SAMPLE + i] == 0.0
        w[SAMPLE + i] += 1.0 if due else 0.0
        w[TO_SAMPLE + i] = float(every) if due else w[TO_SAMPLE + i]


@lanes
def any_above(w, row, bound):
    """Whether a value of a row is above a bound; counted, since a largest value would be looked for one by one."""
    count = 0
    for i in range(LANES):
        count += 1 if w[row + i] > bound else 0
    return count > 0


@lanes
def any_zero(w, row):
    """Whether a value of a row is zero."""
    count = 0
    for i in range(LANES):
        count += 1 if w[row + i] == 0.0 else 0
    return count > 0


@lanes
def step_block(w, width, model, features, pieces, marked):
    """Take the lanes that are stepping over their steps; those that crossed an edge repeat it alone. Returns whether
    any crossed one or left its piece; with `marked`, some did in the step before, and their pieces are loaded only now
    (see load_lane)."""
    if marked:
        for i in range(width):
            if w[MARK + i] > 0.0 and w[STEP + i] > 0.0:
                follow_pieces(w, i, pieces)
    rk4(w, FIRST_LANE, LANES, model, features)
    marked = mark(w, features)
    for i in range(LANES):
        step = w[STEP + i]
        stepping = step > 0.0
        crossing = stepping and w[MARK + i] == 2.0
        moved = 1.0 if stepping and not crossing else 0.0
        w[TIME + i] += moved * step
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * (moved * step)
        w[LEFT + i] -= moved
        w[TO_SAMPLE + i] -= moved
        ended = 0.0 if stepping and w[LEFT + i] == 0.0 else -1.0
        w[ALONE + i] = 1.0 if crossing else ended
    return marked


@lanes
def stride_block(w, model, features):
    """Take the lanes in their dwell over a stride; those that crossed an edge repeat it step by step."""
    move(w, FIRST_LANE, LANES)
    if mark_strides(w, FIRST_LANE, LANES, features):
        for i in range(LANES):
            if w[MARK + i] == 2.0 and mend_stride(w, i, features):
                w[MARK + i] = 0.0
    for i in range(LANES):
        time = w[STRIDE_TIME + i]
        striding = time > 0.0
        crossing = striding and w[MARK + i] == 2.0
        moved = w[STRIDE + i] if striding and not crossing else 0.0
        time = time if striding and not crossing else 0.0
        w[TIME + i] += time
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * time
        w[LEFT + i] -= moved
        w[TO_SAMPLE + i] -= moved
        ended = 0.0 if striding and w[LEFT + i] < w[STRIDE + i] else -1.0
        w[ALONE + i] = w[STRIDE + i] if crossing else ended


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


@outlined
def put_on_law(w, i, model, features):
    """Start the table of lane i on its law, with whatever effects shape it: joint 2 undeflected and at rest."""
    w[TABLE + i], w[TABLE_RATE + i] = 0.0, 0.0
    state_rates(w, i, False, model, features, True)
    w[TABLE + i], w[TABLE_RATE + i] = -w[DEFLECTION_2 + i], -w[DEFLECTION_RATE_2 + i]
    state_rates(w, i, False, model, features, True)
    settle_regions(w, i, features)
    state_rates(w, i, False, model, features, True)


@outlined
def load_lane(w, i, state, coefficients, pieces, model, features):
    """Fill lane i from an item's state and coefficients.

    The state holds the piece on which its accelerations were evaluated, even where its cam has just left that: they
    come out as they were, and a run in parts has the bits of a run in one.
    """
    for row in range(STATE_ROWS):
        w[row * LANES + i] = state[row]
    for row in range(COEFFICIENT_ROWS):
        w[(STATE_ROWS + row) * LANES + i] = coefficients[row]
    w[MESH_FACTOR + i] = 1.0
    w[STATION_RATIO_2 + i] = -1.0
    w[MARK + i] = 1.0
    if w[PIECE + i] < 0.0:
        find_piece(w, i, pieces)
    else:
        load_piece(w, i, int(w[PIECE + i]), w[CAM_TURN + i], pieces)
    set_lines(w, i)
    state_rates(w, i, False, model, features, True)
    if state[REGION_1 // LANES] > 1.0:
        put_on_law(w, i, model, features)


def entry(fingerprint: str):
    """The compiled entry point; `fingerprint` stands for all kernel sources in the key of numba's cache."""

    @njit(error_model="numpy", nogil=True, cache=True)
    def advance(
        first,
        stop,
        model,
        features,
        states,
        coefficients,
        pieces,
        n_steps,
        steps,
        last_steps,
        every,
        rows,
        limit,
        out,
        status,
        status_time,
    ):
        """Advance items first … stop-1 in place.

        states (n, STATE_ROWS) and coefficients (n, COEFFICIENT_ROWS) in layout's order; with piece < 0 the law's
        piece is looked up, with region_1 > 1 the table is put on its law and the regions follow from the state.
        n_steps (n,) whole steps of steps (n,) [s] are taken, then one of last_steps (n,). Every `every` steps the
        workspace rows `rows` (c,) go to out (n, c, samples) until it is full; samples that no step reaches are NaN.
        status (n,) tells RUNNING, NOT_FINITE or OUT_OF_RANGE (deflection beyond `limit` [rad]), status_time (n,)
        when; such a lane stops.
        """
        w = np.empty(WORKSPACE)
        samples = out.shape[2]
        for block in range(first, stop, LANES):
            width = min(LANES, stop - block)
            wide = width > _NARROW
            w[:] = 0.0
            w[LEFT : LEFT + LANES] = math.inf
            w[TO_SAMPLE : TO_SAMPLE + LANES] = math.inf
            w[ALONE : ALONE + LANES] = -1.0
            longest = 0
            for i in range(LANES if wide else width):
                item = block + min(i, width - 1)  # idle lanes repeat the last item and stand still
                load_lane(w, i, states[item], coefficients[item], pieces, model, features)
                if i < width:
                    longest = max(longest, n_steps[item])
                    w[OWN_STEP + i], w[LEFT + i], w[TO_SAMPLE + i] = steps[item], float(n_steps[item]), 0.0
                    w[ALONE + i] = 0.0
                    choose_stride(w, i, every)
            marked, striding = True, False
            while True:
                if any_above(w, ALONE, -0.5):
                    marked = True
                    for i in range(width):
                        if w[ALONE + i] >= 0.0:
                            see_to(
                                w, i, w[ALONE + i], wide, block + i, every, limit, rows, out, status, status_time,
                                last_steps[block + i], model, features, pieces,
                            )  # fmt: skip
                stepping, strides = any_above(w, STEP, 0.0), any_above(w, STRIDE_TIME, 0.0)
                if not (stepping or strides):
                    break
                striding = strides if striding else not stepping
                if striding:
                    stride_block(w, model, features)
                    marked = True
                else:
                    marked = step_block(w, width, model, features, pieces, marked)
                if any_zero(w, TO_SAMPLE):
                    sample_block(w, block, width, every, limit, rows, out, status, status_time)
            for i in range(width):
                for row in range(STATE_ROWS):
                    states[block + i, row] = w[row * LANES + i]
                for number in range(int(w[SAMPLE + i]), min(longest // every + 1, samples)):
                    for c in range(rows.shape[0]):
                        out[block + i, c, number] = w[rows[c] + i]
            out[block : block + width, :, longest // every + 1 :] = math.nan
        return fingerprint

    return advance
