"""Compiled loops over windows' samples, each in place and in one pass."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numba import njit


@njit(error_model="numpy", nogil=True, cache=True)
def _subtract(rows, measured, window):
    for i in range(rows.shape[0]):
        own = measured[window[i]]
        for j in range(rows.shape[1]):
            rows[i, j] -= own[j]


@njit(error_model="numpy", nogil=True, cache=True)
def _weigh(rows, factors, counts):
    for i in range(rows.shape[0]):
        factor = factors[i]
        for j in range(counts[i]):
            rows[i, j] *= factor
        rows[i, counts[i] :] = 0.0


@functools.lru_cache(maxsize=1)
def loops() -> tuple[Callable[[np.ndarray, np.ndarray, np.ndarray], None], ...]:
    """Subtract the rows `window` (k,) of measured readings (w, n) from others (k, n); multiply rows (k, n) by factors
    (k,), and make them 0 beyond their counts (k,)."""
    from indexer_env.compiled import one_version, read_only

    rows, places, factors = np.zeros((0, 0)), read_only(0, dtype=np.int64), read_only(0)
    one_version(
        "the search's loops", 1, (_subtract, (rows, read_only(0, 0), places)), (_weigh, (rows, factors, places))
    )
    return _subtract, _weigh
