"""Laws given by one normalised rise: dwell, scaling and pieces, once for all of them."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from indexer_env.errors import refuse
from indexer_env.motion_law.base import MotionLaw, Values, check_use, split_turns
from indexer_env.motion_law.pieces import LawPieces, quintic_hermite

# A multiple of 8, so that junctions at eighths of the motion fall on edges. With 128 the quintics follow the
# most curved rise to 5e-8 of its peak acceleration.
PIECES_PER_MOTION = 128

_NEAR = 1e-9
"""Most that height and velocity may be off at the begin and in the middle of the motion."""

_APART = 1e-3
"""Most that height and velocity may be off the integrals of velocity and acceleration over the motion, of their largest
value. The laws here are off by 1e-9, one whose formula changes within a piece by some 1e-4."""


class RiseLaw(MotionLaw):
    """A rise y(s) with y(1 - s) = 1 - y(s) during the first share f of each cam turn, then dwell.

    A subclass gives the first half only; the mirror makes closing and symmetry exact in floating point.
    """

    junctions: ClassVar[tuple[float, ...]] = ()  # inner s where the formula changes, eighths

    @abstractmethod
    def _first_half(self, s: Values) -> tuple[Values, Values, Values, Values]:
        """y, v, a, j for 0 <= s <= 1/2."""

    def rise(self, s: ArrayLike) -> tuple[Values, Values, Values, Values]:
        """Height, velocity, acceleration and jerk of the normalised rise, each shaped like s in [0, 1].

        The jerk at s = 0 and s = 1 is that of the motion; in the dwell it is zero. Raises `ParameterError`
        for s outside [0, 1].
        """
        time = np.asarray(s, dtype=np.float64)
        inside = (time >= 0.0) & (time <= 1.0)
        if not inside.all():
            raise refuse(type(self).__name__, "s", "within [0, 1] of the motion", float(time[~inside].flat[0]))
        return self._mirrored(time)

    def _mirrored(self, s: Values) -> tuple[Values, Values, Values, Values]:
        late = s > 0.5
        y, v, a, j = self._first_half(np.where(late, 1.0 - s, s))
        return np.where(late, 1.0 - y, y)[()], v[()], np.where(late, -a, a)[()], j[()]

    def evaluate(self, cam_angle: ArrayLike, stations: int, motion_share: float) -> tuple[Values, Values, Values]:
        check_use(type(self).__name__, stations, motion_share)
        whole, phase = split_turns(type(self).__name__, cam_angle)
        y, v, a, _ = self._mirrored(np.minimum(phase / motion_share, 1.0))
        advance = 2.0 * math.pi / stations
        per_rad = 1.0 / (2.0 * math.pi * motion_share)
        return advance * (whole + y), advance * per_rad * v, advance * per_rad**2 * a

    def pieces(self, stations: int, motion_share: float) -> LawPieces:
        check_use(type(self).__name__, stations, motion_share)
        return _pieces(self, stations, motion_share)


@lru_cache(maxsize=1024)
def _knots(law: RiseLaw) -> tuple[Values, Values, Values, Values]:
    """s, y, v and a at the pieces' ends, of a law that is one: refused is what does not begin at rest or is not half
    done at s = 1/2, where v and a are not the derivatives of y and v, and a junction that is no piece's end."""
    owner, mirrored = type(law).__name__, "a rise begins at rest, and its second half mirrors the first"
    for junction in law.junctions:
        if junction * PIECES_PER_MOTION % 1.0 != 0.0:
            rule = f"multiples of 1/{PIECES_PER_MOTION}, where the pieces end that the kernel reads"
            raise refuse(owner, "junctions", rule, junction, "take the nearest, or give the law as a table")
    s = np.arange(PIECES_PER_MOTION + 1) / PIECES_PER_MOTION
    ends, middles = law.rise(s), law.rise(s[:-1] + 0.5 / PIECES_PER_MOTION)
    y, v, a, _ = ends
    for what, value, wanted in (("y(0)", y[0], 0.0), ("v(0)", v[0], 0.0), ("y(1/2)", y[PIECES_PER_MOTION // 2], 0.5)):
        if not abs(value - wanted) <= _NEAR:
            raise refuse(owner, what, f"{wanted:g}", float(value), mirrored)
    for order, (low, high) in enumerate((("y", "v"), ("v", "a"))):
        values, rates = ends[order], ends[order + 1]
        simpson = np.cumsum(rates[:-1] + 4.0 * middles[order + 1] + rates[1:]) / (6.0 * PIECES_PER_MOTION)
        good = np.abs(values[1:] - simpson) <= _APART * np.abs(values).max()
        if not good.all():
            place = int(np.argmin(good))
            rule = f"the derivative of {low} by s, with the integral {values[place + 1]:.4g} from 0 to {s[place + 1]:g}"
            raise refuse(owner, high, rule, float(f"{simpson[place]:.4g}"), f"derive {low} again")
    return s, y, v, a


@lru_cache(maxsize=1024)
def _pieces(law: RiseLaw, stations: int, motion_share: float) -> LawPieces:
    s, y, v, a = _knots(law)
    advance = 2.0 * math.pi / stations
    per_turn = motion_share ** -np.arange(6.0)  # du = f ds
    coefficients = advance * per_turn * quintic_hermite(1.0 / PIECES_PER_MOTION, y, v, a)
    edges = motion_share * s
    breaks = np.isin(s, (0.0, *law.junctions, 1.0))
    if motion_share < 1.0:
        coefficients = np.vstack([coefficients, [advance, 0.0, 0.0, 0.0, 0.0, 0.0]])
        edges = np.append(edges, 1.0)
        breaks = np.append(breaks, True)
    return LawPieces(edges, coefficients, breaks)
