"""Samples: judging lanes whose next sample is due, and writing it."""

from __future__ import annotations

import math

from indexer_env.kernels.compiling import lanes, outlined, scalar
from indexer_env.kernels.layout import *


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
