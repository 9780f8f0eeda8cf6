"""The spline of a table of motion: quintic through every point, at rest where the table dwells.

One spline over the whole turn rings: it carries the jump of the jerk at the edge of a dwell into the dwell,
as waves of beta'' that no cam has. So the turn is cut where the table dwells, and every motion gets a spline
of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from indexer_env.motion_law.pieces import LawPieces

Values = NDArray[np.float64]

# Points of a dwell that a file gives with 15 digits still count as equal; a motion rises past this within one
# point.
FLAT = 1e-13
# Shorter stillness is rounding: near its start a motion written with few digits repeats values for several
# points.
SHORTEST_DWELL = 0.01  # cam turns


@dataclass(frozen=True, eq=False)
class Stretch:
    """One motion between two dwells: u (n,) cam turns from where it starts, beta (n,) rad, both unwrapped."""

    first: int
    u: Values
    beta: Values

    @property
    def duration(self) -> float:
        """Share of the cam turn [-]."""
        return float(self.u[-1] - self.u[0])


def dwelling(u: Values, beta: Values) -> NDArray[np.bool_]:
    """True for each of the n - 1 intervals of the table (n points, one turn) in which the follower dwells.

    A dwell is a run of equal points that lasts 1 % of the cam turn or more. Two equal points where the
    follower reverses are none, since two points on either side of a turning point can be equal too.
    """
    step = np.diff(beta)
    flat = np.abs(step) <= FLAT * max(1.0, float(np.abs(beta).max()))
    alone = flat & ~np.roll(flat, 1) & ~np.roll(flat, -1)
    flat &= ~(alone & (np.roll(step, 1) * np.roll(step, -1) < 0.0))
    width = np.diff(u)
    for run in _runs(flat):
        if width[run].sum() < SHORTEST_DWELL:
            flat[run] = False
    return flat


def _runs(marked: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Runs of marked intervals around the turn, one over its end in one piece; none if all are marked."""
    count = marked.size
    found = []
    for first in np.flatnonzero(marked & ~np.roll(marked, 1)):
        length = int(np.argmin(np.roll(marked, -first)))
        found.append(np.arange(first, first + length) % count)
    return found


def stretches(u: Values, beta: Values) -> list[Stretch]:
    """The motions of a table, u from 0 to 1 cam turn, in the order of their start; none if it never
    dwells."""
    count = u.size - 1
    found = []
    for run in _runs(~dwelling(u, beta)):
        turn, point = np.divmod(np.arange(run[0], run[0] + run.size + 1), count)
        found.append(Stretch(int(run[0]), u[point] + turn, beta[point] + (beta[-1] - beta[0]) * turn))
    return found


def table_pieces(u: Values, beta: Values) -> LawPieces:
    """The law through the points (u, beta) as `LawPieces`, an edge at each point outside the dwells.

    Within a motion: the quintic spline through all its points with beta' = beta'' = 0 at both ends. A dwell:
    one constant. Without any dwell: the quintic spline of beta - h u that is periodic over the turn.
    """
    # SciPy's interpolation takes longer to import than the rest of the package; only users of tables pay for
    # it.
    from scipy.interpolate import make_interp_spline

    count = u.size - 1
    flat = dwelling(u, beta)
    coefficients = np.zeros((count, 6))
    coefficients[:, 0] = beta[:-1]
    if flat.any():
        rest = [(1, 0.0), (2, 0.0)]
        splines = [
            (stretch.first, stretch.u, make_interp_spline(stretch.u, stretch.beta, k=5, bc_type=(rest, rest)))
            for stretch in stretches(u, beta)
        ]
        slope = 0.0
    else:
        slope = beta[-1] - beta[0]
        wave = beta - slope * u
        wave[-1] = wave[0]
        splines = [(0, u, make_interp_spline(u, wave, k=5, bc_type="periodic"))]
    for first, places, spline in splines:
        rows = np.arange(first, first + places.size - 1) % count
        for order in range(1, 6):
            coefficients[rows, order] = spline(places[:-1], nu=order) / math.factorial(order)
        coefficients[rows, 1] += slope
    inner = ~(flat & np.roll(flat, 1))  # the middle of a dwell needs no edge
    kept = np.flatnonzero(inner | (np.arange(count) == 0))
    breaks = flat != np.roll(flat, 1)
    return LawPieces(np.append(u[kept], 1.0), coefficients[kept], np.append(breaks[kept], breaks[0]))
