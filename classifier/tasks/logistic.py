"""Multinomial logistic regression: the linear method that a network has to beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_softmax

from classifier.dataset import Dataset
from classifier.tasks.spectrum import Standard

STRENGTHS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Inverse strengths C of the penalty, of which the control subset takes one: from hardly a fit to hardly a penalty."""

_ITERATIONS = 2000


@dataclass(frozen=True, eq=False)
class LogisticRegression:
    """Probabilities of classes, softmax(W z + b), of standardised inputs z.

        W, b minimise  Σ −ln p(true class) + ‖W‖² / (2 C)

    standard  mean and deviation of the inputs over the calibration records
    weights   (classes, count) W
    biases    (classes,) b, without a penalty
    """

    standard: Standard
    weights: np.ndarray
    biases: np.ndarray

    @classmethod
    def fit(cls, inputs: np.ndarray, dataset: Dataset) -> LogisticRegression:
        """Fitted to the inputs (n, count) of the calibration records of a data set, with the C of STRENGTHS that gives
        the lowest cross entropy on its control subset. The problem is convex: nothing is drawn."""
        calibration, control = dataset.rows("calibration"), dataset.rows("control")
        positions, classes = dataset.codes.positions(dataset.classes), len(dataset.codes.classes)
        standard = Standard.fit(inputs[calibration])
        taught = standard.apply(inputs[calibration]), positions[calibration]
        tried = [cls(standard, *_minimum(*taught, classes, strength)) for strength in STRENGTHS]
        return min(tried, key=lambda one: cross_entropy(one.logits(inputs[control]), positions[control]))

    def logits(self, inputs: np.ndarray) -> np.ndarray:
        """Logits (n, classes) of inputs (n, count)."""
        return self.standard.apply(inputs) @ self.weights.T + self.biases


def cross_entropy(logits: np.ndarray, positions: np.ndarray) -> float:
    """Mean over records of −ln p of the true class, from logits (n, classes) and positions (n,) of true classes."""
    return float(-log_softmax(logits, axis=1)[np.arange(len(positions)), positions].mean())


def _minimum(inputs: np.ndarray, positions: np.ndarray, classes: int, strength: float) -> tuple[np.ndarray, np.ndarray]:
    """W and b for inputs (n, count) of classes at positions (n,)."""
    wanted = np.eye(classes)[positions]

    def loss(parameters: np.ndarray) -> tuple[float, np.ndarray]:
        matrix = parameters.reshape(classes, -1)
        weights, biases = matrix[:, :-1], matrix[:, -1]
        logarithms = log_softmax(inputs @ weights.T + biases, axis=1)
        error = np.exp(logarithms) - wanted
        slope = np.column_stack([error.T @ inputs + weights / strength, error.sum(axis=0)])
        return float(-(wanted * logarithms).sum() + 0.5 * (weights**2).sum() / strength), slope.ravel()

    start = np.zeros(classes * (inputs.shape[1] + 1))
    found = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": _ITERATIONS})
    matrix = found.x.reshape(classes, -1)
    return matrix[:, :-1], matrix[:, -1]
