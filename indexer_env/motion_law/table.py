"""A motion law from the user's own table of cam and follower angles over one cam turn."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, final

import numpy as np
from numpy.typing import ArrayLike

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_env.motion_law.base import MotionLaw, Peaks, Values, split_turns
from indexer_env.motion_law.pieces import LawPieces
from indexer_env.motion_law.table_checks import findings
from indexer_env.motion_law.table_spline import stretches, table_pieces

FEWEST_POINTS = 8
SPAN_TOLERANCE = 1e-6  # cam turns, lets through 2 pi written with five decimals
CLOSING_TOLERANCE = 1e-4  # of 2 pi / stations, lets through 51.43 deg for seven stations


@final
@dataclass(frozen=True)
class TableLaw(MotionLaw):
    """The follower angle given at points over one cam turn, joined by quintic splines.

    cam_angle       rad, from 0 to 2 pi, strictly ascending, both ends included; the spacing need not be equal
    follower_angle  rad, the last value one station (2 pi / stations) above the first, whatever the first is

    The table says itself where it dwells, so `motion_share` is ignored. Equal neighbours over 1/100 of
    the turn or more are a dwell, also over the turn's end. Each motion between two dwells has its own quintic
    spline through all its points, with beta' = beta'' = 0 where it meets a dwell; beta'' is continuous
    everywhere, and a dwell is exactly still. (A single spline over the turn would ring into the dwells.)
    Without a dwell there is one spline, periodic in beta - h u. `pieces` are these splines themselves, not an
    approximation: one piece per table interval outside the dwells.

    Nothing is smoothed. An advance that differs from 2 pi / stations by rounding (up to 1e-4 of it) is scaled
    to close. `check` names what the spline cannot mend; a table that no cam could follow (velocity jump,
    stray point, rounding that dominates the acceleration, overshoot) is refused there and by `evaluate` and
    `pieces`.
    """

    cam_angle: tuple[float, ...]
    follower_angle: tuple[float, ...]
    name: ClassVar[str] = "table"

    def __post_init__(self) -> None:
        for field in ("cam_angle", "follower_angle"):
            object.__setattr__(self, field, numbers("TableLaw", field, getattr(self, field), "rad"))
        points = len(self.cam_angle)
        if points != len(self.follower_angle):
            rule = f"as long as cam_angle, {points} points"
            raise refuse("TableLaw", "follower_angle", rule, len(self.follower_angle))
        if points < FEWEST_POINTS:
            rule = f"given at {FEWEST_POINTS} points or more"
            raise refuse("TableLaw", "cam_angle", rule, points, "one point per degree serves well")
        cam = np.array(self.cam_angle)
        falling = np.flatnonzero(np.diff(cam) <= 0.0)
        if falling.size:
            pair = [round(math.degrees(angle), 6) for angle in cam[falling[0] : falling[0] + 2]]
            remedy = "sort the table, drop repeated points, and see that its columns are not swapped"
            raise refuse("TableLaw", "cam_angle", "strictly ascending, in deg", pair, remedy)
        if max(abs(cam[0]), abs(cam[-1] - 2.0 * math.pi)) > SPAN_TOLERANCE * 2.0 * math.pi:
            ends = [round(math.degrees(angle), 6) for angle in cam[[0, -1]]]
            remedy = "give one cam turn with both ends, and see that degrees are not taken for radians"
            raise refuse("TableLaw", "cam_angle", "from 0 to 360 deg", ends, remedy)
        if self._advance <= 0.0:
            rule = "higher at the end of the cam turn than at its start, in deg"
            ends = [round(math.degrees(self.follower_angle[end]), 6) for end in (0, -1)]
            raise refuse("TableLaw", "follower_angle", rule, ends, "change all signs if the table turns the other way")

    @property
    def _advance(self) -> float:
        return self.follower_angle[-1] - self.follower_angle[0]

    def evaluate(self, cam_angle: ArrayLike, stations: int, motion_share: float = 1.0) -> tuple[Values, Values, Values]:
        pieces = self.pieces(stations, motion_share)
        whole, phase = split_turns("TableLaw", cam_angle)
        beta, beta1, beta2 = pieces.evaluate(phase)
        per_rad = 0.5 / math.pi
        return 2.0 * math.pi / stations * whole + beta, per_rad * beta1, per_rad**2 * beta2

    def pieces(self, stations: int, motion_share: float = 1.0) -> LawPieces:
        check_integer("TableLaw", "stations", stations, low=1)
        return _fitted(self, int(stations))[0]

    def check(self, stations: int) -> list[str]:
        """What the table cannot satisfy, one sentence each; an empty list says that nothing was found.

        Named are: too few points in a motion, noise from rounding, a kink or stray point, a jump of the
        acceleration at the edge of a dwell, a follower that turns back, an overshoot between points. Raises
        `ParameterError` if the table does not close on `stations`, or if a finding leaves no usable law.
        """
        check_integer("TableLaw", "stations", stations, low=1)
        return list(_fitted(self, int(stations))[1])

    def peaks(self) -> Peaks:
        """Largest derivatives of the spline, normalised with the table's own advance and its share of motion.

        Jerk at the midpoint: in the middle of the longest motion. A table with several motions a turn is
        normalised with its whole advance and the sum of their shares.
        """
        u, beta = _points(self, self._advance)
        pieces = table_pieces(u, beta)
        motions = stretches(u, beta)
        share = sum(motion.duration for motion in motions) or 1.0
        longest = max(motions, key=lambda motion: motion.duration, default=None)
        middle = 0.5 if longest is None else (longest.u[0] + 0.5 * longest.duration) % 1.0
        places = (pieces.edges[:-1, None] + np.diff(pieces.edges)[:, None] * (np.arange(16) / 16)).ravel()
        v, a, j = (
            share ** (order + 1) / self._advance * derivative
            for order, derivative in enumerate((*pieces.evaluate(places)[1:], _third(pieces, places)))
        )
        at_middle = share**3 / self._advance * _third(pieces, np.array([middle]))
        cv, ca, cj = (float(np.abs(x).max()) for x in (v, a, j))
        return Peaks(cv, ca, cj, float(at_middle[0]))


def numbers(owner: str, name: str, values: object, unit: str) -> tuple[float, ...]:
    """A row of finite numbers as floats; anything else is refused, with the place of the bad one."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise refuse(owner, name, f"a row of numbers in {unit}", values)
    row = tuple(values)
    for place, value in enumerate(row):
        check_number(owner, f"{name}[{place}]", value, unit=unit)
    return tuple(float(value) for value in row)


def _points(law: TableLaw, advance: float) -> tuple[Values, Values]:
    """u from exactly 0 to 1 and beta scaled to `advance` about its first value."""
    u = np.array(law.cam_angle)
    u = (u - u[0]) / (u[-1] - u[0])
    beta = np.array(law.follower_angle)
    return u, beta[0] + (beta - beta[0]) * (advance / (beta[-1] - beta[0]))


def _third(pieces: LawPieces, places: Values) -> Values:
    k = np.clip(np.searchsorted(pieces.edges, places, side="right") - 1, 0, pieces.edges.size - 2)
    t = places - pieces.edges[k]
    c3, c4, c5 = pieces.coefficients[k, 3:].T
    return 6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5)


@lru_cache(maxsize=256)
def _fitted(law: TableLaw, stations: int) -> tuple[LawPieces, tuple[str, ...]]:
    """The pieces and the sentences of `check`, once per table and number of stations."""
    advance = 2.0 * math.pi / stations
    if abs(law._advance - advance) > CLOSING_TOLERANCE * advance:
        rule = f"advancing {math.degrees(advance):.7g} deg per cam turn ({stations} stations)"
        remedy = "correct the table's last value or the number of stations"
        raise refuse("TableLaw", "follower_angle", rule, round(math.degrees(law._advance), 6), remedy)
    u, beta = _points(law, advance)
    pieces = table_pieces(u, beta)
    reported = []
    for finding in findings(u, beta, pieces):
        if finding.fatal:
            raise finding.error
        reported.append(str(finding.error))
    return pieces, tuple(reported)
