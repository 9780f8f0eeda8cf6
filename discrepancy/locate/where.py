"""Which cells and lines disagree: one test over all of them, at a controlled rate of false alarms.

Each cell's level, and each line's prominence, has a law under the null, taken as a gamma law with the mean and variance
of the draws. Its p-value is corrected for all that were looked at by the law of the smallest p-value over all cells and
lines, drawn as well (Westfall and Young, Resampling-Based Multiple Testing, 1993, the single-step minP method).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from scipy.stats import gamma

from discrepancy.fit import Point
from discrepancy.locate.null import Null
from discrepancy.locate.result import Cell, Map, Spot, Where
from discrepancy.locate.sentences import sentences
from discrepancy.locate.statistics import Levels, Prominence
from discrepancy.model import Model
from discrepancy.subjects.base import Axis, View

ALARMS = 0.05
"""Rate at which a machine that lacks nothing gets one cell or line or more."""

DRAWS = 400

_SLACK = 0.1
"""Mean square over the noise's that a cell may have beyond it: fits with play reach the noise floor no nearer."""


def locate(
    model: Model, place: Point, view: View, rng: np.random.Generator, *, alarms: float = ALARMS, draws: int = DRAWS
) -> Where:
    """Test every cell and line of the residuals at a fitted place.

    Parameters
    ----------
    model : Model
        With the records; `place` is of this model.
    place : Point
    view : View
        Of this model.
    rng : numpy.random.Generator
    alarms : float
        Rate of false alarms over all cells and lines, in (0, 1).
    draws : int
        Residuals drawn under the null.
    """
    null = Null(model, place, view)
    return tested(null.residual, null.draws(rng, draws), view, alarms)


def tested(residual: np.ndarray, drawn: Iterable[np.ndarray], view: View, alarms: float) -> Where:
    """The test of residuals (w, n) against residuals drawn under the null."""
    table = _table(view)
    prominence = Prominence(view)
    levels = [Levels(axis) for axis in (*view.axes, table)]

    def statistics(r: np.ndarray) -> np.ndarray:
        return np.concatenate([*(one.of(r) ** 2 for one in levels), prominence.of(r)])

    found, under = statistics(residual), np.array([statistics(r) for r in drawn])
    cells = len(found) - len(prominence.lines)
    # Lines are relative to their surroundings, so no error of the fit's level reaches them.
    tested_values = np.concatenate([found[:cells] / (1.0 + _SLACK), found[cells:]])
    adjusted = _adjusted(tested_values, under)
    significant = adjusted <= alarms
    rows, at = [], 0
    for axis in view.axes:
        for label in axis.labels:
            if not math.isnan(found[at]):
                expected = math.sqrt(float(under[:, at].mean()))
                own = math.sqrt(float(found[at])), expected, float(adjusted[at]), bool(significant[at])
                rows.append(Cell(axis.name, label, *own))
            at += 1
    upwards, across = (view.axis(name) for name in view.map_axes)
    shape = len(upwards.labels), len(across.labels)
    picture = Map(upwards, across, np.sqrt(found[at:cells]).reshape(shape), significant[at:cells].reshape(shape))
    spots = tuple(
        Spot(
            line.name, line.kind, tuple(map(float, line.frequency)), float(found[k]), float(adjusted[k]),
            bool(significant[k]),
        )
        for k, line in enumerate(prominence.lines, start=cells)
    )  # fmt: skip
    level = math.sqrt(float((residual[view.inside] ** 2).mean()))
    said = sentences(level, rows, spots)
    return Where(level, _repeats(residual, view), tuple(rows), spots, picture, said, alarms, len(under))


def _table(view: View) -> Axis:
    """The two axes of the map as one."""
    upwards, across = (view.axis(name) for name in view.map_axes)
    both = (upwards.cells >= 0) & (across.cells >= 0)
    cells = np.where(both, upwards.cells * len(across.labels) + across.cells, -1)
    return Axis("map", tuple(f"{u}, {a}" for u in upwards.labels for a in across.labels), cells)


def _adjusted(found: np.ndarray, under: np.ndarray) -> np.ndarray:
    """p-values (k,) of statistics (k,) given draws (b, k), corrected for all of them; 1 where there is no statistic."""
    there = ~np.isnan(found)
    mean, spread = under[:, there].mean(axis=0), under[:, there].std(axis=0, ddof=1)
    shape, scale = (mean / spread) ** 2, spread**2 / mean
    smallest = np.sort(gamma.logsf(under[:, there], shape, scale=scale).min(axis=1))
    own = gamma.logsf(found[there], shape, scale=scale)
    out = np.ones(len(found))
    out[there] = (1.0 + np.searchsorted(smallest, own, side="right")) / (1.0 + len(under))
    return out


def _repeats(residual: np.ndarray, view: View) -> float:
    """rms between residuals at equal places of the map in successive windows of a record, over √2."""
    table = _table(view)
    differences = []
    for group in range(len(view.noise)):
        rows = np.flatnonzero(view.groups == group)
        keys = [tuple(np.unique(table.cells[row][view.inside[row]])) for row in rows]
        last: dict[tuple, int] = {}
        for row, key in zip(rows, keys, strict=True):
            if key in last:
                shared = view.inside[row] & view.inside[last[key]]
                differences.append((residual[row] - residual[last[key]])[shared])
            last[key] = row
    return math.sqrt(float((np.concatenate(differences) ** 2).mean()) / 2.0) if differences else math.nan
