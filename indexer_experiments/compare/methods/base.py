"""What a method of the comparison is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from classifier.dataset import Dataset
from classifier.features import Psd, Scaling


class Fitted(ABC):
    """A method after learning."""

    @abstractmethod
    def logits(self, records: np.ndarray) -> np.ndarray:
        """Logits (n, classes) of records (n, samples), classes in the order of the data set's code book: their softmax
        are the probabilities of the classes."""


class Method(ABC):
    """A way to learn classes from records."""

    @abstractmethod
    def fit(self, dataset: Dataset, seed: int) -> Fitted:
        """Learn from the calibration subset, choose settings on the control subset; all chance comes from `seed`."""


@dataclass(frozen=True, eq=False)
class ScaledFeatures:
    """Features with the scaling of a calibration subset."""

    features: Psd
    scaling: Scaling
    sample_rate: float

    @classmethod
    def fit(cls, features: Psd, dataset: Dataset) -> ScaledFeatures:
        """Scaled on the calibration records of a data set."""
        values = features.compute(dataset.records[dataset.rows("calibration")], dataset.sample_rate)
        return cls(features, Scaling.fit(values), dataset.sample_rate)

    def apply(self, records: np.ndarray) -> np.ndarray:
        """Scaled features (n, count) of records (n, samples)."""
        return self.scaling.apply(self.features.compute(records, self.sample_rate))
