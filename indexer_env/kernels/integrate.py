"""Blocks of lanes, by steps and by strides, and `entry`, which makes the one entry point.

A lane has a clock of its own: those in a linear dwell wait until all are in theirs, then go through it by strides.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from indexer_env.kernels.alone import choose_stride, follow_pieces, see_to
from indexer_env.kernels.compiling import lanes, outlined
from indexer_env.kernels.dwell import mark_strides, mend_stride, move
from indexer_env.kernels.edges import find_piece, load_piece, mark, set_lines, settle_regions
from indexer_env.kernels.layout import *
from indexer_env.kernels.rates import state_rates
from indexer_env.kernels.recording import sample_block
from indexer_env.kernels.rk4 import rk4

_NARROW = 6
"""Up to so many items are taken lane by lane, which is faster than a whole block for few; the numbers are the same."""


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
    elif state[REGION_1 // LANES] < -1.0:
        settle_regions(w, i, features)
        state_rates(w, i, False, model, features, True)


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
        piece is looked up; with region_1 < -1 the regions follow from the state, with region_1 > 1 the table is put on
        its law before.
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
