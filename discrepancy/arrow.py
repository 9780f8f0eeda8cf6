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
    """Normal equations of weighted windows.

    Attributes
    ----------
    A : ndarray (g, g)
    a : ndarray (g,)
    B : ndarray (w, l, l)
    b : ndarray (w, l)
    C : ndarray (w, g, l)
    """

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    b: np.ndarray
    C: np.ndarray

    def step(self, damping: float, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Damped step (g,), (w, l); parameters that are not `free` (g,) stay."""
        reduced, right, inverse = self.reduced(damping)
        step = np.zeros(len(self.a))
        step[free] = -np.linalg.solve(reduced[np.ix_(free, free)], right[free])
        local = -np.einsum("wij,wj->wi", inverse, self.b + np.einsum("wgi,g->wi", self.C, step))
        return step, local

    def reduced(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Schur complement (g, g), its right side (g,) and the inverses of the local blocks (w, l, l)."""
        size = self.B.shape[-1]
        diagonal = np.einsum("wii->wi", self.B)
        floor = np.maximum(_FLOOR, _ROUNDING * diagonal.max(axis=1, initial=0.0, keepdims=True))
        blocks = self.B + np.eye(size) * (damping * diagonal + floor)[:, :, None]
        inverse = np.linalg.inv(blocks) if size else blocks
        weighted = np.einsum("wgi,wij->wgj", self.C, inverse)
        diagonal = np.diag(self.A)
        reduced = (
            self.A
            + np.diag(damping * (diagonal + _LEVEL * diagonal.mean()) + 1e-9)
            - np.einsum("wgj,whj->gh", weighted, self.C)
        )
        return reduced, self.a - np.einsum("wgj,wj->g", weighted, self.b), inverse


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
        """Half the slope (w, g + l) of each window's sum of squares at residuals (w, n)."""
        return (self._rows @ residual[:, :, None])[:, :, 0]

    def arrow(self, pulls: np.ndarray, weights: np.ndarray) -> Arrow:
        """Normal equations of residuals with these pulls (w, g + l), and of window weights (w,)."""
        g = self._count
        A = np.tensordot(weights, self._products[:, :g, :g], 1)
        weighted = self._products[:, :, g:] * weights[:, None, None]
        return Arrow(A, weights @ pulls[:, :g], weighted[:, g:], pulls[:, g:] * weights[:, None], weighted[:, :g])

    def squares(self, at_rest: np.ndarray, pulls: np.ndarray, step: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Sums of squares (w,) after a step (g,), (w, l) from residuals with these sums (w,) and pulls (w, g + l), as
        far as they are linear: ‖r + J s‖² = ‖r‖² + 2 s·Jᵀr + s·JᵀJ s."""
        both = np.concatenate([np.broadcast_to(step, (len(local), len(step))), local], axis=1)
        bent = (both[:, None] @ self._products)[:, 0]
        return np.maximum(at_rest + ((2.0 * pulls + bent) * both).sum(axis=1), 0.0)
