"""Compiled entry points: one version of each, and a word to the user before it is made."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import event
from numba.core.dispatcher import Dispatcher

from indexer_env import kernels

Call = tuple[Callable[..., Any], tuple]
"""A function decorated by numba's njit with cache=True, and arguments with which a call of it does nothing."""


def one_version(name: str, seconds: int, *calls: Call) -> None:
    """Load or compile functions for the types of these arguments, and for no others.

    For each new combination of types (an int for a float, an array that is read-only or not contiguous) numba would
    compile another version without a word. Here a call with other types raises TypeError. A read-only array among the
    arguments stands for both kinds.

    Parameters
    ----------
    name : str
        What the functions are, for the word on stderr; it comes where numba's cache does not hold one of them.
    seconds : int
        How long a free processor takes to compile them [s].
    calls : Call
        Plain functions, as under NUMBA_DISABLE_JIT=1, are left alone.
    """
    compiled = [(kernel, arguments) for kernel, arguments in calls if isinstance(kernel, Dispatcher)]
    text = f"indexer_env: compiling {name}, once per installation ({seconds} s on a free processor) …"
    with event.install_listener("numba:compile", _Word([kernel for kernel, _ in compiled], text)):
        for kernel, arguments in compiled:
            kernel(*arguments)
            kernel.disable_compile()


def fingerprint(sources: Iterable[Path]) -> str:
    """Hash of these files. numba keys its cache on the file of a compiled function alone; a function that returns this
    hash as a value of its closure is compiled anew where one of those that it calls has changed."""
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()


def kernel_fingerprint(*more: Path) -> str:
    """Fingerprint of all kernel sources, and of these files."""
    return fingerprint([*Path(kernels.__file__).parent.glob("*.py"), *more])


def read_only(*shape: int, dtype: type = float) -> np.ndarray:
    """Zeros of this shape that cannot be written."""
    zeros = np.zeros(shape, dtype=dtype)
    zeros.flags.writeable = False
    return zeros


class _Word(event.Listener):
    """Says once that functions are being compiled. numba starts the event when its cache does not hold a function."""

    def __init__(self, kernels: list[Dispatcher], text: str) -> None:
        self._kernels, self._text = kernels, text

    def on_start(self, event: event.Event) -> None:
        if self._text and (event.data or {}).get("dispatcher") in self._kernels:
            print(self._text, file=sys.stderr, flush=True)
            self._text = ""

    def on_end(self, event: event.Event) -> None:
        pass
