"""Scaled features of a data set with the parts that are fitted to them, without training a network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from classifier.dataset import Dataset
from classifier.features import Psd
from indexer_experiments.compare.methods.base import ScaledFeatures


@dataclass(frozen=True, eq=False)
class Seen:
    """A data set and what a network on PSD features would see of it.

    scaled  (n, count) features of all its records, scaled on the calibration records
    """

    dataset: Dataset
    features: ScaledFeatures
    scaled: np.ndarray

    @classmethod
    def of(cls, dataset: Dataset) -> Seen:
        """Of a data set, with the paper's features."""
        features = ScaledFeatures.fit(Psd(), dataset)
        return cls(dataset, features, features.apply(dataset.records))
