"""Scaled conjugate gradients: a trust region in place of the line search (paper fig. 9, "trainscg")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from classifier.trainers.base import Step, Trainer
from classifier.trainers.objective import Objective, Point, keep
from indexer_env.checks import check_number


class _Memory(NamedTuple):
    """Direction p (n, count); per network (n,): pᵀEʺp, the scale λ, whether the last step was taken, and steps
    taken since the last steepest descent.
    """

    direction: Tensor
    curvature: Tensor
    scale: Tensor
    success: Tensor
    steps: Tensor


@dataclass(frozen=True)
class TrainScg(Trainer):
    """Conjugate directions with the length of the step from a model of the error along them:

        s = (E′(w + σ/|p| · p) − E′(w)) |p|/σ,   δ = pᵀs + λ |p|²,   α = −pᵀE′(w) / δ

    δ <= 0: λ grows until the model bends upwards. Δ = (real decrease) / (decrease of the model):
    Δ >= 0 takes the step, Δ >= 0.75 divides λ by 4, Δ < 0.25 adds δ (1 − Δ) / |p|² to it. The next direction
    is −g_new + β p with β = (|g_new|² − g_new·g_old) / −pᵀg_old, and −g_new after as many steps as there are
    parameters.

    sigma         relative length of the difference that stands for the second derivative
    scale         λ at the start
    minimum_step  length of a step, in the space of the parameters, that is too small to go on when refused

    One epoch is one step tried; two gradients after a step taken, one after a step refused.
    Source: M. F. Møller, Neural Networks 6 (1993) 525–533, with its letters and its numbers in the middle of
    the ranges that it names (σ <= 1e-4, λ <= 1e-6).

    Raises ParameterError.
    """

    kind: ClassVar[str] = "trainscg"

    sigma: float = 5e-5
    scale: float = 5e-7
    minimum_step: float = 1e-10

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("TrainScg", "sigma", self.sigma, low=0.0, low_open=True)
        check_number("TrainScg", "scale", self.scale, low=0.0, low_open=True)
        check_number("TrainScg", "minimum_step", self.minimum_step, low=0.0)

    def begin(self, point: Point) -> _Memory:
        """Steepest descent with the initial scale."""
        zero = torch.zeros_like(point.error)
        return _Memory(-point.gradient, zero, zero + self.scale, zero == 0, zero)

    def step(self, at: Point, memory: _Memory, objective: Objective) -> Step:
        """One epoch of the rule; a network whose step is refused stays where it was."""
        p, scale = memory.direction, memory.scale
        length2 = p.square().sum(dim=1)
        curvature = self._curvature(at, memory, length2, objective)

        delta = curvature + scale * length2
        uphill = delta <= 0
        raised = 2 * (scale - delta / length2)
        # δ' = δ + (λ' − λ) |p|² with the raised λ' is −δ + λ |p|²
        delta, scale = torch.where(uphill, scale * length2 - delta, delta), torch.where(uphill, raised, scale)

        mu = -(p * at.gradient).sum(dim=1)
        alpha = mu / delta
        tried = objective.evaluate(torch.addcmul(at.parameters, alpha[:, None], p))
        ratio = 2 * delta * (at.error - tried.error) / mu.square()
        taken = ratio >= 0
        point = keep(at, tried, ~taken)

        scale_after = torch.where(taken & (ratio >= 0.75), scale / 4, scale)
        scale_after = torch.where(~(ratio >= 0.25), scale_after + delta * (1 - ratio) / length2, scale_after)
        steps = memory.steps + taken
        whole = taken & (steps >= p.shape[1])
        new = point.gradient
        beta = torch.where(whole, 0.0, (new * (new - at.gradient)).sum(dim=1) / mu)
        direction = torch.where(taken[:, None], torch.addcmul(-new, beta[:, None], p), p)
        stuck = ~taken & ~(alpha.abs() * length2.sqrt() > self.minimum_step)
        return Step(point, _Memory(direction, curvature, scale_after, taken, torch.where(whole, 0.0, steps)), stuck)

    def _curvature(self, at: Point, memory: _Memory, length2: Tensor, objective: Objective) -> Tensor:
        """pᵀEʺp (n,): by a difference after a step taken, otherwise as it was."""
        rows = memory.success.nonzero()[:, 0]
        if len(rows) == 0:
            return memory.curvature
        p = memory.direction[rows]
        sigma = (self.sigma / length2[rows].sqrt())[:, None]
        ahead = objective.evaluate(torch.addcmul(at.parameters[rows], sigma, p)).gradient
        curvature = memory.curvature.clone()
        curvature[rows] = (p * (ahead - at.gradient[rows])).sum(dim=1) / sigma[:, 0]
        return curvature
