"""Gradient descent with a learning rate that varies (paper fig. 9, "traingda")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from classifier.trainers.variable_rate import Memory, VariableRate


@dataclass(frozen=True)
class TrainGda(VariableRate):
    """Steepest descent with variable learning rate:  change = −rate · ∂E/∂parameters.

    Parameters and the variation of the rate are those of `VariableRate`.
    Sources: T. P. Vogl et al., Biological Cybernetics 59 (1988) 257–263 (the rule); default numbers as
    documented for MATLAB's traingda.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traingda"

    def change(self, gradient: Tensor, memory: Memory) -> Tensor:
        """Downhill, as far as the rate says."""
        return torch.mul(gradient, -memory.rate, out=memory.change)
