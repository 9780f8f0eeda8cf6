"""A place in the parameter space of a model and a hypothesis, and how well it explains the records."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from discrepancy.model import Hypothesis, Model


@dataclass(frozen=True, eq=False)
class Point:
    """A place in the parameter space and how well it explains the records.

    Attributes
    ----------
    hypothesis : Hypothesis
    z : ndarray (g,)
        Scaled global parameters: the model's, then the hypothesis's.
    states : ndarray (w, l)
        Scaled start states.
    squares : ndarray (w,)
        Sum of squared normalised residuals of each window.
    cost : float
        F.
    """

    hypothesis: Hypothesis
    z: np.ndarray
    states: np.ndarray
    squares: np.ndarray
    cost: float

    @property
    def values(self) -> tuple[float, ...]:
        """The hypothesis's own parameters [units]."""
        own = self.z[len(self.z) - len(self.hypothesis.parameters) :]
        return tuple(p.value(z) for p, z in zip(self.hypothesis.parameters, own, strict=True))

    def pulls(self, model: Model) -> np.ndarray:
        """How far the numbers that were stated of single records are pulled (k,) [standard deviations]."""
        return self.z[[k for k, p in enumerate(model.parameters) if p.of_record and p.known]]

    def strain(self, model: Model) -> float:
        """The farthest of these pulls [standard deviations]; 0 where nothing was stated."""
        return float(np.abs(self.pulls(model)).max(initial=0.0))

    def bent(self, model: Model) -> float:
        """Mean square of the changes of what is known of the machine [variances]; 0 where nothing was known."""
        own = self.z[[k for k, p in enumerate(model.parameters) if p.known and not p.of_record]]
        return float((own**2).mean()) if len(own) else 0.0

    def level(self, model: Model) -> float:
        """rms of the normalised residuals, of those that tell anything; 1 is the noise."""
        return math.sqrt(float(self.squares.sum()) / max(float(model.told(self.hypothesis, self.z).sum()), 1.0))

    def dispersion(self, model: Model) -> float:
        """φ: the median of the windows' mean squares, at least what is tolerated."""
        return max(model.tolerated, float(np.median(self.squares / model.counts)))
