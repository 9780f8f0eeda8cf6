"""A motion law on one machine's cam as the kernels read it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from indexer_env.kernels import layout
from indexer_env.motion_law import MotionLaw


@dataclass(frozen=True)
class LawTable:
    """Pieces of a motion law as the kernel reads them.

    Attributes
    ----------
    pieces : ndarray (k, PIECE_COLUMNS)
        Reach [rad], break flags, whether it is still, coefficients of β in powers of (α - reach's low end).
    steepest : float
        Largest |β'| at the pieces' ends [-].
    motion : float
        Cam angle over which the law moves [rad].
    motions : tuple of (float, float)
        Begin and end of each motion [cam turns]; one that goes on over the turn's end ends beyond 1.
    """

    pieces: np.ndarray
    steepest: float
    motion: float
    motions: tuple[tuple[float, float], ...]


@functools.lru_cache(maxsize=1024)
def law_table(law: MotionLaw, stations: int, motion_share: float) -> LawTable:
    """The law's pieces for a cam of so many stations and such a share of motion."""
    source = law.pieces(stations, motion_share)
    table = np.empty((len(source.coefficients), layout.PIECE_COLUMNS))
    turn = 2.0 * math.pi
    table[:, layout.PIECE_LOW] = source.edges[:-1] * turn
    table[:, layout.PIECE_HIGH] = source.edges[1:] * turn
    table[:, layout.PIECE_BREAK_LOW] = source.breaks[:-1]
    table[:, layout.PIECE_BREAK_HIGH] = source.breaks[1:]
    # a cam turn begins where single-station effects change, so that edge is always landed on
    table[0, layout.PIECE_BREAK_LOW] = table[-1, layout.PIECE_BREAK_HIGH] = 1.0
    table[:, layout.PIECE_C_0 :] = source.coefficients / turn ** np.arange(6)
    lengths = table[:, layout.PIECE_HIGH] - table[:, layout.PIECE_LOW]
    moving = (source.coefficients[:, 1:] != 0.0).any(axis=1)
    table[:, layout.PIECE_STILL] = ~moving
    table.flags.writeable = False
    steepest = float(np.abs(table[:, layout.PIECE_C_0 + 1]).max())
    return LawTable(table, steepest, float(lengths[moving].sum()), _motions(source.edges, moving))


def _motions(edges: np.ndarray, moving: np.ndarray) -> tuple[tuple[float, float], ...]:
    found: list[tuple[float, float]] = []
    for low, high in np.column_stack([edges[:-1], edges[1:]])[moving].tolist():
        begin = found.pop()[0] if found and found[-1][1] == low else low
        found.append((begin, high))
    if len(found) > 1 and found[0][0] == 0.0 and found[-1][1] == 1.0:
        found[-1] = (found[-1][0], 1.0 + found.pop(0)[1])
    return tuple(found)
