"""The paper's network (§4.3), as `indexer train` trains it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from classifier.dataset import Dataset
from classifier.features import Psd
from classifier.model import Model
from classifier.tasks.confidence import class_logits
from classifier.train import train
from classifier.trainers.traingdx import TrainGdx
from indexer_experiments.compare.methods.base import Fitted, Method


@dataclass(frozen=True)
class FittedMlp(Fitted):
    """A trained model."""

    model: Model

    def logits(self, records: np.ndarray) -> np.ndarray:
        return class_logits(self.model.codes.matrix, self.model.outputs(records))


@dataclass(frozen=True)
class Paper(Method):
    """20 hidden nodes, traingdx, the best of some restarts on the control subset.

    features  what the network sees
    restarts  networks trained from different starts
    """

    features: Psd
    restarts: int = 5

    def fit(self, dataset: Dataset, seed: int) -> FittedMlp:
        return FittedMlp(train(dataset, self.features, TrainGdx(), seed=seed, restarts=self.restarts, parts=()).model)
