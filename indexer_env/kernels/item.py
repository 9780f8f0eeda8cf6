"""One item alone, from load to unload: what a thread of a GPU does with its workspace of one lane.

The same functions as in `integrate`, so the same steps, strides and landings. Two loops take turns here, one of steps
and one of strides, so that threads side by side meet again behind each: those that reached their dwell wait until their
neighbours did, and none goes through the other kind of work idly.
"""

from __future__ import annotations

from .clock import go_on
from .compiling import lanes, outlined
from .integrate import load_block, step_block, stride_block, unload_block
from .layout import *
from .recording import sample

ENDED, STEPS, STRIDES_ON = 0, 1, 2
"""How an item goes on."""


@outlined
def due_work(w, item, due, see, last, every, limit, rows, out, status, status_time, features):
    """Record the lane where a sample is due, and see to it where it is to be seen to; how it goes on."""
    if due > 0 and sample(w, item, ONE, ONE, every, limit, rows, out, status, status_time):
        see = 1
    if see > 0 and w[SEE] > 0.0:
        go_on(w, FIRST_LANE, item, last, limit, status, status_time, features)
    if w[STEP] > 0.0:
        return STEPS
    return STRIDES_ON if w[STRIDE_TIME] > 0.0 else ENDED


@lanes
def run_item(
    w, item, model, features, states, coefficients, pieces, n_steps, steps, last_steps, every, rows, limit, out, status,
    status_time,
):  # fmt: skip
    """Advance one item in place, with the arguments of `integrate.entry`; w (WORKSPACE,) is its own."""
    longest = load_block(w, item, ONE, ONE, states, coefficients, pieces, n_steps, steps, every, model, features)
    last = last_steps[item]
    on = due_work(w, item, 1, 1, last, every, limit, rows, out, status, status_time, features)
    while on != ENDED:
        while on == STEPS:
            due, see = step_block(w, ONE, model, features, pieces)
            on = due_work(w, item, due, see, last, every, limit, rows, out, status, status_time, features)
        while on == STRIDES_ON:
            due, see = stride_block(w, ONE, features)
            on = due_work(w, item, due, see, last, every, limit, rows, out, status, status_time, features)
    unload_block(w, item, ONE, longest, states, every, rows, out)
