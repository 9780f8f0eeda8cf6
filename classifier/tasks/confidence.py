"""Confidence: probabilities of classes and faults from the outputs of a network, calibrated by a temperature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import fminbound
from scipy.special import logsumexp

from classifier.codes import CodeBook
from classifier.dataset import Dataset
from classifier.tasks.need import count_independent, independent, need
from indexer_env.checks import check_number
from indexer_env.errors import refuse

_EDGE = 1e-6
"""Outputs count as at least this far from 0 and 1; linear outputs may lie beyond."""

LEAST = 20
"""Independent control records with which a temperature can be fitted: it makes the mean confidence the share that
is right, whose standard error is then 0.11 at most, a bin of a reliability diagram; with 2 records it is 0.35."""

TEMPERATURES = (0.05, 50.0)
"""Range in which a temperature is sought [-]."""


def class_logits(codes: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Logarithms (n, classes) of how likely outputs (n, bits) make each code (classes, bits), bit by bit.

    ℓ_c = Σ_b [c_b ln y_b + (1 − c_b) ln(1 − y_b)]
    """
    inside = np.clip(outputs, _EDGE, 1.0 - _EDGE)
    return np.log(inside) @ codes.T + np.log1p(-inside) @ (1.0 - codes).T


def softmax(logits: np.ndarray, temperature: float = 1.0) -> np.ndarray:
    """Probabilities (n, classes) of logits (n, classes) at a temperature: e^(ℓ/T) / Σ e^(ℓ/T)."""
    scaled = logits / temperature
    shares = np.exp(scaled - scaled.max(axis=1, keepdims=True))
    return shares / shares.sum(axis=1, keepdims=True)


def fit_temperature(logits: np.ndarray, positions: np.ndarray, units: np.ndarray | None = None) -> float:
    """The temperature [-] at which the logits (n, classes) predict the true classes (n,), given as positions, best.

    units (n,) labels records that hang together, such as the turns of one file: all of a unit weigh as much as one
    record alone. None: each record stands for itself.

    It minimises the mean cross entropy over k units the network was not trained on. The target of the true class is
    (k + 1)/(k + 2), Laplace's estimate of the share that is right after k of k were; the others share the rest. So
    a faultless subset does not make the network certain.
    Sources: C. Guo et al., Proc. ICML (2017), §4.2; J. C. Platt, Adv. Large Margin Classifiers (1999), §3, for targets.
    """
    labels = np.arange(len(logits)) if units is None else units
    _, unit, sizes = np.unique(labels, return_inverse=True, return_counts=True)
    count, classes = len(sizes), logits.shape[1]
    wanted = np.full(logits.shape, 1.0 / ((count + 2.0) * (classes - 1)))
    wanted[np.arange(len(logits)), positions] = (count + 1.0) / (count + 2.0)

    def cross_entropy(log_temperature: float) -> float:
        scaled = logits / np.exp(log_temperature)
        entropies = logsumexp(scaled, axis=1) - (wanted * scaled).sum(axis=1)
        return float(np.average(entropies, weights=1.0 / sizes[unit]))

    low, high = np.log(TEMPERATURES)
    return float(np.exp(fminbound(cross_entropy, low, high)))


@dataclass(frozen=True, eq=False)
class Confidence:
    """Probabilities of the classes, p_c ∝ exp(ℓ_c / T) with ℓ of `class_logits`.

    temperature  T [-]; 1: outputs are probabilities as they stand, above 1: the network is too sure of itself
    codes        (classes, bits) codes of the classes

    Raises ParameterError.
    """

    kind: ClassVar[str] = "confidence"

    temperature: float
    codes: np.ndarray

    def __post_init__(self) -> None:
        check_number("Confidence", "temperature", self.temperature, low=0.0, low_open=True)
        if self.codes.ndim != 2 or len(self.codes) < 2:
            raise refuse("Confidence", "codes", "a matrix (classes, bits) of two classes or more", self.codes.shape)

    @classmethod
    def fit(cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int) -> Confidence:
        """Fitted to the outputs (n, bits) of the control records. Raises NotAvailable where they are too few."""
        need("independent control records", LEAST, count_independent(dataset, "control"))
        control = dataset.rows("control")
        units = independent(dataset, control)
        return cls.of_control(dataset.codes, outputs[control], dataset.classes[control], units)

    @classmethod
    def of_control(
        cls, codes: CodeBook, outputs: np.ndarray, classes: np.ndarray, units: np.ndarray | None = None
    ) -> Confidence:
        """Fitted to outputs (n, bits) of records of classes (n,) that the network was not trained on, and that hang
        together as `fit_temperature` says."""
        logits = class_logits(codes.matrix, outputs)
        return cls(fit_temperature(logits, codes.positions(classes), units), codes.matrix)

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Confidence:
        """The part that gave this body and these arrays."""
        return cls(body["temperature"], arrays["codes"])

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        return {"temperature": self.temperature}

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        return {"codes": self.codes}

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What it says of records, given their outputs (n, bits):

        probability        (n,) of the class whose code lies nearest, which is the one that is named
        class_probability  (n, classes)
        bit_probability    (n, bits) that the bit is 1: the probabilities of all classes that have it
        """
        probabilities = softmax(class_logits(self.codes, outputs), self.temperature)
        named = np.argmin(np.linalg.norm(outputs[:, None, :] - self.codes[None], axis=-1), axis=1)
        return {
            "probability": probabilities[np.arange(len(named)), named],
            "class_probability": probabilities,
            "bit_probability": probabilities @ self.codes,
        }
