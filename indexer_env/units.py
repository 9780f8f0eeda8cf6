"""Units of the shop in SI units; everything inside is SI and radians."""

from __future__ import annotations

import math
from typing import NamedTuple

RPM = 2.0 * math.pi / 60.0
"""One turn a minute [rad/s]."""

DEGREE = math.pi / 180.0
"""One degree [rad]."""


class ShopUnit(NamedTuple):
    """A unit of the shop: its factor to the SI unit, the name of that and its own, and how the names of fields end that
    it measures."""

    factor: float
    si: str
    name: str
    fields: tuple[str, ...]

    def measures(self, field: str, stated: str | None = None) -> bool:
        """Whether a field is in its SI unit: by the unit that the field states, else by the field's name."""
        return stated == self.si if stated is not None else field.endswith(self.fields)


ENDINGS = {
    "_deg": ShopUnit(DEGREE, "rad", "deg", ("angle", "phase", "backlash", "backlash_per_joule", "start_uncertainty")),
    "_rpm": ShopUnit(RPM, "rad/s", "rpm", ("speed", "smoothing")),
}
"""Endings of keys in units of the shop; the field without the ending is in the SI unit."""


def behind_number(unit: str) -> str:
    """A unit as it stands behind a number: " N m", and "" where it is "-"."""
    return "" if unit == "-" else f" {unit}"


def at_cam(motor_angle: float, reduction: float) -> float:
    """An angle at the motor shaft as the cam shaft sees it [rad]; `reduction` are cam turns per motor turn."""
    return motor_angle * reduction
