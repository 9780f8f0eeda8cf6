"""Whole steps of lanes and blocks, edges and pieces included, and `entry`, which makes the one entry point."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from indexer_env.kernels.compiling import lanes, outlined, scalar
from indexer_env.kernels.edges import (
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

_MOST_EDGES = 16
"""Edges landed on within one step; beyond that (contact that chatters faster than the step) the rest of the step is
taken on the present lines and the regions are set from the state reached."""


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
def mend(w, i, model, features, pieces):
    """Repeat the step of a lane that crossed edges, landing on each of them."""
    whole = rest = w[STEP + i]
    command = w[COMMAND + i]
    for _ in range(_MOST_EDGES):
        share, which, deflection = find_edge(w, i, rest, features)
        landing = share * rest
        restore_start(w, i)
        one_lane_step(w, i, landing, model, features)
        cross(w, i, which, deflection, pieces)
        w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * landing
        w[STAGE_TIME + i] = 0.0
        state_rates(w, i, False, model, features, True)
        rest -= landing
        one_lane_step(w, i, rest, model, features)
        if not crossed(w, i, features):
            break
    else:
        settle_regions(w, i, features)
        find_piece(w, i, pieces)
        state_rates(w, i, False, model, features, True)
    w[STEP + i] = whole
    w[COMMAND + i] = command


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
        sound = (
            (largest_deflection(w, i) <= limit)
            & (abs(w[TABLE_ACC + i]) < math.inf)
            & (abs(w[CAM_ACC + i]) < math.inf)
            & (abs(w[HOUSING_ACC + i]) < math.inf)
            & (abs(w[MOTOR_RATE + i]) < math.inf)
        )
        good += 1 if sound else 0
    return good < LANES


@outlined
def stop_faulty(w, block, width, limit, status, status_time):
    """Give the lanes that left the physical range their status and time, and let them stand still."""
    for i in range(width):
        if status[block + i] != RUNNING:
            continue
        total = abs(w[TABLE_ACC + i]) + abs(w[CAM_ACC + i]) + abs(w[HOUSING_ACC + i]) + abs(w[MOTOR_RATE + i])
        total += abs(w[DEFLECTION_1 + i]) + abs(w[DEFLECTION_2 + i]) + abs(w[DEFLECTION_3 + i])
        if not math.isfinite(total):
            status[block + i] = NOT_FINITE
        elif largest_deflection(w, i) > limit:
            status[block + i] = OUT_OF_RANGE
        if status[block + i] != RUNNING:
            status_time[block + i] = w[TIME + i]
            w[STEP + i] = 0.0


@outlined
def step_lane(w, i, model, features, pieces):
    """Take lane i alone over its step, edges and pieces included."""
    follow_pieces(w, i, pieces)
    one_lane_step(w, i, w[STEP + i], model, features)
    if crossed(w, i, features):
        mend(w, i, model, features, pieces)


@lanes
def step_block(w, width, model, features, pieces, marked):
    """Take all lanes over their steps; the few that crossed an edge or left their piece are seen to one by one. Returns
    whether any did; with `marked`, some did in the step before, and their pieces are loaded only now (see load_lane).
    """
    if marked:
        for i in range(width):
            if w[MARK + i] > 0.0 and w[STEP + i] > 0.0:
                follow_pieces(w, i, pieces)
    rk4(w, FIRST_LANE, LANES, model, features)
    marked = mark(w, features)
    if marked:
        for i in range(width):
            if w[MARK + i] == 2.0 and w[STEP + i] > 0.0:
                mend(w, i, model, features, pieces)
    return marked


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
            w[:] = 0.0
            marked = True
            shortest = longest = n_steps[block]
            for i in range(LANES if width > _NARROW else width):
                item = block + min(i, width - 1)  # idle lanes repeat the last item and stand still
                load_lane(w, i, states[item], coefficients[item], pieces, model, features)
                shortest, longest = min(shortest, n_steps[item]), max(longest, n_steps[item])
                w[STEP + i] = steps[item] if i < width and n_steps[item] > 0 else 0.0
            for step in range(longest + 1):
                if step % every == 0:
                    sample = step // every
                    if any_fault(w, limit):
                        stop_faulty(w, block, width, limit, status, status_time)
                    if sample < samples:
                        for c in range(rows.shape[0]):
                            for i in range(width):
                                out[block + i, c, sample] = w[rows[c] + i]
                if step >= shortest:
                    for i in range(width):
                        item = block + i
                        if step == n_steps[item] and status[item] == RUNNING:
                            w[STEP + i] = last_steps[item]
                        elif step > n_steps[item]:
                            w[STEP + i] = 0.0
                if width > _NARROW:
                    marked = step_block(w, width, model, features, pieces, marked)
                else:
                    for i in range(width):
                        if w[STEP + i] > 0.0:
                            step_lane(w, i, model, features, pieces)
                for i in range(LANES):
                    w[TIME + i] += w[STEP + i]
                    w[COMMAND + i] += w[MOTOR_ACCELERATION + i] * w[STEP + i]
            for i in range(width):
                for row in range(STATE_ROWS):
                    states[block + i, row] = w[row * LANES + i]
            out[block : block + width, :, longest // every + 1 :] = math.nan
        return fingerprint

    return advance
