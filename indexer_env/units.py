"""Units of the shop in SI units; everything inside is SI and radians."""

from __future__ import annotations

import math
from typing import NamedTuple

RPM = 2.0 * math.pi / 60.0
"""One turn a minute [rad/s]."""

DEGREE = math.pi / 180.0
"""One degree [rad]."""


class ShopUnit(NamedTuple):
    """A unit of the shop: its factor to the SI unit, the name of that and its own."""

    factor: float
    si: str
    name: str


ENDINGS = {"_deg": ShopUnit(DEGREE, "rad", "deg"), "_rpm": ShopUnit(RPM, "rad/s", "rpm")}
"""Endings of keys in units of the shop; the field without the ending is in the SI unit."""


def at_cam(motor_angle: float, reduction: float) -> float:
    """An angle at the motor shaft as the cam shaft sees it [rad]; `reduction` are cam turns per motor turn."""
    return motor_angle * reduction
