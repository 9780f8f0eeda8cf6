"""Which cells and lines disagree: one test over all of them, at a controlled rate of false alarms.

Each cell's level, and each line's prominence, has a law under the null, taken as a gamma law with the mean and variance
of the draws. Its p-value is corrected for all that were looked at by the law of the smallest p-value over all cells and
lines, drawn as well (Westfall and Young, Resampling-Based Multiple Testing, 1993, the single-step minP method).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np
from scipy.special import gammaincc

from discrepancy.locate.lines import with_found_lines
from discrepancy.locate.null import Null
from discrepancy.locate.result import Cell, Map, Spot, Where
from discrepancy.locate.sentences import STATION, sentences
from discrepancy.locate.statistics import Levels, Prominence
from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.subjects.base import Axis, View

ALARMS = 0.05
"""Rate at which a machine that lacks nothing gets one cell or line or more."""

_DRAWS = 199
"""With the record itself 200, of which the rate of alarms is a whole number: the test is exact (Davison and Hinkley,
Bootstrap Methods and their Application, 1997, section 4.2), and more draws would hardly see more."""

_AT_ONCE = 8
"""Draws whose statistics are computed together: Fourier transforms side by side take half the time."""

_SLACK = 0.1
"""Mean square over the noise's that a cell may have beyond it: fits with play reach the noise floor no nearer."""


def locate(model: Model, place: Point, view: View, rng: np.random.Generator) -> Where:
    """Test every cell and line of the residuals at a fitted place.

    Parameters
    ----------
    model : Model
        With the records; `place` is of this model.
    place : Point
    view : View
        Of this model.
    rng : numpy.random.Generator
    """
    null = Null(model, place, view)
    law = Law(with_found_lines(view, null.residual), null.draws(rng, _DRAWS))
    return located(null.residual, law)


class Law:
    """How the levels and prominences of all cells and lines are distributed under the null.

    Parameters
    ----------
    view : View
    drawn : iterable of ndarray (w, n)
        Residuals drawn under the null.
    """

    def __init__(self, view: View, drawn: Iterable[np.ndarray]) -> None:
        self.view, self._prominence = view, Prominence(view)
        self.table = _table(view)
        self._levels = Levels((*view.axes, self.table))
        self.lines = self._prominence.lines
        drawn, under = iter(drawn), []
        while some := list(itertools.islice(drawn, _AT_ONCE)):
            under.append(self.statistics(np.array(some)))
        self.under = np.concatenate(under)

    def statistics(self, residuals: np.ndarray) -> np.ndarray:
        """Mean squares of the cells of all axes and of the map, then prominences of the lines (d, k), of several
        residuals (d, w, n)."""
        return np.concatenate([self._levels.of(residuals) ** 2, self._prominence.of(residuals)], axis=1)

    def chances(self, found: np.ndarray) -> np.ndarray:
        """p-values (k,) of statistics (k,), corrected for all of them; 1 where there is no statistic."""
        there = ~np.isnan(found)
        # Lines are relative to their surroundings, so no error of the fit's level reaches them.
        slack = np.where(np.arange(len(found)) < len(found) - len(self.lines), 1.0 + _SLACK, 1.0)
        mean, spread = self.under[:, there].mean(axis=0), self.under[:, there].std(axis=0, ddof=1)
        shape, scale = (mean / spread) ** 2, spread**2 / mean
        smallest = np.sort(gammaincc(shape, self.under[:, there] / scale).min(axis=1))
        own = gammaincc(shape, (found / slack)[there] / scale)
        out = np.ones(len(found))
        out[there] = (1.0 + np.searchsorted(smallest, own, side="right")) / (1.0 + len(self.under))
        return out


def located(residual: np.ndarray, law: Law) -> Where:
    """What the test says of residuals (w, n)."""
    view, found = law.view, law.statistics(residual[None])[0]
    chances = law.chances(found)
    significant = chances <= ALARMS
    expected = np.sqrt(law.under.mean(axis=0))

    def cell(axis: str, label: str, k: int) -> Cell:
        level = math.sqrt(float(found[k]))
        return Cell(axis, label, level, float(expected[k]), float(chances[k]), bool(significant[k]))

    rows, at = [], 0
    for axis in view.axes:
        for label in axis.labels:
            if not math.isnan(found[at]):
                rows.append(cell(axis.name, label, at))
            at += 1
    cells = len(found) - len(law.lines)
    upwards, across = (view.axis(name) for name in view.map_axes)
    shape = len(upwards.labels), len(across.labels)
    picture = Map(upwards, across, np.sqrt(found[at:cells]).reshape(shape), significant[at:cells].reshape(shape))
    spots = []
    for k, line in enumerate(law.lines, start=cells):
        frequencies = tuple(map(float, line.frequency))
        chance = float(chances[k])
        spots.append(Spot(line.name, line.kind, frequencies, float(found[k]), chance, bool(significant[k])))
    both = f"{upwards.name} and {across.name}"
    spread = tuple(cell(both, label, k) for k, label in enumerate(law.table.labels, start=at) if significant[k])
    level = math.sqrt(float((residual[view.inside] ** 2).mean()))
    said = sentences(level, rows, spots, _passes(residual, view), spread)
    repeats = _repeats(residual, view, law.table) if view.aligned else math.nan
    return Where(level, repeats, tuple(rows), tuple(spots), picture, said, ALARMS, len(law.under), spread)


def _passes(residual: np.ndarray, view: View) -> np.ndarray:
    """Mean squares (2, stations) of each station's first and second cam turn in a record, over the records; NaN where
    no record holds one."""
    if not any(axis.name == STATION for axis in view.axes):
        return np.zeros((2, 0))
    axis = view.axis(STATION)
    sums, counts = np.zeros((2, len(axis.labels))), np.zeros((2, len(axis.labels)))
    for group in range(len(view.noise)):
        seen: dict[int, int] = {}
        for row in np.flatnonzero(view.groups == group).tolist():
            station = int(np.bincount(axis.cells[row][view.inside[row]]).argmax())
            turn = seen.get(station, 0)
            seen[station] = turn + 1
            if turn < len(sums):
                sums[turn, station] += float((residual[row][view.inside[row]] ** 2).mean())
                counts[turn, station] += 1.0
    return np.where(counts > 0.0, sums / np.maximum(counts, 1.0), math.nan)


def _table(view: View) -> Axis:
    """The two axes of the map as one."""
    upwards, across = (view.axis(name) for name in view.map_axes)
    both = (upwards.cells >= 0) & (across.cells >= 0)
    cells = np.where(both, upwards.cells * len(across.labels) + across.cells, -1)
    return Axis("map", tuple(f"{u}, {a}" for u in upwards.labels for a in across.labels), cells)


def _repeats(residual: np.ndarray, view: View, table: Axis) -> float:
    """rms between residuals at equal places of the map in successive windows of a record, over √2."""
    differences = []
    for group in range(len(view.noise)):
        rows = np.flatnonzero(view.groups == group)
        keys = [tuple(np.unique(table.cells[row][view.inside[row]])) for row in rows]
        last: dict[tuple, int] = {}
        for row, key in zip(rows, keys, strict=True):
            if key in last:
                shared = view.inside[row] & view.inside[last[key]]
                differences.append((residual[row] - residual[last[key]])[shared])
            last[key] = int(row)
    return math.sqrt(float((np.concatenate(differences) ** 2).mean()) / 2.0) if differences else math.nan
