"""Runs the compiled kernel: compile once with a word to the user, then advance packs of items."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from indexer_env import kernels
from indexer_env.coefficients import Pack
from indexer_env.kernels.layout import LANES

LARGEST_DEFLECTION = 0.5
"""rad; a joint deflected by more has left the range in which the model means anything."""

_LEAST_SHARED = 800
"""Blocks times steps from which on several threads are faster than one: to call them takes some 50 µs."""

_NOTICE_AFTER = 3.0
"""s of silence before the word that the kernel is being compiled; a cached kernel loads faster than that."""


def _fingerprint() -> str:
    """Hash of all kernel sources. numba keys its cache on the entry function's file alone; this covers its callees."""
    digest = hashlib.sha256()
    for source in sorted(Path(kernels.__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()


@functools.lru_cache(maxsize=1)
def _kernel() -> Callable[..., str]:
    from indexer_env.kernels.integrate import entry

    return entry(_fingerprint())


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
        np.asarray(n_steps, dtype=np.int64), np.asarray(steps, dtype=float), np.asarray(last_steps, dtype=float),
        every, np.asarray(rows, dtype=np.int64), LARGEST_DEFLECTION, out, status, status_time,
    )  # fmt: skip
    return out, status, status_time


def run_kernel(arguments: tuple) -> None:
    """Run the kernel over all items of its arguments, which are those of kernels.integrate.entry without the span of
    items, on all cores where that is worth it. They must have the kernel's types to the letter, since nothing is
    converted here: an environment, whose single step takes some 10 µs, calls this directly."""
    n, kernel = len(arguments[2]), _kernel()
    if n <= LANES:
        kernel(0, n, *arguments)
        return
    blocks, workers = -(-n // LANES), cores()
    if workers == 1 or blocks * int(arguments[5].max()) < _LEAST_SHARED:
        kernel(0, n, *arguments)
    else:
        share = LANES * -(-blocks // (2 * workers))
        spans = [(first, min(first + share, n)) for first in range(0, n, share)]
        list(_pool(workers).map(lambda span: kernel(*span, *arguments), spans))


@functools.cache
def _pool(workers: int) -> ThreadPoolExecutor:
    """Threads that stay: starting them costs as much as a short run."""
    return ThreadPoolExecutor(workers, thread_name_prefix="indexer_env")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads do not survive a fork


@functools.lru_cache(maxsize=1)
def control_kernels() -> tuple[Callable[..., int], Callable[..., int], Callable[..., int]]:
    """The compiled loops begin, end and look of a control period (kernels/control.py)."""
    from indexer_env.kernels.control import entries

    return entries(int(_fingerprint()[:15], 16))


def prepare_kernel(pack: Pack) -> None:
    """Have the kernel compiled or loaded, with a word to the user if that takes long enough to be noticed."""
    with _first_call:
        if getattr(_kernel(), "signatures", True):
            return
        notice = threading.Timer(_NOTICE_AFTER, _say_compiling)
        notice.daemon = True
        notice.start()
        try:
            none = np.zeros(0)
            nothing = dataclasses.replace(pack, states=pack.states[:0], coefficients=pack.coefficients[:0])
            advance(nothing, none, none, none, every=1, rows=none, samples=0)
        finally:
            notice.cancel()


def _say_compiling() -> None:
    print(
        "indexer_env: compiling the simulator, once per installation (about 20 s) …",
        file=sys.stderr,
        flush=True,
    )
