"""Levenberg and Marquardt's damped least squares (paper fig. 9, "trainlm")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import pad

from classifier.network import Mlp
from classifier.trainers.base import Step, Trainer
from classifier.trainers.jacobian import Linearised, linearised
from classifier.trainers.objective import NetworkError, Point
from indexer_env.checks import check_number
from indexer_env.errors import refuse


class _Memory(NamedTuple):
    """Damping λ (n,)."""

    damping: Tensor


@dataclass(frozen=True)
class TrainLm(Trainer):
    """Least squares of the linearised outputs, damped:

        change = −(JᵀJ + λ I)⁻¹ Jᵀ e,   J = ∂outputs/∂parameters,   e = outputs − targets

    The sum of squares falls: step taken, λ × decrease for the next epoch. It does not: λ × increase and again
    within the same epoch, until λ passes its maximum; then the network is stuck.

    damping          λ at the start
    decrease         in (0, 1)
    increase         > 1
    maximum_damping  largest λ

    With fewer outputs · records than parameters the same change is had from the smaller system,
    (JᵀJ + λ I)⁻¹ Jᵀ = Jᵀ (J Jᵀ + λ I)⁻¹.
    Sources: M. T. Hagan, M. B. Menhaj, IEEE Trans. Neural Networks 5 (1994) 989–993; D. W. Marquardt,
    J. SIAM 11 (1963) 431–441. Default numbers as documented for MATLAB's trainlm.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "trainlm"

    damping: float = 1e-3
    decrease: float = 0.1
    increase: float = 10.0
    maximum_damping: float = 1e10

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("TrainLm", "damping", self.damping, low=0.0, low_open=True)
        check_number("TrainLm", "decrease", self.decrease, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number("TrainLm", "increase", self.increase, low=1.0, low_open=True)
        check_number("TrainLm", "maximum_damping", self.maximum_damping, low=0.0, low_open=True)
        if self.maximum_damping < self.damping:
            raise refuse("TrainLm", "maximum_damping", f">= damping = {self.damping:g}", self.maximum_damping)

    def memory_of_one(self, network: Mlp, records: int) -> int:
        """The system to be solved, twice, and J where it is written out, beside what every rule needs."""
        equations = records * network.outputs
        system = 2 * min(equations, network.count) ** 2
        written = 2 * equations * network.count if equations > network.count else 2 * equations * network.hidden
        return super().memory_of_one(network, records) + 8 * (system + written)

    def begin(self, point: Point) -> _Memory:
        """The initial damping."""
        return _Memory(torch.full_like(point.error, self.damping))

    def step(self, at: Point, memory: _Memory, objective: NetworkError) -> Step:
        """One epoch of the rule; a network that is stuck stays where it was."""
        # One network at a time, so that each meets the same arithmetic in a stack as alone.
        systems = [_System(linearised(objective.network, one[None], objective.calibration)) for one in at.parameters]
        point, damping = Point(*(part.clone() for part in at)), memory.damping.clone()
        rows = torch.arange(len(damping), device=damping.device)
        while len(rows):
            changes = torch.cat([systems[i].change(damping[i]) for i in rows.tolist()])
            tried = objective.evaluate(at.parameters[rows] - pad(changes, (0, objective.width - changes.shape[1])))
            lower = tried.error < at.error[rows]
            for whole, part in zip(point, tried, strict=True):
                whole[rows[lower]] = part[lower]
            damping[rows] *= torch.where(lower, self.decrease, self.increase).to(damping)
            rows = rows[~lower & (damping[rows] <= self.maximum_damping)]
        return Step(point, _Memory(damping), damping > self.maximum_damping)


class _System:
    """The linear equations of one network, the smaller of the two forms."""

    def __init__(self, linear: Linearised) -> None:
        self._linear = linear
        self._normal = linear.miss.shape[1] > linear.network.count
        if self._normal:
            jacobian = linear.jacobian()
            self._matrix, self._right = jacobian.transpose(1, 2) @ jacobian, linear.back(linear.miss)
        else:
            self._matrix, self._right = linear.gram(), linear.miss

    def change(self, damping: Tensor) -> Tensor:
        """(JᵀJ + λ I)⁻¹ Jᵀ e (1, count); not a number where rounding leaves no positive definite matrix, which no
        step accepts.
        """
        matrix = self._matrix.clone()
        matrix.diagonal(dim1=1, dim2=2).add_(damping)
        factor, failed = torch.linalg.cholesky_ex(matrix)
        x = torch.cholesky_solve(self._right[:, :, None], factor)[:, :, 0]
        change = x if self._normal else self._linear.back(x)
        return torch.where(failed[:, None] > 0, torch.nan, change)
