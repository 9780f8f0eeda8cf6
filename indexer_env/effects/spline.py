"""Cubic splines through values at evenly spaced places, over one variable or two, as numbers for the kernels."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.kernels.layout import LARGEST_TABLE

NUMBERS = 9 + LARGEST_TABLE
"""Numbers of a spline."""

_LINE = (1.0, 4.0, 1.0)
"""Six times what a uniform cubic B-spline's coefficients give at the middle one's knot."""


@dataclass(frozen=True)
class Axis:
    """A variable and the places along it.

    Attributes
    ----------
    count : int
        Places, evenly spaced.
    low, high : float
        The first place and the last one, beyond which the spline is constant; of a turn its begin and its end, which is
        the first place again.
    closed : bool
        Whether it is a turn.
    """

    count: int
    low: float = 0.0
    high: float = 2.0 * math.pi
    closed: bool = False

    @property
    def places(self) -> np.ndarray:
        """(count,)"""
        return np.linspace(self.low, self.high, self.count, endpoint=not self.closed)


@functools.cache
def _coefficients(count: int, closed: bool) -> np.ndarray:
    """Matrix (k, count) from a spline's values to its B-spline coefficients, in the order in which the kernel takes
    them: without curvature at its ends and with one more knot beyond each, or closed."""
    if closed:
        places = np.arange(count)
        values = np.zeros((count, count))
        for share, step in zip(_LINE, (-1, 0, 1), strict=True):
            values[places, (places + step) % count] = share
        return np.roll(6.0 * np.linalg.inv(values), 1, axis=0)
    values = np.zeros((count + 2, count + 2))
    for k in range(count):
        values[k, k : k + 3] = _LINE
    values[count, :3] = values[count + 1, -3:] = (1.0, -2.0, 1.0)
    return 6.0 * np.linalg.inv(values)[:, :count]


_NO_AXIS = (0.0, 0.0, 4.0, 0.0)
"""Numbers of the second variable that a spline over one does not have; its stride of 0 says that they do not count."""


def spline_numbers(axes: Sequence[Axis], values: Sequence[float]) -> list[float]:
    """A spline as `kernels.effects.tabulated` takes it, filled up with zeros to the largest one: of each variable the
    place of 0, places in a unit, number of coefficients and whether it is closed; the distance of two rows of
    coefficients; these. Values of the last variable stand side by side."""
    grid = np.reshape(values, [axis.count for axis in axes])
    numbers: list[float] = []
    for n, axis in enumerate(axes):
        matrix = _coefficients(axis.count, axis.closed)
        grid = np.moveaxis(np.tensordot(matrix, grid, (1, n)), 0, n)
        per = (axis.count - (0 if axis.closed else 1)) / (axis.high - axis.low)
        numbers += [-per * axis.low, per, float(len(matrix)), float(axis.closed)]
    if len(axes) == 1:
        numbers += _NO_AXIS
    stride = len(grid) if len(axes) == 2 else 0
    coefficients = grid.T.ravel().tolist()
    return [*numbers, float(stride), *coefficients, *[0.0] * (LARGEST_TABLE - len(coefficients))]
