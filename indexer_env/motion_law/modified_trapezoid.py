"""Modified trapezoid: the lowest peak acceleration of the four, paid with jerk at mid-motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from indexer_env.motion_law.base import Peaks, Values
from indexer_env.motion_law.rise import RiseLaw

PI = math.pi
CA = 8 * PI / (2 + PI)  # peak acceleration of the unit rise


@final
@dataclass(frozen=True)
class ModifiedTrapezoid(RiseLaw):
    """A trapezoid of acceleration whose flanks are quarter sine waves, each an eighth of the motion long.

    a = Ca sin(4 pi s)              0 <= s <= 1/8
    a = Ca                        1/8 <= s <= 3/8
    a = Ca cos(4 pi (s - 3/8))    3/8 <= s <= 1/2,   Ca = 8 pi / (2 + pi), and the mirror image after 1/2;
    v and y are its integrals from rest. The fourth derivative jumps at 1/8, 3/8, 5/8 and 7/8.
    Source: Norton, Cam Design and Manufacturing Handbook (2002), modified trapezoid, with the peak values.
    """

    name: ClassVar[str] = "modified_trapezoid"
    junctions: ClassVar[tuple[float, ...]] = (1 / 8, 3 / 8, 5 / 8, 7 / 8)

    def _first_half(self, s: Values) -> tuple[Values, Values, Values, Values]:
        w = 4 * PI
        sine, cosine = np.sin(w * s), np.cos(w * s)
        flat, bend = s - 1 / 8, s - 3 / 8
        bend_sine, bend_cosine = np.sin(w * bend), np.cos(w * bend)
        v1, y1 = 1 / w, 1 / (8 * w) - 1 / w**2  # per unit of Ca, at s = 1/8
        v2, y2 = v1 + 1 / 4, y1 + v1 / 4 + 1 / 32  # at s = 3/8
        phases = [s <= 1 / 8, s <= 3 / 8]
        return (
            CA * np.select(
                phases,
                [s / w - sine / w**2, y1 + v1 * flat + flat**2 / 2],
                y2 + v2 * bend + (1 - bend_cosine) / w**2,
            ),
            CA * np.select(phases, [(1 - cosine) / w, v1 + flat], v2 + bend_sine / w),
            CA * np.select(phases, [sine, np.ones_like(s)], bend_cosine),
            CA * w * np.select(phases, [cosine, np.zeros_like(s)], -bend_sine),
        )  # fmt: skip

    def peaks(self) -> Peaks:
        return Peaks(2.0, CA, 4 * PI * CA, -4 * PI * CA)
