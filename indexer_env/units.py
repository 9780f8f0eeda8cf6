"""Units of the shop in SI units; everything inside is SI and radians."""

from __future__ import annotations

import math

RPM = 2.0 * math.pi / 60.0
"""One turn a minute [rad/s]."""

DEGREE = math.pi / 180.0
"""One degree [rad]."""
