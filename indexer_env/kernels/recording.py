"""Samples: judging lanes whose next sample is due, and writing it."""

from __future__ import annotations

import math

import numpy as np

from .compiling import lanes, outlined, scalar
from .layout import *


@scalar
def largest_deflection(w, i):
    return max(max(abs(w[DEFLECTION_1 + i]), abs(w[DEFLECTION_2 + i])), abs(w[DEFLECTION_3 + i]))


@lanes
def any_fault(w, high, limit):
    """Whether a lane has left the physical range or is no longer finite (NaN fails every comparison)."""
    good = 0
    for i in range(high):
        good += 1 if sound(w, i, limit) else 0
    return good < high


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
def judge(w, i, item, limit, status, status_time):
    """Note what is wrong with lane i, if anything; it is then to be stopped."""
    if status[item] == RUNNING and not sound(w, i, limit):
        total = abs(w[TABLE_ACC + i]) + abs(w[CAM_ACC + i]) + abs(w[HOUSING_ACC + i]) + abs(w[MOTOR_RATE + i])
        status[item] = OUT_OF_RANGE if math.isfinite(total + largest_deflection(w, i)) else NOT_FINITE
        status_time[item] = w[TIME + i]
        w[SEE + i] = 1.0


@lanes
def sample(w, block, width, high, every, limit, rows, out, status, status_time):
    """Judge and record the lanes whose next sample is due. Whether one of them is faulty."""
    faulty = any_fault(w, high, limit)
    if faulty:
        for i in range(width):
            if w[TO_SAMPLE + i] == 0.0:
                judge(w, i, block + i, limit, status, status_time)
    for c in range(rows.shape[0]):
        for i in range(width):
            if w[TO_SAMPLE + i] == 0.0 and w[SAMPLE + i] < out.shape[2]:
                # unsigned, or each index would be looked at whether it counts from the end
                out[np.uint64(block + i), np.uint64(c), np.uint64(int(w[SAMPLE + i]))] = w[np.uint64(rows[c]) + i]
    for i in range(high):
        due = w[TO_SAMPLE + i] == 0.0
        w[SAMPLE + i] += 1.0 if due else 0.0
        w[TO_SAMPLE + i] = float(every) if due else w[TO_SAMPLE + i]
    return faulty
