"""Normal equations with an arrow shape: few global parameters, and local ones that touch one window each.

    [ A   C ] [ x ]     [ a ]        A (g, g) global, B_w (l, l) of window w, C_w (g, l) between the two
    [ Cᵀ  B ] [ y ] = - [ b ]

Eliminating the local steps y_w = -B_w⁻¹ (b_w + C_wᵀ x) leaves g equations (Schur complement), whatever the number of
windows (Triggs et al., Bundle adjustment: a modern synthesis, 2000, section 6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FLOOR = 1e-4
"""Curvature in scaled coordinates that every local parameter has at least: a prior 100 scales wide."""

_ROUNDING = 1e-14
"""The same over a window's largest, where that is more: two states that act alike differ by nothing but rounding."""

_LEVEL = 0.03
"""Share of the mean curvature by which every global parameter is damped beside its own curvature."""


@dataclass(frozen=True, eq=False)
class Arrow:
    """Normal equations of weighted windows; leading axes, if any, hold several systems side by side.

    Attributes
    ----------
    A : ndarray (..., g, g)
    a : ndarray (..., g)
    B : ndarray (..., w, l, l)
    b : ndarray (..., w, l)
    C : ndarray (..., w, g, l)
    """

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    b: np.ndarray
    C: np.ndarray

    def step(self, damping: float, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Damped step (..., g), (..., w, l); parameters that are not `free` (..., g) stay."""
        reduced, right, inverse = self.reduced(damping)
        # the others have equations of their own: x = 0
        both = free[..., :, None] & free[..., None, :]
        reduced = np.where(both, reduced, _along(~free))
        step = -np.linalg.solve(reduced, np.where(free, right, 0.0)[..., None])[..., 0]
        pulled = self.b + (step[..., None, None, :] @ self.C)[..., 0, :]
        return step, -(inverse @ pulled[..., None])[..., 0]

    def reduced(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Schur complement (..., g, g), its right side (..., g) and the inverses of the local blocks (..., w, l, l)."""
        diagonal = np.diagonal(self.B, axis1=-2, axis2=-1)
        floor = np.maximum(_FLOOR, _ROUNDING * diagonal.max(axis=-1, initial=0.0, keepdims=True))
        blocks = self.B + _along(damping * diagonal + floor)
        inverse = np.linalg.inv(blocks) if self.B.shape[-1] else blocks
        weighted, across = _flat(self.C @ inverse), _flat(self.C)
        diagonal = np.diagonal(self.A, axis1=-2, axis2=-1)
        own = damping * (diagonal + _LEVEL * diagonal.mean(axis=-1, keepdims=True)) + 1e-9
        reduced = self.A + _along(own) - weighted @ np.swapaxes(across, -1, -2)
        local = self.b.reshape(*self.b.shape[:-2], -1, 1)
        return reduced, self.a - (weighted @ local)[..., 0], inverse


def _along(diagonal: np.ndarray) -> np.ndarray:
    """Diagonal matrices (..., n, n)."""
    return np.eye(diagonal.shape[-1]) * diagonal[..., None, :]


def _flat(blocks: np.ndarray) -> np.ndarray:
    """Blocks (..., w, g, l) side by side, (..., g, w l)."""
    *lead, _, g, _ = blocks.shape
    return np.moveaxis(blocks, -3, -2).reshape(*lead, g, -1)


def arrow(residual: np.ndarray, by_global: np.ndarray, by_local: np.ndarray, weights: np.ndarray) -> Arrow:
    """Normal equations of residuals (w, n), Jacobians (g, w, n) and (l, w, n), and window weights (w,)."""
    root = np.sqrt(weights)[:, None]
    r, G, L = residual * root, by_global * root, by_local * root
    flat = G.reshape(len(G), -1)
    across, along = np.moveaxis(L, 0, 1), np.moveaxis(G, 0, 1)
    turned = np.swapaxes(across, 1, 2)
    return Arrow(flat @ flat.T, flat @ r.ravel(), across @ turned, (across @ r[:, :, None])[:, :, 0], along @ turned)


class Slopes:
    """Jacobians of windows by the globals (g, w, n) and by the local parameters (l, w, n), for the normal equations of
    many residuals and window weights: the Jacobians' products, which cost most, are taken once."""

    def __init__(self, by_global: np.ndarray, by_local: np.ndarray) -> None:
        self._count = len(by_global)
        self._rows = np.concatenate([by_global, by_local]).swapaxes(0, 1).copy()
        self._products = self._rows @ self._rows.swapaxes(1, 2)

    def pulls(self, residual: np.ndarray) -> np.ndarray:
        """Half the slopes (..., w, g + l) of each window's sum of squares at residuals (..., w, n)."""
        return (self._rows @ residual[..., None])[..., 0]

    def arrow(self, pulls: np.ndarray, weights: np.ndarray) -> Arrow:
        """Normal equations of residuals with these pulls (..., w, g + l), and of window weights (..., w)."""
        g, each = self._count, weights[..., None, None]
        A = np.tensordot(weights, self._products[:, :g, :g], 1)
        weighted = self._products[:, :, g:] * each
        pulled = pulls * weights[..., None]
        return Arrow(A, pulled[..., :g].sum(axis=-2), weighted[..., g:, :], pulled[..., g:], weighted[..., :g, :])

    def squares(self, at_rest: np.ndarray, pulls: np.ndarray, step: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Sums of squares (..., w) after steps (..., g), (..., w, l) from residuals with these sums (..., w) and pulls
        (..., w, g + l), as far as they are linear: ‖r + J s‖² = ‖r‖² + 2 s·Jᵀr + s·JᵀJ s."""
        shared = np.broadcast_to(step[..., None, :], (*local.shape[:-1], step.shape[-1]))
        both = np.concatenate([shared, local], axis=-1)
        bent = (both[..., None, :] @ self._products)[..., 0, :]
        return np.maximum(at_rest + ((2.0 * pulls + bent) * both).sum(axis=-1), 0.0)
