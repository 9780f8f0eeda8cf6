"""What every motion law can do, and the splitting of a cam angle into whole turns and a phase."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_env.motion_law.pieces import LawPieces

Values = NDArray[np.float64]


class Peaks(NamedTuple):
    """Largest derivatives of the normalised rise without unit, Cv, Ca, Cj, and the signed jerk at
    mid-motion."""

    velocity: float
    acceleration: float
    jerk: float
    jerk_at_midpoint: float


class MotionLaw(ABC):
    """Follower angle beta as a function of the cam angle alpha, advancing 2 pi / stations per cam turn.

    Subclasses are frozen dataclasses without arrays: comparable, hashable, safe to pickle and to copy.
    """

    name: ClassVar[str]

    @abstractmethod
    def evaluate(self, cam_angle: ArrayLike, stations: int, motion_share: float) -> tuple[Values, Values, Values]:
        """beta [rad], beta' [-] and beta'' [1/rad] at cam angles in rad, each shaped like `cam_angle`.

        Any finite cam angle is allowed, over many turns and negative too. With n whole turns before it,
        beta(alpha) = 2 pi n / stations + beta(alpha - 2 pi n). Raises `ParameterError` if the cam angle is
        not finite, `stations` is not a whole number >= 1 or `motion_share` is outside (0, 1].
        """

    @abstractmethod
    def pieces(self, stations: int, motion_share: float) -> LawPieces:
        """The law over one cam turn as quintic polynomials, built once for the same arguments, read-only."""

    @abstractmethod
    def peaks(self) -> Peaks:
        """Cv, Ca, Cj and the jerk at mid-motion of the rise (docs/explanation/physics.md, section Motion laws)."""


def check_use(owner: str, stations: int, motion_share: float) -> None:
    """Refuse a number of stations or a motion share that no law can have."""
    check_integer(owner, "stations", stations, low=1)
    check_number(
        owner, "motion_share", motion_share, low=0.0, low_open=True, high=1.0, unit="of a cam turn",
        remedy="give the share of the cam turn in motion, 0.5 for 180 deg",
    )  # fmt: skip


def split_turns(owner: str, cam_angle: ArrayLike) -> tuple[Values, Values]:
    """Whole cam turns and the phase left over, 0 <= phase <= 1, of cam angles in rad.

    The phase can round up to 1 just below a whole turn; there the law has its end value, so nothing jumps.
    """
    turns = np.asarray(cam_angle, dtype=np.float64) / (2.0 * math.pi)
    if not np.isfinite(turns).all():
        worst = float(turns[~np.isfinite(turns)].flat[0])
        raise refuse(owner, "cam_angle", "finite, in rad", worst, "look for a run that diverged before this call")
    whole = np.floor(turns)
    return whole, turns - whole
