"""A motion law as quintic polynomials over one cam turn, the form the compiled kernel reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from indexer_env.errors import refuse


@dataclass(frozen=True, eq=False)
class LawPieces:
    """beta(u) = sum_j coefficients[k, j] (u - edges[k])^j between edges k and k + 1, with u in cam turns.

    edges         (K + 1,)  cam turns, ascending, from 0 to 1
    coefficients  (K, 6)    rad / turn^j; beta(1) - beta(0) is the advance of one station
    breaks        (K + 1,)  True where the law itself changes its formula: at both ends of a motion (the third
                            derivative jumps) and at inner junctions (the fourth does). An integrator of order
                            4 must land on both, because the second derivative of the law enters the equations
                            of motion.
    The arrays are read-only. beta, dbeta/du and d2beta/du2 are continuous, over the turn's end too.
    """

    edges: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    breaks: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for name, dtype in (("edges", np.float64), ("coefficients", np.float64), ("breaks", np.bool_)):
            array = np.array(getattr(self, name), dtype=dtype, order="C")
            if not np.isfinite(array).all():
                raise refuse("LawPieces", name, "finite", array[~np.isfinite(array)][0])
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        count = self.edges.size - 1
        if self.edges.ndim != 1 or count < 1 or self.edges[0] != 0.0 or self.edges[-1] != 1.0:
            raise refuse("LawPieces", "edges", "a row from 0 to 1 cam turn", self.edges)
        if not (np.diff(self.edges) > 0.0).all():
            raise refuse("LawPieces", "edges", "strictly ascending", self.edges)
        if self.coefficients.shape != (count, 6):
            raise refuse("LawPieces", "coefficients", f"of shape ({count}, 6)", self.coefficients.shape)
        if self.breaks.shape != (count + 1,):
            raise refuse("LawPieces", "breaks", f"of shape ({count + 1},)", self.breaks.shape)

    def __reduce__(self) -> tuple[type[LawPieces], tuple[NDArray, NDArray, NDArray]]:
        # Rebuilding through the constructor keeps the arrays of a copied or unpickled object read-only.
        return LawPieces, (self.edges, self.coefficients, self.breaks)

    def evaluate(self, phase: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """beta [rad], dbeta/du [rad/turn], d2beta/du2 [rad/turn^2] at u in [0, 1] cam turns, each shaped like
        it."""
        u = np.asarray(phase, dtype=np.float64)
        k = np.clip(np.searchsorted(self.edges, u, side="right") - 1, 0, self.edges.size - 2)
        t = u - self.edges[k]
        c0, c1, c2, c3, c4, c5 = np.moveaxis(self.coefficients[k], -1, 0)
        return (
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        )


def quintic_hermite(
    width: float, y: NDArray[np.float64], v: NDArray[np.float64], a: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coefficients (n, 6), rising powers, of quintics that meet y, v, a (n + 1,) at edges `width` apart."""
    v0, v1 = v[:-1] * width, v[1:] * width
    a0, a1 = a[:-1] * width**2, a[1:] * width**2
    step = np.diff(y)
    scaled = [
        y[:-1],
        v0,
        0.5 * a0,
        10.0 * step - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * step + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * step - 3.0 * (v0 + v1) - 0.5 * (a0 - a1),
    ]
    return np.stack([c / width**j for j, c in enumerate(scaled)], axis=1)
