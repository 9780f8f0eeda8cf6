"""The 3-4-5 polynomial: the lowest power series at rest at both ends, acceleration included."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, final

from indexer_env.motion_law.base import Peaks, Values
from indexer_env.motion_law.rise import RiseLaw


@final
@dataclass(frozen=True)
class Polynomial345(RiseLaw):
    """y = 10 s^3 - 15 s^4 + 6 s^5; the jerk jumps at the ends of the motion only.

    Source: Norton, Cam Design and Manufacturing Handbook (2002), 3-4-5 polynomial, with the peak values.
    """

    name: ClassVar[str] = "polynomial_345"

    def _first_half(self, s: Values) -> tuple[Values, Values, Values, Values]:
        return (
            s**3 * (10 + s * (-15 + 6 * s)),
            30 * (s * (1 - s)) ** 2,
            60 * s * (1 + s * (-3 + 2 * s)),
            60 + 360 * s * (s - 1),
        )

    def peaks(self) -> Peaks:
        return Peaks(15 / 8, 10 / math.sqrt(3), 60.0, -30.0)
