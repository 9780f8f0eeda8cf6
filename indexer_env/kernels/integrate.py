"""Blocks of lanes, by steps and by strides, and `entry`, which makes the one entry point."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .clock import go_on, load_lane, set_clock, stepped, strode
from .compiling import merged, outlined
from .dwell import mark_strides, mend_stride, move
from .edges import any_above, land, mark
from .forced import FORCES
from .layout import *
from .nystrom import nystrom_step
from .pieces import follow_pieces
from .plain import plain_step
from .recording import sample

_VECTOR = 8
"""Blocks of more than this many items are filled up to whole vectors, as what is left over one goes lane by lane."""


_LINE = 8
"""Numbers in a line of the cache, where the workspace begins: a vector across two lines takes twice as long."""


@merged
def step_block(w, high, model, features, pieces):
    """Take the lanes that are stepping over their steps, and put back those that crossed an edge. Where a lane left a
    piece of the law (1), the next one is loaded only now (see load_lane); one that landed (2) is on its own already,
    though rounding may have left its cam just before it. Numbers as from `stepped`."""
    if any_above(w, high, MARK, 0.0):
        for i in range(high):
            if w[MARK + i] == 1.0 and w[STEP + i] > 0.0:
                follow_pieces(w, i, pieces)
    if model == MODEL_B and not features & USES_ANY_EFFECT:
        plain_step(w, high, features, NO)
    elif model == MODEL_B and not features & USES_SLIP:
        plain_step(w, high, features, YES)
    else:
        nystrom_step(w, high, model, features)
    if mark(w, high, features):
        for i in range(high):
            if w[MARK + i] == 2.0 and w[STEP + i] > 0.0:
                land(w, i, model, features, pieces)
    return stepped(w, high)


@merged
def stride_block(w, high, features):
    """Take the lanes in their dwell over a stride. Numbers as from `strode`."""
    if features & FORCES:
        move(w, high, features, YES)
    else:
        move(w, high, features, NO)
    if mark_strides(w, high, features):
        for i in range(high):
            if w[MARK + i] == 2.0 and mend_stride(w, i, features):
                w[MARK + i] = 0.0
    return strode(w, high)


@outlined
def load_block(w, block, width, high, states, coefficients, pieces, n_steps, steps, every, model, features):
    """Fill the lanes from items block … block+width-1; idle lanes repeat the last item and stand still. The largest
    number of steps."""
    w[:] = 0.0
    longest = 0
    for i in range(high):
        w[LEFT + i], w[TO_SAMPLE + i] = math.inf, math.inf
        item = block + int(min(i, width - ONE))
        load_lane(w, i, states[item], coefficients[item], pieces, model, features)
        if i < width:
            set_clock(w, i, steps[item], n_steps[item], every)
            longest = max(longest, n_steps[item])
    return longest


@outlined
def unload_block(w, block, width, longest, states, every, rows, out):
    """Hand out the states; what the longest item's samples have more than another's repeats its last values."""
    samples = out.shape[2]
    for i in range(width):
        for row in range(STATE_ROWS):
            states[block + i, row] = w[np.uint64(row) * LANES + i]
        for number in range(int(w[SAMPLE + i]), min(longest // every + 1, samples)):
            for c in range(rows.shape[0]):
                out[block + i, c, number] = w[np.uint64(rows[c]) + i]
        for number in range(longest // every + 1, samples):
            for c in range(rows.shape[0]):
                out[block + i, c, number] = math.nan


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

        As long as a lane of a block steps, those in their dwell wait; then all that are in theirs stride until none
        does.
        """
        memory = np.empty(WORKSPACE + _LINE)
        w = memory[(-memory.ctypes.data // memory.itemsize) % _LINE :]
        for block in range(first, stop, int(LANES)):
            count = min(int(LANES), stop - block)
            filled = count if count <= _VECTOR else -(-count // _VECTOR) * _VECTOR
            width, high = np.uint64(count), np.uint64(filled)
            longest = load_block(
                w, block, width, high, states, coefficients, pieces, n_steps, steps, every, model, features
            )
            due, see, striding = width, width, False
            while True:
                if due > 0 and sample(w, block, width, high, every, limit, rows, out, status, status_time):
                    see = width
                if see > 0:
                    for i in range(width):
                        if w[SEE + i] > 0.0:
                            go_on(w, i, block + i, last_steps[block + i], limit, status, status_time, features)
                    stepping, strides = any_above(w, high, STEP, 0.0), any_above(w, high, STRIDE_TIME, 0.0)
                    if not (stepping or strides):
                        break
                    striding = strides and (striding or not stepping)
                if striding:
                    due, see = stride_block(w, high, features)
                else:
                    due, see = step_block(w, high, model, features, pieces)
            unload_block(w, block, width, longest, states, every, rows, out)
        return fingerprint

    return advance
