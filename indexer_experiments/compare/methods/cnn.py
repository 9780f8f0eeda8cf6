"""The convolutional network on the record itself, as a method of the comparison."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from classifier.dataset import Dataset
from classifier.tasks.convolution import Learning, RecordNetwork
from indexer_experiments.compare.methods.base import Fitted, Method


@dataclass(frozen=True)
class FittedCnn(Fitted):
    """A trained network."""

    seen: RecordNetwork

    def logits(self, records: np.ndarray) -> np.ndarray:
        return self.seen.logits(records)


@dataclass(frozen=True)
class Cnn(Method):
    """`Learning` with its defaults, or as it is given."""

    learning: Learning = field(default_factory=Learning)

    def fit(self, dataset: Dataset, seed: int) -> FittedCnn:
        return FittedCnn(self.learning.fit(dataset, seed))
