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


@dataclass(frozen=True, eq=False)
class Seen:
    """A cause as it is beside the causes that are a part of the noise.

    Attributes
    ----------
    columns : ndarray (m, k)
        F, cleaned, without any of them.
    products, pulls : ndarray (k, k), (k,)
        FᵀF and Fᵀy beside all of them.
    along : tuple of ndarray (j, k)
        What each of them takes: its basis times F beside those before it.
    """

    columns: np.ndarray
    products: np.ndarray
    pulls: np.ndarray
    along: tuple[np.ndarray, ...] = ()


@dataclass(frozen=True, eq=False)
class _Part:
    """A cause that is a part of the noise: all is multiplied by 1 - B D Bᵀ, B (m, j), D = diag(d), and Bᵀ y before."""

    basis: np.ndarray
    d: np.ndarray
    pull: np.ndarray

    def less(self, columns: np.ndarray) -> np.ndarray:
        """Columns (m, k) multiplied so."""
        return columns - self.basis @ (self.d[:, None] * (self.basis.T @ columns))


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
        self._explained: tuple[_Part, ...] = ()
        y = np.concatenate([self._off_local(laid.residual[..., None]), (prior * laid.at)[:, None]])
        self.y = self._whole = self._off_global(y)[:, 0]
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
            y = part.less(y)
        z = np.where(self.laid.inside, y[: self.laid.inside.size, 0].reshape(self.laid.inside.shape), 0.0)
        z[:, 0] = 0.0
        out = z.copy()
        out[:, :-1] -= self.colour * z[:, 1:]
        return out * self.laid.inside

    def seen(self, columns: np.ndarray) -> Seen:
        """A cause F (m, k), cleaned, beside the causes that are a part of the noise."""
        return self.seen_further(Seen(columns, columns.T @ columns, columns.T @ self._whole))

    def seen_further(self, seen: Seen) -> Seen:
        """The same of a cause that was seen beside the first of them: of its columns only products are needed."""
        products, pulls, along = seen.products, seen.pulls, list(seen.along)
        for k, part in enumerate(self._explained[len(along) :], start=len(along)):
            own = part.basis.T @ seen.columns
            for before, taken in zip(self._explained[:k], along, strict=True):
                own -= (part.basis.T @ before.basis) @ (before.d[:, None] * taken)
            twice = (2.0 * part.d - part.d**2)[:, None] * own
            products, pulls = products - own.T @ twice, pulls - twice.T @ part.pull
            along.append(own)
        return Seen(seen.columns, products, pulls, tuple(along))

    def evidence(self, cause: np.ndarray | Seen) -> tuple[float, float]:
        """ln E of a cause F (m, k), cleaned, or as it was seen, and the λ at which it is found."""
        seen = cause if isinstance(cause, Seen) else self.seen(cause)
        total = float(np.trace(seen.products))
        if not total > 0.0:
            return 0.0, 0.0
        sizes, turned = np.linalg.eigh(seen.products)
        return self.weighed(np.maximum(sizes, 0.0), turned.T @ seen.pulls, total)

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
        """The residue with a cause F (m, k), cleaned, of this λ as a part of its noise: y and all that is cleaned by it
        are multiplied by (1 + λ F Fᵀ)^-½."""
        for part in self._explained:
            columns = part.less(columns)
        sizes, turned = np.linalg.eigh(columns.T @ columns)
        kept = sizes > _RANK * sizes[-1]
        basis = columns @ (turned[:, kept] / np.sqrt(sizes[kept]))
        other = copy.copy(self)
        part = _Part(basis, 1.0 - 1.0 / np.sqrt(1.0 + scale * sizes[kept]), basis.T @ self.y)
        other._explained = (*self._explained, part)
        other.y = part.less(self.y[:, None])[:, 0]
        return other

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
