"""The kernels that a GPU is given: a thread for each item.

Arrays are of any strides; the callers lay them out with the item's index fastest, so that neighbouring threads read
neighbouring words. `order` (m,) names the items that run, those of like features side by side.
"""

# pyright: reportMissingImports=false, reportCallIssue=false
# The neighbours stand in another folder (__init__), and numba gives `cuda.grid` its argument.

from __future__ import annotations

import math

from numba import boolean, cuda, float32, float64, int64, void

from .control import begin_item, end_item, observe
from .item import run_item
from .layout import *

SMALLEST = 2.2250738585072014e-308
"""Below it doubles lose digits; in place of a size of 0."""


def advance(
    order, models, features, states, coefficients, pieces, n_steps, steps, last_steps, every, rows, limit, out, status,
    status_time,
):  # fmt: skip
    """Advance the items `order`; models and features (n,) of each, the others as in kernels.integrate.entry."""
    place = cuda.grid(1)
    if place < order.size:
        item = order[place]
        w = cuda.local.array(WORKSPACE, float64)
        run_item(
            w, item, models[item], features[item], states, coefficients, pieces, n_steps, steps, last_steps, every,
            rows, limit, out, status, status_time,
        )  # fmt: skip


def begin(order, actions, states, coefficients, items, task, shares, cams, status):
    """kernels.control.begin_item of the items `order`."""
    place = cuda.grid(1)
    if place < order.size:
        begin_item(order[place], actions, states, coefficients, items, task, shares, cams, status)


def end(
    order, out, readings, states, coefficients, items, task, cams, status, n_steps, observations, rewards, terminated
):
    """kernels.control.end_item of the items `order`."""
    place = cuda.grid(1)
    if place < order.size:
        end_item(
            order[place], out, readings, states, coefficients, items, task, cams, status, n_steps, observations,
            rewards, terminated,
        )  # fmt: skip


def look(order, readings, states, coefficients, items, task, observations):
    """Observations of the items `order` (k,) at their start, whose last readings are readings (n, m)."""
    place = cuda.grid(1)
    if place < order.size:
        item = order[place]
        observe(item, readings[item, readings.shape[1] - 1], states, coefficients, items, task, observations)


def chain(order, sections, states, readings):
    """Readings (k, m) of rows `order` (k,) of a sensor, in place through its second-order sections (s, 6), whose states
    (n, s, 2) go on (direct form II transposed)."""
    place = cuda.grid(1)
    if place < order.size:
        row = order[place]
        for k in range(readings.shape[1]):
            x = readings[place, k]
            for s in range(sections.shape[0]):
                y = sections[s, 0] * x + states[row, s, 0]
                states[row, s, 0] = sections[s, 1] * x - sections[s, 4] * y + states[row, s, 1]
                states[row, s, 1] = sections[s, 2] * x - sections[s, 5] * y
                x = y
            readings[place, k] = x


def differ(previous, present, first, stop, difference):
    """Relative rms difference (n,) of two turns' records (n, samples) between samples first (n,) and stop (n,), summed
    term after term; NaN where first >= stop."""
    item = cuda.grid(1)
    if item < difference.size:
        change, size = 0.0, 0.0
        for k in range(first[item], stop[item]):
            apart = present[item, k] - previous[item, k]
            change += apart * apart
            size += present[item, k] * present[item, k]
        difference[item] = (
            math.sqrt(change / max(size, 2.2250738585072014e-308)) if first[item] < stop[item] else math.nan
        )


_NUMBERS, _COUNTS, _TABLE, _SAMPLES, _SEEN = float64[:], int64[:], float64[:, :], float64[:, :, :], float32[:, :]

SIGNATURES = {
    advance: void(
        _COUNTS, _COUNTS, _COUNTS, _TABLE, _TABLE, _TABLE, _COUNTS, _NUMBERS, _NUMBERS, int64, _COUNTS, float64,
        _SAMPLES, _COUNTS, _NUMBERS,
    ),
    begin: void(_COUNTS, _TABLE, _TABLE, _TABLE, _TABLE, _NUMBERS, _NUMBERS, _NUMBERS, _COUNTS),
    end: void(
        _COUNTS, _SAMPLES, _TABLE, _TABLE, _TABLE, _TABLE, _NUMBERS, _NUMBERS, _COUNTS, _COUNTS, _SEEN, _NUMBERS,
        boolean[:],
    ),
    look: void(_COUNTS, _TABLE, _TABLE, _TABLE, _TABLE, _NUMBERS, _SEEN),
    chain: void(_COUNTS, _TABLE, _SAMPLES, _TABLE),
    differ: void(_TABLE, _TABLE, _COUNTS, _COUNTS, _NUMBERS),
}  # fmt: skip
"""Each kernel with the one set of types that it is compiled for."""
