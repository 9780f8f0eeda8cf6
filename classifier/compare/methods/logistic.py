"""Logistic regression: the linear method that a network has to beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from classifier.compare.methods.base import Fitted, Method, ScaledFeatures, cross_entropy
from classifier.dataset import Dataset
from classifier.features import Psd

STRENGTHS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Inverse strengths C of the penalty, of which the control subset takes one."""


def best_logistic(inputs: np.ndarray, dataset: Dataset) -> Pipeline:
    """Logistic regression on standardised inputs (n, count) of all records of a data set, with the C that gives the
    lowest cross entropy on the control subset."""
    calibration, control = dataset.rows("calibration"), dataset.rows("control")
    positions = dataset.codes.positions(dataset.classes)
    best, lowest = None, np.inf
    for strength in STRENGTHS:
        tried = make_pipeline(StandardScaler(), LogisticRegression(C=strength, max_iter=2000))
        tried.fit(inputs[calibration], positions[calibration])
        error = cross_entropy(linear_logits(tried, inputs[control]), positions[control])
        if error < lowest:
            best, lowest = tried, error
    assert best is not None
    return best


def linear_logits(pipeline: Pipeline, inputs: np.ndarray) -> np.ndarray:
    """Logits (n, classes); scikit-learn gives one column where there are two classes."""
    logits = pipeline.decision_function(inputs)
    return logits if logits.ndim == 2 else np.stack([-logits / 2, logits / 2], axis=1)


@dataclass(frozen=True)
class FittedLogistic(Fitted):
    """Coefficients on scaled features."""

    features: ScaledFeatures
    pipeline: Pipeline

    def logits(self, records: np.ndarray) -> np.ndarray:
        return linear_logits(self.pipeline, self.features.apply(records))


@dataclass(frozen=True)
class Logistic(Method):
    """Multinomial logistic regression with a quadratic penalty.

    features  what it sees
    """

    features: Psd

    def fit(self, dataset: Dataset, seed: int) -> FittedLogistic:
        features = ScaledFeatures.fit(self.features, dataset)
        return FittedLogistic(features, best_logistic(features.apply(dataset.records), dataset))
