"""Modified sine: the common default of indexing cams, for its low velocity and soft torque reversal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from indexer_env.motion_law.base import Peaks, Values
from indexer_env.motion_law.rise import RiseLaw

PI = math.pi


@final
@dataclass(frozen=True)
class ModifiedSine(RiseLaw):
    """Quarter sine waves of acceleration: short at the ends of the motion, three times as long in its middle.

    y = (pi s - sin(4 pi s) / 4) / (4 + pi)                            0 <= s <= 1/8
    y = (2 + pi s - 9/4 sin(4 pi s / 3 + pi / 3)) / (4 + pi)          1/8 <= s <= 7/8
    and the mirror image of the first after 7/8. The fourth derivative jumps at 1/8 and 7/8.
    Source: Norton, Cam Design and Manufacturing Handbook (2002), modified sine, with the peak values.
    """

    name: ClassVar[str] = "modified_sine"
    junctions: ClassVar[tuple[float, ...]] = (1 / 8, 7 / 8)

    def _first_half(self, s: Values) -> tuple[Values, Values, Values, Values]:
        start = s <= 1 / 8
        angle = np.where(start, 4 * PI * s, 4 * PI * s / 3 + PI / 3)
        sine, cosine = np.sin(angle), np.cos(angle)
        rate = np.where(start, 4 * PI, 4 * PI / 3)
        return (
            (np.where(start, 0.0, 2.0) + PI * s - np.where(start, 1 / 4, 9 / 4) * sine) / (4 + PI),
            (PI - np.where(start, PI, 3 * PI) * cosine) / (4 + PI),
            4 * PI**2 * sine / (4 + PI),
            4 * PI**2 * rate * cosine / (4 + PI),
        )

    def peaks(self) -> Peaks:
        return Peaks(4 * PI / (4 + PI), 4 * PI**2 / (4 + PI), 16 * PI**3 / (4 + PI), -16 * PI**3 / (3 * (4 + PI)))
