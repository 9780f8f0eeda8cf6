"""Floating-point operations of a turn, counted: the kernels as plain Python on numbers that count what is done to them.

`python -m benchmarks.flops` in a process with NUMBA_DISABLE_JIT=1 counts for a machine that stands on stdin.
"""

from __future__ import annotations

import operator
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from indexer_env.machine import Machine


def of_a_turn(machine: Machine, samples: int) -> float:
    """Additions, multiplications, divisions and roots in so many milliseconds from the start of a cam's index."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.flops", str(samples)], input=pickle.dumps(machine), capture_output=True,
        check=True, env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    return float(done.stdout)


class Counted(float):
    """A number whose arithmetic is counted, and whose results are such numbers again."""

    done = 0


def _counting(name: str) -> Callable[..., Any]:
    plain = getattr(float, name)

    def operation(self: Counted, *others: float) -> Any:
        Counted.done += 1
        found = plain(float(self), *(float(other) for other in others))
        return Counted(found) if isinstance(found, float) else found

    return operation


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__"))


def _quotient(above: float, below: float) -> Counted:
    """As compiled code divides: by 0 without an exception."""
    Counted.done += 1
    with np.errstate(all="ignore"):
        return Counted(np.float64(above) / np.float64(below))


Counted.__truediv__ = lambda self, other: _quotient(float(self), float(other))  # type: ignore[method-assign]
Counted.__rtruediv__ = lambda self, other: _quotient(float(other), float(self))  # type: ignore[method-assign]


class Memory:
    """A workspace whose numbers are counted."""

    def __init__(self, size: int) -> None:
        self._values = [Counted(0.0)] * size

    def __getitem__(self, index: Any) -> Counted:
        return self._values[operator.index(index)]

    def __setitem__(self, index: Any, value: Any) -> None:
        if isinstance(index, slice):
            self._values = [Counted(value)] * len(self._values)
        else:
            self._values[operator.index(index)] = Counted(value)


def _count(machine: Machine, samples: int) -> int:
    from indexer_env.coefficients import coefficients, pack
    from indexer_env.engine import LARGEST_DEFLECTION
    from indexer_env.kernels import item, layout
    from indexer_env.modes import steps_of
    from indexer_env.operating_point import OperatingPoint
    from indexer_env.run import Run

    point = OperatingPoint()
    own = coefficients(machine, point)
    packed = pack([own], [point])
    every = Run().steps_per_sample(float(steps_of([own], [point])[1][0]))
    item.run_item(
        Memory(layout.WORKSPACE), 0, packed.model, packed.features, packed.states, packed.coefficients, packed.pieces,
        np.array([samples * every]), np.array([1e-3 / every]), np.zeros(1), every, np.array([layout.TABLE_ACC]),
        LARGEST_DEFLECTION, np.zeros((1, 1, samples)), np.zeros(1, dtype=np.int64), np.zeros(1),
    )  # fmt: skip
    return Counted.done


if __name__ == "__main__":
    # the machine comes from this program's own parent
    print(_count(pickle.loads(sys.stdin.buffer.read()), int(sys.argv[1])))
