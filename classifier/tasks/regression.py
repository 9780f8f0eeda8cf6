"""Kernel ridge regression: smooth functions of the features in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve
from scipy.spatial.distance import cdist

from indexer_env.checks import check_number
from indexer_env.errors import refuse

CENTRES = 1000
"""Most records at which kernels stand: bounds time and size however long the data set."""

FOLDS = 5
WIDTHS = (0.5, 1.0, 2.0)
"""Widths that are tried, as multiples of the median distance between centres."""
RIDGES = (1e-3, 1e-2, 1e-1)


@dataclass(frozen=True, eq=False)
class KernelRidge:
    """A sum of Gaussian bells around some of the records.

        f(x) = b + Σ_i a_i exp(−|x − x_i|² / 2 w²)

    centres  (m, d) x_i
    width    w > 0, in the unit of x
    weights  (m, k) a_i, for k outputs
    offset   (k,) b

    With all records as centres it is the mean of a Gaussian process. Source: C. E. Rasmussen, C. K. I. Williams,
    Gaussian Processes for Machine Learning (2006), §2.2 and eq. 8.14 (fewer centres). Raises ParameterError.
    """

    centres: np.ndarray
    width: float
    weights: np.ndarray
    offset: np.ndarray

    def __post_init__(self) -> None:
        check_number("KernelRidge", "width", self.width, low=0.0, low_open=True)
        wanted = (len(self.centres), self.offset.size)
        if self.centres.ndim != 2 or self.weights.shape != wanted:
            raise refuse("KernelRidge", "weights", f"of shape {wanted}", self.weights.shape)

    def predict(self, inputs: np.ndarray) -> np.ndarray:
        """Values (n, k) at inputs (n, d)."""
        return self.offset + _bells(inputs, self.centres, self.width) @ self.weights


def _bells(inputs: np.ndarray, centres: np.ndarray, width: float) -> np.ndarray:
    return np.exp(-cdist(inputs, centres, "sqeuclidean") / (2.0 * width**2))


def fit_at(inputs: np.ndarray, targets: np.ndarray, centres: np.ndarray, width: float, ridge: float) -> KernelRidge:
    """Regression of targets (n, k) on inputs (n, d) with bells of a width around centres (m, d).

    a solves (KᵀK + λK_c) a = Kᵀ(y − b), K (n, m) the bells at the inputs, K_c at the centres, λ = `ridge`, b the mean
    target.
    """
    bells, offset = _bells(inputs, centres, width), targets.mean(axis=0)
    penalty = ridge * _bells(centres, centres, width)
    return KernelRidge(centres, width, _weights(bells.T @ bells + penalty, bells.T @ (targets - offset)), offset)


def _weights(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    # The jitter keeps the matrix positive definite where two centres are almost one.
    return solve(matrix + 1e-9 * np.trace(matrix) / len(matrix) * np.eye(len(matrix)), right, assume_a="pos")


def cross_fitted(
    inputs: np.ndarray, targets: np.ndarray, groups: np.ndarray, rng: np.random.Generator
) -> tuple[KernelRidge, np.ndarray]:
    """The regression with the width and ridge that predict best what they have not seen, and its errors there.

    inputs (n, d), targets (n, k); groups (n,) stay together when the records are cut into folds, so that no record is
    predicted from its own machine. The errors (n, k) are those of each fold's prediction by the others.
    """
    centres = inputs[np.sort(rng.permutation(len(inputs))[:CENTRES])]
    usual = float(np.median(cdist(centres[:200], centres)))
    folds = _folds(groups, rng)
    best, lowest = (usual, RIDGES[0], np.zeros(targets.shape)), np.inf
    for width in (factor * usual for factor in WIDTHS):
        bells, between = _bells(inputs, centres, width), _bells(centres, centres, width)
        whole, errors = bells.T @ bells, np.empty((len(RIDGES), *targets.shape))
        for fold in folds:
            offset = targets[~fold].mean(axis=0)
            matrix, right = whole - bells[fold].T @ bells[fold], bells[~fold].T @ (targets[~fold] - offset)
            for place, ridge in enumerate(RIDGES):
                told = offset + bells[fold] @ _weights(matrix + ridge * between, right)
                errors[place, fold] = told - targets[fold]
        place = int(np.argmin(np.mean(errors**2, axis=(1, 2))))
        if (error := float(np.mean(errors[place] ** 2))) < lowest:
            best, lowest = (width, RIDGES[place], errors[place]), error
    width, ridge, missed = best
    return fit_at(inputs, targets, centres, width, ridge), missed


def _folds(groups: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Masks (n,) of FOLDS parts of whole groups."""
    labels = rng.permutation(np.unique(groups))
    return [np.isin(groups, part) for part in np.array_split(labels, FOLDS) if len(part)]
