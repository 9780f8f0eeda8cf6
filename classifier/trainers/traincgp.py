"""Conjugate gradients with the update of Polak and Ribière (paper fig. 9, "traincgp")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from torch import Tensor

from classifier.trainers.conjugate_gradient import ConjugateGradient


@dataclass(frozen=True)
class TrainCgp(ConjugateGradient):
    """β = g_new·(g_new − g_old) / |g_old|²; all else as in `ConjugateGradient`.

    Source: E. Polak, G. Ribière, Revue française d'informatique et de recherche opérationnelle 3-R1 (1969)
    35–43.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traincgp"

    def beta(self, old: Tensor, new: Tensor) -> Tensor:
        """Turns to 0, hence to steepest descent, where the gradient hardly changes."""
        return (new * (new - old)).sum(dim=1) / old.square().sum(dim=1)
