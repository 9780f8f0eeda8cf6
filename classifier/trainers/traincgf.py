"""Conjugate gradients with the update of Fletcher and Reeves (paper fig. 9, "traincgf")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from torch import Tensor

from classifier.trainers.conjugate_gradient import ConjugateGradient


@dataclass(frozen=True)
class TrainCgf(ConjugateGradient):
    """β = |g_new|² / |g_old|²; all else as in `ConjugateGradient`.

    Source: R. Fletcher, C. M. Reeves, Computer Journal 7 (1964) 149–154.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traincgf"

    def beta(self, old: Tensor, new: Tensor) -> Tensor:
        """Ratio of the squared lengths."""
        return new.square().sum(dim=1) / old.square().sum(dim=1)
