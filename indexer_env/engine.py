"""Runs the compiled kernel: advances packs of items."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from indexer_env.coefficients import Pack
from indexer_env.kernels.layout import COEFFICIENT_ROWS, LANES, PIECE_COLUMNS, STATE_ROWS

LARGEST_DEFLECTION = 0.5
"""rad; a joint deflected by more has left the range in which the model means anything."""

_BLOCK = int(LANES)

_LEAST_SHARED = 800
"""Blocks times steps from which on several threads are faster than one: to call them takes some 50 µs."""


@functools.lru_cache(maxsize=1)
def _kernel() -> Callable[..., str]:
    from indexer_env.compiled import kernel_fingerprint, one_version, read_only
    from indexer_env.kernels.integrate import entry

    counts, times, status = read_only(0, dtype=np.int64), read_only(0), np.zeros(0, dtype=np.int64)
    nothing = (
        0, 0, 0, 0, np.zeros((0, STATE_ROWS)), read_only(0, COEFFICIENT_ROWS), read_only(0, PIECE_COLUMNS),
        counts, times, times, 1, counts, LARGEST_DEFLECTION, np.zeros((0, 0, 0)), status, np.zeros(0),
    )  # fmt: skip
    kernel = entry(kernel_fingerprint())
    one_version("the simulator", 20, (kernel, nothing))
    return kernel


_first_call = threading.Lock()


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def advance(
    pack: Pack,
    n_steps: np.ndarray,
    steps: np.ndarray,
    last_steps: np.ndarray,
    *,
    every: int,
    rows: np.ndarray,
    samples: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Advance all items of a pack in place, each by n_steps whole steps and one last step, on this thread. The kernel
    lets other threads run meanwhile.

    Parameters
    ----------
    pack : Pack
        Its states are advanced.
    n_steps, steps, last_steps : ndarray (n,)
        Whole steps, their length [s] and the length of the one after them [s].
    every : int
        Steps from sample to sample; samples fall at steps 0, every, 2·every …
    rows : ndarray (c,) of int
        Workspace rows to record (kernels/layout.py).
    samples : int
        Samples to keep.

    Returns
    -------
    out : ndarray (n, c, samples)
    status : ndarray (n,) of int
        layout.RUNNING, NOT_FINITE or OUT_OF_RANGE.
    status_time : ndarray (n,)
        Time at which a faulty item was stopped [s].
    """
    n = len(pack.states)
    out = np.empty((n, len(rows), samples))
    status, status_time = np.zeros(n, dtype=np.int64), np.zeros(n)
    _kernel()(
        0, n, pack.model, pack.features, pack.states, pack.coefficients, pack.pieces,
        np.ascontiguousarray(n_steps, np.int64), *(np.ascontiguousarray(each, float) for each in (steps, last_steps)),
        every, np.ascontiguousarray(rows, np.int64), LARGEST_DEFLECTION, out, status, status_time,
    )  # fmt: skip
    return out, status, status_time


def run_kernel(arguments: tuple) -> None:
    """Run the kernel over all items of its arguments, which are those of kernels.integrate.entry without the span of
    items, on all cores where that is worth it. They must have the kernel's types to the letter, since nothing is
    converted here: an environment, whose single step takes some 10 µs, calls this directly."""
    n, kernel = len(arguments[2]), _kernel()
    if n <= _BLOCK:
        kernel(0, n, *arguments)
        return
    blocks, workers = -(-n // _BLOCK), cores()
    if workers == 1 or blocks * int(arguments[5].max()) < _LEAST_SHARED:
        kernel(0, n, *arguments)
    else:
        share = _BLOCK * -(-blocks // (2 * workers))
        spans = iter([(first, min(first + share, n)) for first in range(0, n, share)])

        def work() -> None:
            for span in spans:
                kernel(*span, *arguments)

        # this thread works too: a call of the kernel may be over before another has woken up
        others = [_pool(workers - 1).submit(work) for _ in range(workers - 1)]
        try:
            work()
        finally:
            # one that was broken off leaves nobody who still writes
            for _ in spans:
                pass
            for other in others:
                other.result()


@functools.cache
def _pool(workers: int) -> ThreadPoolExecutor:
    """Threads that stay: starting them costs as much as a short run."""
    return ThreadPoolExecutor(workers, thread_name_prefix="indexer_env")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads do not survive a fork


@functools.lru_cache(maxsize=1)
def control_kernels() -> tuple[Callable[..., int], Callable[..., int], Callable[..., int]]:
    """The compiled loops begin, end and look of a control period (kernels/control.py)."""
    from indexer_env.compiled import kernel_fingerprint, one_version, read_only
    from indexer_env.kernels.control import ITEM_COLUMNS, OBSERVED, TASK_NUMBERS, entries

    states, coefficients = np.zeros((0, STATE_ROWS)), np.zeros((0, COEFFICIENT_ROWS))
    numbers, counts, seen = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, OBSERVED), dtype=np.float32)
    items, task, cams, readings = read_only(0, ITEM_COLUMNS), read_only(TASK_NUMBERS), read_only(0), np.zeros((0, 1))
    read = (read_only(0, STATE_ROWS), read_only(0, COEFFICIENT_ROWS), items, task)
    status, index, terminated = read_only(0, dtype=np.int64), read_only(0, dtype=np.int64), np.zeros(0, dtype=bool)
    begin, end, look = entries(int(kernel_fingerprint()[:15], 16))
    one_version(
        "the environments' loops", 2,
        (begin, (read_only(0, 1), states, coefficients, items, task, numbers, numbers, counts)),
        (end, (read_only(0, 2, 1), readings, *read, cams, status, counts, seen, numbers, terminated)),
        (look, (index, read_only(0, 1), *read, seen)),
    )  # fmt: skip
    return begin, end, look


def prepare_kernel() -> None:
    """Have the kernel loaded or compiled, before threads share it."""
    with _first_call:
        _kernel()
