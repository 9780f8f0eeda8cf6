"""MiniRocket: how often random dilated convolutions of the record exceed a bias, judged by logistic regression.

The transform is written from the paper, as no maintained package of it installs beside current versions of numba and
NumPy. Source: A. Dempster, D. F. Schmidt, G. I. Webb, Proc. KDD (2021) 248–257.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numba
import numpy as np

from classifier.dataset import Dataset
from classifier.tasks.decimate import RATE, Decimated
from classifier.tasks.logistic import LogisticRegression
from indexer_experiments.compare.methods.base import Fitted, Method

LENGTH = 9
PLACES = np.array(list(itertools.combinations(range(LENGTH), 3)))
"""(84, 3) places of the weights 2 in each kernel; its other six weights are −1, so that each sums up to 0."""

_GOLDEN = (math.sqrt(5.0) + 1.0) / 2.0


def dilations_of(samples: int, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Dilations and the number of biases each has per kernel, for series of so many samples and at most `most` biases a
    kernel: 2^e with e evenly spaced up to where the kernel spans the series, at most 32 of them.
    """
    largest = math.log2((samples - 1) / (LENGTH - 1))
    exponents = np.linspace(0.0, largest, min(most, 32))
    dilations, count = np.unique(np.floor(2.0**exponents).astype(np.int64), return_counts=True)
    shared = np.floor(count * most / len(exponents)).astype(np.int64)
    shared[: most - shared.sum()] += 1
    return dilations, shared


@numba.njit(nogil=True, cache=True)
def delays(series: np.ndarray, dilation: int) -> np.ndarray:
    """x[t + (k − 4) · dilation] (LENGTH, samples) for every k and t, with zeros beyond the ends."""
    samples = series.size
    delayed = np.zeros((LENGTH, samples))
    for k in range(LENGTH):
        shift = (k - LENGTH // 2) * dilation
        delayed[k, max(0, -shift) : samples - shift] = series[max(0, shift) : samples + min(0, shift)]
    return delayed


@numba.njit(nogil=True, cache=True)
def convolution(delayed: np.ndarray, total: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Σ_k w_k x[t + (k − 4) · dilation] for every t, of `delays` and their sum over k: three times the delays at the
    places less that sum, which all kernels of a dilation share."""
    return 3.0 * (delayed[places[0]] + delayed[places[1]] + delayed[places[2]]) - total


@numba.njit(nogil=True, cache=True)
def transform(
    records: np.ndarray, places: np.ndarray, dilations: np.ndarray, shared: np.ndarray, biases: np.ndarray
) -> np.ndarray:
    """Shares (n, features) of the samples whose convolution exceeds each bias, for records (n, samples).

    Of kernel and dilation number i, every even i counts all samples, every odd i those whose kernel lies inside.
    """
    features = np.empty((len(records), biases.size))
    for row in range(len(records)):
        feature = 0
        for d in range(dilations.size):
            edge = (LENGTH // 2) * dilations[d]
            delayed = delays(records[row], dilations[d])
            total = delayed.sum(axis=0)
            for kernel in range(len(places)):
                values = convolution(delayed, total, places[kernel])
                inside = (d + kernel) % 2 == 1 and 2 * edge < values.size
                if inside:
                    values = values[edge : values.size - edge]
                for _ in range(shared[d]):
                    above = 0
                    for value in values:
                        above += value > biases[feature]
                    features[row, feature] = above / values.size
                    feature += 1
    return features


@dataclass(frozen=True, eq=False)
class Convolutions:
    """Kernels, dilations and biases of a transform.

    dilations, shared  see `dilations_of`
    biases             (features,) quantiles of the convolutions of records drawn from the calibration subset
    """

    dilations: np.ndarray
    shared: np.ndarray
    biases: np.ndarray

    @classmethod
    def fit(cls, records: np.ndarray, features: int, seed: int) -> Convolutions:
        """Fitted to records (n, samples); about so many features, as each kernel has equally many."""
        rng = np.random.default_rng(seed)
        dilations, shared = dilations_of(records.shape[1], max(1, features // len(PLACES)))
        biases: list[np.ndarray] = []
        drawn = 0
        for dilation, count in zip(dilations, shared, strict=True):
            for places in PLACES:
                delayed = delays(records[rng.integers(len(records))], dilation)
                values = convolution(delayed, delayed.sum(axis=0), places)
                # Quantiles of a golden-ratio sequence, which fills [0, 1) evenly however many are taken.
                quantiles = (_GOLDEN * np.arange(drawn + 1, drawn + count + 1)) % 1.0
                biases.append(np.quantile(values, quantiles))
                drawn += int(count)
        return cls(dilations, shared, np.concatenate(biases))

    def apply(self, records: np.ndarray) -> np.ndarray:
        """Features (n, count) of records (n, samples)."""
        return transform(records, PLACES, self.dilations, self.shared, self.biases)


@dataclass(frozen=True)
class FittedMiniRocket(Fitted):
    """Convolutions and the coefficients on them."""

    decimated: Decimated
    convolutions: Convolutions
    regression: LogisticRegression

    def logits(self, records: np.ndarray) -> np.ndarray:
        return self.regression.logits(self.convolutions.apply(self.decimated.apply(records)))


@dataclass(frozen=True)
class MiniRocket(Method):
    """Convolutions of records at a lower rate, and logistic regression in place of the paper's ridge classifier, which
    gives no probabilities.

    features  number of them, about; the paper's default is 10 000
    """

    features: int = 2500

    def fit(self, dataset: Dataset, seed: int) -> FittedMiniRocket:
        decimated = Decimated.fit(dataset, RATE)
        records = decimated.apply(dataset.records)
        convolutions = Convolutions.fit(records[dataset.rows("calibration")], self.features, seed)
        return FittedMiniRocket(decimated, convolutions, LogisticRegression.fit(convolutions.apply(records), dataset))
