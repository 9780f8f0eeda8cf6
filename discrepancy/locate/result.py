"""What locating gives: cells, lines, the map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discrepancy.subjects.base import Axis


@dataclass(frozen=True)
class Cell:
    """One cell of one axis.

    Attributes
    ----------
    axis, label : str
    level : float
        rms of its residuals over the noise.
    expected : float
        Its mean level if nothing were missing.
    p : float
        Probability that any cell or line is as extreme as this one if nothing were missing.
    significant : bool
    """

    axis: str
    label: str
    level: float
    expected: float
    p: float
    significant: bool


@dataclass(frozen=True)
class Spot:
    """One line.

    Attributes
    ----------
    name, kind : str
        As of `Line`.
    frequency : tuple of float
        In each record [Hz].
    prominence : float
        Least power over that of its surroundings, over all records.
    p, significant
        As of `Cell`.
    """

    name: str
    kind: str
    frequency: tuple[float, ...]
    prominence: float
    p: float
    significant: bool


@dataclass(frozen=True, eq=False)
class Map:
    """Two axes against each other.

    Attributes
    ----------
    upwards, across : Axis
    levels : ndarray (k, m)
        NaN where no sample lies.
    significant : ndarray (k, m) of bool
    """

    upwards: Axis
    across: Axis
    levels: np.ndarray
    significant: np.ndarray


@dataclass(frozen=True, eq=False)
class Where:
    """Where a model and its records disagree.

    Attributes
    ----------
    level : float
        rms of all residuals over the noise.
    repeats : float
        rms of what differs between windows of the same kind in successive turns, over √2 and over the noise: how well
        the machine repeats itself; NaN where nothing repeats.
    cells : tuple of Cell
        Of all axes, in their order.
    spots : tuple of Spot
    map : Map
    sentences : tuple of str
    alarms : float
        Rate of false alarms over all cells and lines.
    draws : int
    spread : tuple of Cell
        The significant cells of the map.
    """

    level: float
    repeats: float
    cells: tuple[Cell, ...]
    spots: tuple[Spot, ...]
    map: Map
    sentences: tuple[str, ...]
    alarms: float
    draws: int
    spread: tuple[Cell, ...]

    @property
    def significant(self) -> tuple[Cell | Spot, ...]:
        """Cells and lines that disagree, the most extreme first."""
        found = [*(c for c in (*self.cells, *self.spread) if c.significant), *(s for s in self.spots if s.significant)]
        return tuple(sorted(found, key=lambda one: (one.p, -_size(one))))


def _size(one: Cell | Spot) -> float:
    return one.level if isinstance(one, Cell) else one.prominence
