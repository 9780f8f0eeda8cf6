"""Logistic regression as a method of the comparison."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from classifier.dataset import Dataset
from classifier.features import Psd
from classifier.tasks.logistic import LogisticRegression
from indexer_experiments.compare.methods.base import Fitted, Method, ScaledFeatures


@dataclass(frozen=True)
class FittedLogistic(Fitted):
    """Coefficients on scaled features."""

    features: ScaledFeatures
    regression: LogisticRegression

    def logits(self, records: np.ndarray) -> np.ndarray:
        return self.regression.logits(self.features.apply(records))


@dataclass(frozen=True)
class Logistic(Method):
    """`LogisticRegression` on scaled features.

    features  what it sees
    """

    features: Psd

    def fit(self, dataset: Dataset, seed: int) -> FittedLogistic:
        features = ScaledFeatures.fit(self.features, dataset)
        return FittedLogistic(features, LogisticRegression.fit(features.apply(dataset.records), dataset))
