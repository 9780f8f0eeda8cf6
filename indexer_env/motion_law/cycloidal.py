"""Cycloidal motion: one full sine wave of acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from indexer_env.motion_law.base import Peaks, Values
from indexer_env.motion_law.rise import RiseLaw

W = 2 * math.pi


@final
@dataclass(frozen=True)
class Cycloidal(RiseLaw):
    """y = s - sin(2 pi s) / (2 pi); the jerk jumps at the ends of the motion only.

    Source: Norton, Cam Design and Manufacturing Handbook (2002), cycloidal, with the peak values.
    """

    name: ClassVar[str] = "cycloidal"

    def _first_half(self, s: Values) -> tuple[Values, Values, Values, Values]:
        sine, cosine = np.sin(W * s), np.cos(W * s)
        return s - sine / W, 1 - cosine, W * sine, W**2 * cosine

    def peaks(self) -> Peaks:
        return Peaks(2.0, W, W**2, -(W**2))
