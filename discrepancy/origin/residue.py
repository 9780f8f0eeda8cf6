"""What a fit has left, ready to be explained: everything that the fit may move is projected out, and noise is white.

With r the residuals at a fitted place, G their derivatives by the globals, L_w by a window's start state, W the filter
that whitens noise and P the projection onto what neither G nor L explains, priors counting as further rows,

    y = P W r,    and a missing cause with readings X per unit of its sizes explains   F = P W X

Sizes a ~ N(0, λ σ²), whatever they are, and noise N(0, σ²), σ unknown, give the evidence of the cause over none

    ln E = -N/2 ln(1 - Σ λ c²/(1 + λ s)/yᵀy) - ½ Σ ln(1 + λ s),    FᵀF = V diag(s) Vᵀ,  c = Vᵀ Fᵀ y

(MacKay, Neural Computation 4 (1992) 415). λ is the best one of a few, so that a cause with many sizes pays for each one
that the records tell, and no held-out records are needed: the evidence is that of predicting each sample by those
before it.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.noise import autoregression

_SHARES = (0.01, 0.1, 1.0, 10.0)
"""What a cause explains before the records are seen, over the noise: λ Σs/N."""

_RANK = 1e-9


@dataclass(frozen=True, eq=False)
class Laid:
    """Residuals of windows with all that their fit may move.

    Attributes
    ----------
    residual : ndarray (w, n)
        Over the noise.
    by_global : ndarray (w, n, g)
        Derivatives by the globals that move.
    by_local : ndarray (w, n, l)
        By the windows' start states.
    known, at : ndarray (g,)
        1 where a global has a prior, else 0; its scaled value.
    inside : ndarray (w, n) of bool
    groups : ndarray (w,) of int
        Record of each window.
    time : ndarray (w, n)
        Since the record's first sample [s].
    step : ndarray (w,)
        Time between samples [s].
    """

    residual: np.ndarray
    by_global: np.ndarray
    by_local: np.ndarray
    known: np.ndarray
    at: np.ndarray
    inside: np.ndarray
    groups: np.ndarray
    time: np.ndarray
    step: np.ndarray


class Residue:
    """The residuals y (m,) of `laid`, cleaned and white; `colour` is the coefficient of the noise's autoregression from
    sample to sample, `noise` the variance of what it adds."""

    def __init__(self, laid: Laid) -> None:
        self.laid = laid
        rows = [row[inside] for row, inside in zip(laid.residual, laid.inside, strict=True)]
        self.colour, self.noise = autoregression(rows, 1.0 / float(np.median(laid.step))) or (0.0, 1.0)
        basis, sizes, _ = np.linalg.svd(self._whitened(laid.by_local), full_matrices=False)
        kept = sizes > _RANK * np.maximum(sizes[:, :1], 1e-300)
        self._local = basis * kept[:, None, :]
        # a row of the prior is as uncertain as a white sample
        prior = laid.known * math.sqrt(self.noise)
        rows = np.concatenate([self._off_local(laid.by_global), np.diag(prior)])
        rows = rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        basis, sizes, _ = np.linalg.svd(rows, full_matrices=False)
        self._global = basis[:, sizes > 1e-7 * sizes[0]] if len(sizes) else basis
        self._explained: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
        y = np.concatenate([self._off_local(laid.residual[..., None]), (prior * laid.at)[:, None]])
        self.y = self._off_global(y)[:, 0]
        self.samples = float(laid.inside.sum() - kept.sum() - len(laid.inside))

    @property
    def variance(self) -> float:
        """Of y."""
        return float(self.y @ self.y) / self.samples

    def clean(self, readings: np.ndarray) -> np.ndarray:
        """F (m, k) of readings (w, n, k)."""
        flat = self._off_local(readings)
        return self._off_global(np.concatenate([flat, np.zeros((len(self.laid.known), flat.shape[1]))]))

    def before(self) -> np.ndarray:
        """Wᵀ y (w, n): its product with readings is that of y with the readings cleaned and seen through."""
        y = self.y[:, None]
        for part in reversed(self._explained):
            y = less(y, part)
        z = np.where(self.laid.inside, y[: self.laid.inside.size, 0].reshape(self.laid.inside.shape), 0.0)
        z[:, 0] = 0.0
        out = z.copy()
        out[:, :-1] -= self.colour * z[:, 1:]
        return out * self.laid.inside

    def evidence(self, columns: np.ndarray) -> tuple[float, float]:
        """ln E of a cause F (m, k), and the λ at which it is found."""
        products = columns.T @ columns
        total = float(np.trace(products))
        if not total > 0.0:
            return 0.0, 0.0
        sizes, turned = np.linalg.eigh(products)
        sizes, pulls = np.maximum(sizes, 0.0), turned.T @ (columns.T @ self.y)
        return self.weighed(sizes, pulls, total)

    def evidence_together(self, columns: Sequence[np.ndarray]) -> float:
        """ln E of causes √λ F (m, k) side by side."""
        laid = np.concatenate(columns, axis=1) if columns else np.zeros((len(self.y), 0))
        sizes, turned = np.linalg.eigh(laid.T @ laid)
        sizes, pulls = np.maximum(sizes, 0.0), turned.T @ (laid.T @ self.y)
        return self._won(float((pulls**2 / (1.0 + sizes)).sum()), sizes)

    def evidence_by_window(self, readings: np.ndarray) -> float:
        """ln E of a cause whose sizes are each window's own, readings (w, n, k) per unit of them."""
        shape = *readings.shape[:2], -1
        columns = self._off_local(readings).reshape(shape)
        y = self.y[: self.laid.inside.size].reshape(shape)
        sizes, turned = np.linalg.eigh(np.swapaxes(columns, 1, 2) @ columns)
        pulls = np.swapaxes(turned, 1, 2) @ (np.swapaxes(columns, 1, 2) @ y)
        sizes = np.maximum(sizes, 0.0).ravel()
        return self.weighed(sizes, pulls.ravel(), float(sizes.sum()))[0]

    def weighed(self, sizes: np.ndarray, pulls: np.ndarray, total: float) -> tuple[float, float]:
        """ln E and λ, given s, c and Σs."""
        best = (0.0, 0.0)
        for share in _SHARES:
            scale = share * self.samples / total
            taken = float((scale * pulls**2 / (1.0 + scale * sizes)).sum())
            best = max(best, (self._won(taken, scale * sizes), scale))
        return best

    def _won(self, taken: float, sizes: np.ndarray) -> float:
        """ln E where so much of yᵀy is explained, given λ s."""
        share = taken / float(self.y @ self.y)
        return -0.5 * self.samples * math.log(max(1.0 - share, 1e-9)) - 0.5 * float(np.log1p(sizes).sum())

    def without(self, columns: np.ndarray, scale: float) -> Residue:
        """The residue with a cause F (m, k) of this λ as a part of its noise: y and all that is cleaned by it are
        multiplied by (1 + λ F Fᵀ)^-½."""
        sizes, turned = np.linalg.eigh(columns.T @ columns)
        kept = sizes > _RANK * sizes[-1]
        basis = columns @ (turned[:, kept] / np.sqrt(sizes[kept]))
        other = copy.copy(self)
        part = basis, 1.0 - 1.0 / np.sqrt(1.0 + scale * sizes[kept])
        other._explained = (*self._explained, part)
        other.y = less(self.y[:, None], part)[:, 0]
        return other

    def seen_through(self, columns: np.ndarray) -> np.ndarray:
        """F (m, k), cleaned, as it is beside the causes that are a part of the noise."""
        for part in self._explained:
            columns = less(columns, part)
        return columns

    def seen_through_last(self, columns: np.ndarray) -> np.ndarray:
        """The same of columns that were seen through all of these causes but the last one."""
        return less(columns, self._explained[-1])

    def _whitened(self, rows: np.ndarray) -> np.ndarray:
        """W X of rows (w, n, k), whose first sample, which nothing predicts, is left out."""
        out = rows.copy()
        out[:, 1:] -= self.colour * rows[:, :-1]
        out[:, 0] = 0.0
        return out * self.laid.inside[..., None]

    def _off_local(self, rows: np.ndarray) -> np.ndarray:
        """Whitened rows (w n, k) without what the windows' start states explain."""
        white = self._whitened(rows)
        white -= self._local @ (np.swapaxes(self._local, 1, 2) @ white)
        return white.reshape(rows.shape[0] * rows.shape[1], rows.shape[2])

    def _off_global(self, rows: np.ndarray) -> np.ndarray:
        return rows - self._global @ (self._global.T @ rows)


def less(columns: np.ndarray, part: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Columns (m, k) of which a basis (m, j) keeps 1 - d (j,)."""
    basis, d = part
    return columns - basis @ (d[:, None] * (basis.T @ columns))
