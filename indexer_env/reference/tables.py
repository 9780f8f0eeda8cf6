"""Tables by SciPy: tensor products of cardinal cubic splines, natural ones held at their ends or periodic ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from indexer_env.effects import TABLES

TURN = 2.0 * math.pi


def table_of(effects: Mapping[str, Any], *, moves: bool) -> Any:
    """The table among the effects that is a torque, or the one that moves the follower; None where there is none."""
    found = [effect for name, effect in effects.items() if name in TABLES and effect.moves == moves]
    return found[0] if found else None


def spline_of(table: Any) -> Callable[..., float]:
    """A table as a function of its variables, and of the number of derivatives by the first one."""
    axes, values = table.axes, table.values
    cardinals = []
    for axis in axes:
        ones = np.eye(axis.count)
        if axis.closed:
            at = np.linspace(0.0, TURN, axis.count + 1)
            cardinals.append(CubicSpline(at, np.concatenate([ones, ones[:1]]), bc_type="periodic"))
        else:
            cardinals.append(CubicSpline(np.linspace(axis.low, axis.high, axis.count), ones, bc_type="natural"))

    def spline(*xs: float, derivatives: int = 0) -> float:
        found = values
        for cardinal, axis, x in zip(cardinals, axes, xs, strict=True):
            inside = x % TURN if axis.closed else min(max(x, axis.low), axis.high)
            # the first of the axes that are left is the one that is taken
            found = cardinal(inside, derivatives if found is values else 0) @ found
        return float(found)

    return spline
