"""Quasi-Newton with the update of Broyden, Fletcher, Goldfarb and Shanno (paper fig. 9, "trainbfg")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.network import Mlp
from classifier.trainers.descent import Descent, Searched, Turn
from classifier.trainers.objective import Point
from indexer_env.checks import check_integer


class _Own(NamedTuple):
    """The inverse Hessian H of each network, as the sum of its updates:

        H v = γ v + Σ_i [s_i z_i] M_i [s_i·v, z_i·v]ᵀ

    scale (n,) γ; vectors (n, k, 2, count) the pairs; weights (n, k, 2, 2) the M_i, zero where unused; used
    (n,) updates so far. The first axis after networks grows when it is full.
    """

    scale: Tensor
    vectors: Tensor
    weights: Tensor
    used: Tensor


@dataclass(frozen=True)
class TrainBfg(Descent):
    """d = −H g with H the BFGS estimate of the inverse Hessian:

        H_new = H + (1 + y·z / s·y) s sᵀ / s·y − (s zᵀ + z sᵀ) / s·y,   z = H y,
        s = step,   y = change of the gradient

    updates  updates after which H begins again

    H begins as the unit matrix, and before its first update becomes γ = s·y / y·y times that. It is never
    written out: it is the sum of its updates, all of which are kept, so that a step costs 8 · updates · count
    operations rather than a few count². The other parameters are those of `Descent`.
    Sources: J. E. Dennis, R. B. Schnabel, Numerical Methods for Unconstrained Optimization (1983) §9.2;
    D. F. Shanno, K.-H. Phua, Mathematical Programming 14 (1978) 149–160 (the factor γ).

    Raises ParameterError.
    """

    kind: ClassVar[str] = "trainbfg"

    flatness: float = 0.9
    updates: int = 250

    def __post_init__(self) -> None:
        super().__post_init__()
        check_integer("TrainBfg", "updates", self.updates, low=1)

    def memory_of_one(self, network: Mlp, records: int) -> int:
        """All updates, beside what every rule needs."""
        return super().memory_of_one(network, records) + 8 * 2 * self.updates * network.count

    def start(self, point: Point) -> _Own:
        """The unit matrix."""
        (n, count), like = point.parameters.shape, point.parameters
        used = torch.zeros(n, dtype=torch.long, device=like.device)
        return _Own(torch.ones_like(point.error), like.new_zeros(n, 0, 2, count), like.new_zeros(n, 0, 2, 2), used)

    def turn(self, searched: Searched, own: _Own) -> Turn:
        """Update H by the last search, then go where it says; the unit step is tried first."""
        gradient = searched.new.gradient
        s = searched.length[:, None] * searched.direction
        y = gradient - searched.old.gradient
        sy, yy = (s * y).sum(dim=1), y.square().sum(dim=1)
        valid = sy > 1e-14 * yy
        safe = torch.where(valid, sy, 1.0)
        own = own._replace(scale=torch.where(valid & (own.used == 0), sy / yy, own.scale))

        h_gradient = _times(own, gradient)
        # H g_old = −direction but before the first update, which changes γ.
        z = torch.where((own.used == 0)[:, None], own.scale[:, None] * y, h_gradient + searched.direction)
        weights = _weights((y * z).sum(dim=1), safe) * valid[:, None, None]
        vectors = torch.stack([s, z], dim=1)
        inner = (vectors * gradient[:, None]).sum(dim=2)
        outer = (weights * inner[:, None]).sum(dim=2)
        direction = -h_gradient - outer[:, :1] * s - outer[:, 1:] * z
        own = _append(own, vectors, weights)
        own = self.forget(own, own.used > self.updates)
        return Turn(direction, torch.ones_like(sy), own)

    def forget(self, own: _Own, rows: Tensor) -> _Own:
        """The unit matrix in these rows."""
        return own._replace(
            weights=torch.where(rows[:, None, None, None], 0.0, own.weights),
            used=torch.where(rows, 0, own.used),
        )


def _weights(yz: Tensor, sy: Tensor) -> Tensor:
    """The matrix M (n, 2, 2) of one update."""
    cross = -1 / sy
    both = torch.stack([(1 + yz / sy) / sy, cross, cross, torch.zeros_like(sy)], dim=1)
    return both.unflatten(1, (2, 2))


def _times(own: _Own, v: Tensor) -> Tensor:
    """H v (n, count), network by network: each has a number of updates of its own, and large enough matrices."""
    product = own.scale[:, None] * v
    for i, used in enumerate(own.used.tolist()):
        vectors = own.vectors[i, :used]
        inner = torch.mv(vectors.flatten(0, 1), v[i]).view(used, 2, 1)
        outer = (own.weights[i, :used] * inner.transpose(1, 2)).sum(dim=2)
        product[i] += torch.mv(vectors.flatten(0, 1).T, outer.flatten())
    return product


def _append(own: _Own, vectors: Tensor, weights: Tensor) -> _Own:
    """With one more update (n, 2, count) and (n, 2, 2) per network; the room doubles when it is full."""
    grown = own
    if int(own.used.max()) == own.vectors.shape[1]:
        more = max(8, own.vectors.shape[1])
        grown = own._replace(
            vectors=torch.nn.functional.pad(own.vectors, (0, 0, 0, 0, 0, more)),
            weights=torch.nn.functional.pad(own.weights, (0, 0, 0, 0, 0, more)),
        )
    rows = torch.arange(len(vectors), device=vectors.device)
    grown.vectors[rows, own.used] = vectors
    grown.weights[rows, own.used] = weights
    return grown._replace(used=own.used + 1)
