"""Methods that `leaveout` sets side by side; all learn from the calibration subset, tuned on the control subset."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from classifier.codes import CodeBook
from classifier.dataset import Dataset
from classifier.features import Features, Scaling
from classifier.model import Model
from classifier.tasks.convolution import Learning, RecordNetwork
from classifier.tasks.logistic import LogisticRegression
from classifier.tasks.need import NotAvailable
from classifier.tasks.novelty import Novelty
from classifier.train import Result

MLP, LOGISTIC, CNN = "mlp", "logistic", "cnn"
METHODS = (MLP, LOGISTIC, CNN)
"""The paper's network, logistic regression on the same features, and a convolutional network on the record itself."""

WITHOUT_CHANCE = (LOGISTIC,)
"""Methods that give the same from every seed, and are learnt once."""

_RATE = 2.5
"""Least sampling rate of what the convolutional network sees, over the highest frequency of the features: it is shown
the same band."""


class Learnt(ABC):
    """A method after learning."""

    @abstractmethod
    def outputs(self, records: np.ndarray) -> np.ndarray:
        """Outputs (n, bits) for records, on the scale of the bits."""

    def refused(self, records: np.ndarray) -> np.ndarray | None:
        """Which of the records (n,) are none of the classes; None for a method that cannot say."""
        return None


@dataclass(frozen=True)
class LearntMlp(Learnt):
    """The network with its novelty part, where the control records are enough for one."""

    model: Model
    novelty: Novelty | None

    def outputs(self, records: np.ndarray) -> np.ndarray:
        return self.model.outputs(records)

    def refused(self, records: np.ndarray) -> np.ndarray | None:
        if self.novelty is None:
            return None
        scaled = self.model.scaled(records)
        return self.novelty.assess(scaled, self.model.outputs_of(scaled), records)["is_novel"]


@dataclass(frozen=True)
class LearntLogistic(Learnt):
    """Coefficients on scaled features."""

    codes: CodeBook
    features: Features
    sample_rate: float
    scaling: Scaling
    regression: LogisticRegression

    def outputs(self, records: np.ndarray) -> np.ndarray:
        scaled = self.scaling.apply(self.features.compute(records, self.sample_rate))
        return self.codes.matrix[self.regression.logits(scaled).argmax(axis=1)]


@dataclass(frozen=True)
class LearntCnn(Learnt):
    """A network on the record."""

    codes: CodeBook
    network: RecordNetwork

    def outputs(self, records: np.ndarray) -> np.ndarray:
        return self.codes.matrix[self.network.logits(records).argmax(axis=1)]


Learn = Callable[[Dataset, int], Learnt]
"""A method before learning: a data set and a seed -> what it has learnt."""


def mlp(train: Callable[[Dataset, int], Result]) -> Learn:
    """The network that `train` gives."""

    def learn(dataset: Dataset, seed: int) -> LearntMlp:
        model = train(dataset, seed).model
        scaled = model.scaled(dataset.records)
        try:
            novelty = Novelty.fit(dataset, scaled, model.outputs_of(scaled), seed)
        except NotAvailable:  # `leaveout.run` says why
            novelty = None
        return LearntMlp(model, novelty)

    return learn


def logistic(features: Features) -> Learn:
    """Logistic regression on these features."""

    def learn(dataset: Dataset, seed: int) -> LearntLogistic:
        values = features.compute(dataset.records, dataset.sample_rate)
        scaling = Scaling.fit(values[dataset.rows("calibration")])
        regression = LogisticRegression.fit(scaling.apply(values), dataset)
        return LearntLogistic(dataset.codes, features, dataset.sample_rate, scaling, regression)

    return learn


def cnn(features: Features) -> Learn:
    """The convolutional network, shown the band of these features."""

    def learn(dataset: Dataset, seed: int) -> LearntCnn:
        rate = _RATE * float(features.frequencies(dataset.sample_rate)[-1])
        return LearntCnn(dataset.codes, Learning().fit(dataset, seed, rate))

    return learn
