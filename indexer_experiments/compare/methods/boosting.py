"""Gradient-boosted trees, usually the strongest method on a table of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier

from classifier.dataset import Dataset
from classifier.features import Psd
from indexer_experiments.compare.methods.base import Fitted, Method, ScaledFeatures


@dataclass(frozen=True)
class FittedBoosting(Fitted):
    """Trees on scaled features."""

    features: ScaledFeatures
    trees: HistGradientBoostingClassifier

    def logits(self, records: np.ndarray) -> np.ndarray:
        return np.log(np.maximum(self.trees.predict_proba(self.features.apply(records)), 1e-12))


@dataclass(frozen=True)
class Boosting(Method):
    """Histogram gradient boosting; the control subset says when to stop. Trees see no difference between densities
    and their logarithms.

    features    what it sees
    iterations  most rounds of one tree per class
    patience    rounds without a better cross entropy on the control subset after which it stops
    """

    features: Psd
    iterations: int = 200
    patience: int = 10

    def fit(self, dataset: Dataset, seed: int) -> FittedBoosting:
        features = ScaledFeatures.fit(self.features, dataset)
        trees = HistGradientBoostingClassifier(
            max_iter=self.iterations,
            early_stopping=True,  # pyright: ignore[reportArgumentType]  (taken for a text from its default "auto")
            n_iter_no_change=self.patience,
            random_state=seed,
        )
        subsets = [
            (features.apply(dataset.records[rows]), dataset.codes.positions(dataset.classes[rows]))
            for rows in (dataset.rows("calibration"), dataset.rows("control"))
        ]
        trees.fit(*subsets[0], X_val=subsets[1][0], y_val=subsets[1][1])
        return FittedBoosting(features, trees)
