"""Residuals as they would be if nothing were missing: noise, less what the fit takes up of it, by linear theory.

With the derivatives G by the globals and L_w by a window's start state, a fit at its optimum leaves of noise ε

    r = ε' + G' x,   x = -(G'ᵀG' + Λ)⁻¹ (G'ᵀ ε' + Λ^½ η),   ε' = (1 - Q_w Q_wᵀ) ε,   G' likewise

with Q_w an orthonormal basis of L_w, Λ the precision of what was known beforehand and η ~ N(0, 1). Noise is as
correlated from sample to sample as the record's. Where its size was estimated from the records themselves, so it is
here, from the simulated records with the noise drawn, of all of them together.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter

from discrepancy.model import Model
from discrepancy.noise import shared_noise
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.subjects.base import View

_AT_ONCE = 8
"""Draws made together, so that the derivatives are read once for all of them."""

_RANK = 1e-9
"""Singular values below this share of the largest carry no direction."""


class Null:
    """The linearised model at a fitted place.

    Parameters
    ----------
    model : Model
    place : Point
    view : View
    """

    def __init__(self, model: Model, place: Point, view: View) -> None:
        problem = Problem(model, place.hypothesis)
        self.view = view
        self.residual, by_global, by_local = problem.linearised(place)
        free = problem.free(place, problem.system(self.residual, by_global, by_local, place.z))
        self._bases = _bases(np.moveaxis(by_local, 0, 2))
        slopes = self._cleaned(by_global[free])
        self._slopes = slopes.reshape(len(slopes), -1)
        precision = problem.known[free].astype(float)
        self._root = np.sqrt(precision)
        # The floor stands for parameters that nothing determines: they take up nothing.
        self._curvature = self._slopes @ self._slopes.T + np.diag(precision + 1e-9)

    def draws(self, rng: np.random.Generator, count: int) -> Iterator[np.ndarray]:
        """Residuals (w, n), one by one, 0 beyond the windows' ends."""
        clean = self.view.measured / self._noise + self.residual
        for first in range(0, count, _AT_ONCE):
            size = min(_AT_ONCE, count - first)
            noise, known = np.empty((size, *clean.shape)), np.empty((size, len(self._root)))
            for k in range(size):
                rng.standard_normal(out=noise[k])
                rng.standard_normal(out=known[k])
            noise = self._coloured(noise) * self.view.inside
            left = self._cleaned(noise)
            right = left.reshape(size, -1) @ self._slopes.T + self._root * known
            left -= (np.linalg.solve(self._curvature, right.T).T @ self._slopes).reshape(left.shape)
            for one, own in zip(left, noise, strict=True):
                yield one / self._estimate(clean + own)

    def _coloured(self, white: np.ndarray) -> np.ndarray:
        """e_k = ρ e_{k-1} + √(1 - ρ²) w_k of noise w (d, w, n), within each window."""
        if self.view.colour is None or not self.view.colour.any():
            return white
        noise = white.copy()
        for number, colour in enumerate(self.view.colour):
            mine = self.view.groups == number
            driven = np.sqrt(1.0 - colour**2) * white[:, mine]
            driven[..., 0] = white[:, mine, 0]
            noise[:, mine] = lfilter([1.0], [1.0, -colour], driven)
        return noise

    @property
    def _noise(self) -> np.ndarray:
        return self.view.noise[self.view.groups][:, None]

    def _cleaned(self, rows: np.ndarray) -> np.ndarray:
        """Rows (k, w, n) without what the windows' start states take up."""
        along = np.swapaxes(self._bases, 1, 2) @ rows[..., None]
        return rows - (self._bases @ along)[..., 0]

    def _estimate(self, record: np.ndarray) -> np.ndarray:
        """Estimated over true noise (w, 1) of records in units of the true one (w, n)."""
        of_window = np.array(self.view.estimated)[self.view.groups]
        found = np.ones(len(of_window))
        if of_window.any():
            mine = [self.view.groups == number for number in np.unique(self.view.groups[of_window])]
            rate = 1.0 / float(np.diff(self.view.time[mine[0]][0, :2])[0])
            found[of_window] = shared_noise([record[one][self.view.inside[one]] for one in mine], rate)[0]
        return found[:, None]


def _bases(columns: np.ndarray) -> np.ndarray:
    """Orthonormal bases (w, n, l) of the spans of columns (w, n, l); a column of zeros for each missing rank."""
    if not columns.shape[2]:
        return columns
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.where((sizes > _RANK * np.maximum(sizes[:, :1], 1e-300))[:, None, :], left, 0.0)
