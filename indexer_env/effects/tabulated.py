"""Tables, not laws: a missing torque as a spline over one variable, as it was read off records.

They are in `TABLES` and not in `EFFECTS`: a machine, a campaign or a second look takes them by name like any effect,
but no search proposes one, as a table fits whatever it is given and explains nothing.
"""

from __future__ import annotations

import functools
import math
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from indexer_env.effects.base import TABLES, MachineEffect, parameter
from indexer_env.errors import refuse
from indexer_env.kernels.layout import USES_TABLE

if TYPE_CHECKING:
    from indexer_env.machine import Machine

PLACES = 9
"""Places at which a table gives its torque."""

_LINE = (1.0, 4.0, 1.0)
"""Six times what a uniform cubic B-spline's coefficients give at the middle one's knot."""


@functools.cache
def coefficients_of_values(*, closed: bool) -> np.ndarray:
    """Matrix (11, 9) from a spline's values at its places to its B-spline coefficients: natural, with one more knot at
    each end, or closed, its last two coefficients unused."""
    if closed:
        places = np.arange(PLACES)
        values = np.zeros((PLACES, PLACES))
        for share, step in zip(_LINE, (-1, 0, 1), strict=True):
            values[places, (places + step) % PLACES] = share
        return np.concatenate([6.0 * np.linalg.inv(values), np.zeros((2, PLACES))])
    values = np.zeros((PLACES + 2, PLACES + 2))
    for k in range(PLACES):
        values[k, k : k + 3] = _LINE
    # no curvature at both ends
    values[PLACES, :3] = values[PLACES + 1, -3:] = (1.0, -2.0, 1.0)
    return 6.0 * np.linalg.inv(values)[:, :PLACES]


@dataclass(frozen=True)
class Tabulated(MachineEffect):
    """A torque against the table over one variable: a cubic spline through nine values, evenly spaced."""

    source = "de Boor, A Practical Guide to Splines (1978), chapters IX to XI"
    enters = "table torque"
    feature = USES_TABLE
    over: ClassVar[int] = 0
    """Number of the variable in the kernel."""
    closed: ClassVar[bool] = False
    """Whether it is an angle, whose turn the table covers; else it goes from `low` to `high` and is constant beyond."""

    torque_1: float = parameter("torque at the first place", "N m", null=0.0)
    torque_2: float = parameter("torque at the second place", "N m", null=0.0)
    torque_3: float = parameter("torque at the third place", "N m", null=0.0)
    torque_4: float = parameter("torque at the fourth place", "N m", null=0.0)
    torque_5: float = parameter("torque at the fifth place", "N m", null=0.0)
    torque_6: float = parameter("torque at the sixth place", "N m", null=0.0)
    torque_7: float = parameter("torque at the seventh place", "N m", null=0.0)
    torque_8: float = parameter("torque at the eighth place", "N m", null=0.0)
    torque_9: float = parameter("torque at the ninth place", "N m", null=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.reach
        if not low < high:
            raise refuse(self.name, "high", f"above low, {low:g}", high)

    @property
    def reach(self) -> tuple[float, float]:
        """Values of the variable at the first place and at the last one; a turn's end is its first place again."""
        return 0.0, 2.0 * math.pi * (1.0 - 1.0 / PLACES)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        if coefficients["tabulated_over"] >= 0.0:
            rule, remedy = "the only table of a machine", "leave out all tables but one"
            raise refuse("Machine", "effects", rule, self.name, remedy)
        values = [getattr(self, f"torque_{k}") for k in range(1, PLACES + 1)]
        low, high = self.reach
        per = (PLACES - 1) / (high - low)
        coefficients["tabulated_over"] = float(self.over)
        coefficients["tabulated_closed"] = float(self.closed)
        coefficients["tabulated_per"] = per
        coefficients["tabulated_first"] = (0.0 if self.closed else 1.0) - per * low
        for k, value in enumerate(coefficients_of_values(closed=self.closed) @ values):
            coefficients[f"tabulated_{k}"] = float(value)


def _table(effect: type[Tabulated]) -> type[Tabulated]:
    TABLES[effect.name] = effect
    return effect


@_table
@dataclass(frozen=True)
class OverSpeed(Tabulated):
    """A torque over the table's speed [rad/s]."""

    name = "tabulated.speed"
    sentence = "A torque that is tabulated over the table's speed acts on the table: a table, not a law."
    equation = "T_L += spline(φ̇), from `low` to `high` [rad/s]"
    over = 0

    low: float = parameter("value at the first place", "rad/s")
    high: float = parameter("value at the last place", "rad/s")

    @property
    def reach(self) -> tuple[float, float]:
        return self.low, self.high


@_table
@dataclass(frozen=True)
class OverAngle(Tabulated):
    """A torque over a turn of the table."""

    name = "tabulated.angle"
    sentence = "A torque that is tabulated over a turn of the table acts on it: a table, not a law."
    equation = "T_L += spline(φ), closed over 2π"
    over = 1
    closed = True


@_table
@dataclass(frozen=True)
class OverCam(Tabulated):
    """A torque over a turn of the cam."""

    name = "tabulated.cam"
    sentence = "A torque that is tabulated over a turn of the cam acts on the table: a table, not a law."
    equation = "T_L += spline(α), closed over 2π"
    over = 2
    closed = True


@_table
@dataclass(frozen=True)
class OverDeflection(Tabulated):
    """A torque over the output joint's deflection [rad]."""

    name = "tabulated.deflection"
    sentence = "A torque that is tabulated over the output joint's deflection acts on the table: a table, not a law."
    equation = "T_L += spline(δ2), from `low` to `high` [rad]"
    over = 3

    low: float = parameter("value at the first place", "rad")
    high: float = parameter("value at the last place", "rad")

    @property
    def reach(self) -> tuple[float, float]:
        return self.low, self.high
