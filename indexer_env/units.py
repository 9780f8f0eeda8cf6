"""Units of the shop in SI units; everything inside is SI and radians."""

from __future__ import annotations

import math

RPM = 2.0 * math.pi / 60.0
"""One turn a minute [rad/s]."""

DEGREE = math.pi / 180.0
"""One degree [rad]."""

ENDINGS = {"_deg": DEGREE, "_rpm": RPM}
"""Endings of keys in the shop's units, and the factor to the SI unit of the field without the ending."""


def at_cam(motor_angle: float, reduction: float) -> float:
    """An angle at the motor shaft as the cam shaft sees it [rad]; `reduction` are cam turns per motor turn."""
    return motor_angle * reduction
