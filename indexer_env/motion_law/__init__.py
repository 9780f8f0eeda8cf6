"""The cam's motion laws: how far the follower has turned at each cam angle.

In reading order:
    base               MotionLaw, what every law can do; Peaks
    pieces             LawPieces, a law as quintic polynomials for the compiled kernel
    rise               RiseLaw, a law given by one normalised rise: scaling, dwell, pieces
    modified_sine, modified_trapezoid, cycloidal, polynomial_345      the four named rises
    table              TableLaw, the user's own (cam angle, follower angle) points
    table_spline, table_checks      its spline through motion and dwell; what a table cannot satisfy
    choose             MOTION_LAWS and motion_law(): from a name or a mapping to a law

Units: cam angle alpha and follower angle beta in rad; beta' = dbeta/dalpha [-], beta'' [1/rad]; the cam phase
u in cam turns, 0 <= u < 1; the normalised rise has time s, 0 <= s <= 1, and height y, 0 to 1, both without
unit. With S stations and a share f of the cam turn in motion, h = 2 pi / S and u = f s:
    beta = h y,   beta' = h v / (2 pi f),   beta'' = h a / (2 pi f)^2.
"""

from indexer_env.motion_law.base import MotionLaw, Peaks
from indexer_env.motion_law.choose import MOTION_LAWS, motion_law
from indexer_env.motion_law.cycloidal import Cycloidal
from indexer_env.motion_law.modified_sine import ModifiedSine
from indexer_env.motion_law.modified_trapezoid import ModifiedTrapezoid
from indexer_env.motion_law.pieces import LawPieces
from indexer_env.motion_law.polynomial_345 import Polynomial345
from indexer_env.motion_law.rise import RiseLaw
from indexer_env.motion_law.table import TableLaw

__all__ = [
    "MOTION_LAWS",
    "Cycloidal",
    "LawPieces",
    "ModifiedSine",
    "ModifiedTrapezoid",
    "MotionLaw",
    "Peaks",
    "Polynomial345",
    "RiseLaw",
    "TableLaw",
    "motion_law",
]
