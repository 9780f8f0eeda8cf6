"""The classifier as scikit-learn's estimators, for its pipelines, searches and cross-validations (extra [sklearn]).

    from sklearn.pipeline import make_pipeline
    model = make_pipeline(SpectralFeatures(sample_rate=1000.0), NetworkClassifier(random_state=0))
    model.fit(records, labels).predict_proba(others)

`indexer train` does more with a data set of `datagen`: it keeps the paper's codes and subsets, tells severities and
novelty, and stores a model. These two classes are for what others build around arrays.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from sklearn.base import BaseEstimator, ClassifierMixin, TransformerMixin
from sklearn.model_selection import GroupShuffleSplit, ShuffleSplit, StratifiedShuffleSplit
from sklearn.preprocessing import LabelEncoder
from sklearn.utils import check_random_state
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

from classifier.features import Psd, Scaling
from classifier.network import Mlp
from classifier.tasks.confidence import class_logits, fit_temperature, softmax
from classifier.trainers import TRAINERS, Examples, make_trainer
from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.errors import refuse

_TRIED = 100
"""Draws of a control subset of whole groups until the others hold records of every class."""


def _matrix(estimator: BaseEstimator, X: Any, **rules: Any) -> np.ndarray:
    """X as a float64 matrix, checked as scikit-learn checks."""
    return np.asarray(validate_data(estimator, X, dtype=np.float64, **rules))


class SpectralFeatures(TransformerMixin, BaseEstimator):
    """Power spectral densities of records by Welch's method, as `classifier.features.Psd`.

    Parameters
    ----------
    sample_rate : float
        Of the records [Hz], > 0.
    resolution_hz : float or None
        Spacing of the frequencies [Hz]; None: one segment as long as the record.
    maximum_hz : float or None
        Last frequency [Hz]; None: half the sample rate.
    scale : str
        "linear" or "log" (decimal logarithms).

    Attributes
    ----------
    psd_ : Psd
        What computes them.
    frequencies_ : ndarray (count,)
        Frequencies of the columns [Hz].
    """

    def __init__(
        self,
        sample_rate: float = 1000.0,
        *,
        resolution_hz: float | None = None,
        maximum_hz: float | None = None,
        scale: str = "log",
    ) -> None:
        self.sample_rate = sample_rate
        self.resolution_hz = resolution_hz
        self.maximum_hz = maximum_hz
        self.scale = scale

    def fit(self, X: Any, y: Any = None) -> SpectralFeatures:
        """Look at the length of the records (n, samples), of two samples or more. Raises ParameterError, a
        ValueError."""
        records = _matrix(self, X, ensure_min_features=2)
        check_number("SpectralFeatures", "sample_rate", self.sample_rate, low=0.0, low_open=True, unit="Hz")
        resolution = self.sample_rate / records.shape[1] if self.resolution_hz is None else self.resolution_hz
        maximum = self.sample_rate / 2 if self.maximum_hz is None else self.maximum_hz
        self.psd_ = Psd(resolution_hz=resolution, maximum_hz=maximum, scale=self.scale)
        self.psd_.density(records[:1], self.sample_rate)
        self.frequencies_ = self.psd_.frequencies(self.sample_rate)
        return self

    def transform(self, X: Any) -> np.ndarray:
        """Features (n, count) of records (n, samples)."""
        check_is_fitted(self)
        return self.psd_.compute(_matrix(self, X, reset=False), self.sample_rate)

    def get_feature_names_out(self, input_features: Any = None) -> np.ndarray:
        """Names of the columns: ``psd_12.5Hz``."""
        check_is_fitted(self)
        return np.array([f"psd_{frequency:g}Hz" for frequency in self.frequencies_], dtype=object)


class NetworkClassifier(ClassifierMixin, BaseEstimator):
    """The network of one hidden layer, trained by one of the ten rules with early stopping, as `classifier.train`.

    One output node for each class; a share of the records is the control subset, which decides when to stop, which of
    the starts is kept, and the temperature of the probabilities.

    Parameters
    ----------
    hidden : int
        Nodes of the hidden layer, >= 1.
    rule : str
        Training rule, one of `classifier.trainers.TRAINERS`.
    epochs, patience : int
        Most epochs, and epochs without a new lowest control error after which the training ends, >= 1.
    restarts : int
        Random starts, >= 1.
    control : float
        Share of the records in the control subset, in (0, 1).
    random_state : int, RandomState or None
        Of the starts and the control subset.

    Attributes
    ----------
    classes_ : ndarray (classes,)
    network_ : Mlp
    parameters_ : Tensor (count,)
        Of the kept network.
    scaling_ : Scaling
        Of the features, fitted without the control subset.
    temperature_ : float
        Of the probabilities [-].
    n_iter_ : int
        Epochs that the kept network was trained.
    """

    def __init__(
        self,
        hidden: int = 20,
        *,
        rule: str = "traingdx",
        epochs: int = 2000,
        patience: int = 20,
        restarts: int = 3,
        control: float = 0.2,
        random_state: Any = None,
    ) -> None:
        self.hidden = hidden
        self.rule = rule
        self.epochs = epochs
        self.patience = patience
        self.restarts = restarts
        self.control = control
        self.random_state = random_state

    def fit(self, X: Any, y: Any, groups: Any = None) -> NetworkClassifier:
        """Train on features (n, count) of classes y (n,).

        groups (n,) : records of one group, a machine or a file, are not parted by the control subset; for the
        probabilities all of them weigh as much as one record alone.

        Raises ParameterError, a ValueError, for a parameter that breaks its rule, records of one class alone, or groups
        of which some class has too few to be taught beside the control subset.
        """
        checked: Any = validate_data(self, X, y, dtype=np.float64)
        inputs, y = checked
        check_classification_targets(y)
        check_choice("NetworkClassifier", "rule", self.rule, TRAINERS)
        for name in ("hidden", "epochs", "patience", "restarts"):
            check_integer("NetworkClassifier", name, getattr(self, name), low=1)
        check_number(
            "NetworkClassifier", "control", self.control, low=0.0, low_open=True, high=1.0, high_open=True, unit="-"
        )
        encoder = LabelEncoder().fit(y)
        self.classes_ = np.asarray(encoder.classes_)
        codes = np.eye(self.classes_.size)
        if len(codes) < 2:
            raise refuse("NetworkClassifier", "y", "records of two classes or more", "one class")
        positions = np.asarray(encoder.transform(y))
        random: Any = check_random_state(self.random_state)
        taught, control = self._parts(positions, groups, random)

        self.network_ = Mlp(inputs.shape[1], self.hidden, len(codes))
        self.scaling_ = Scaling.fit(inputs[taught])
        scaled, wanted = torch.from_numpy(self.scaling_.apply(inputs)), torch.from_numpy(codes[positions])
        trainer = make_trainer({"kind": self.rule, "epochs": self.epochs, "patience": self.patience})
        generator = torch.Generator().manual_seed(int(random.randint(2**31 - 1)))
        start = self.network_.initial(self.restarts, generator)
        examples, judged = (Examples(scaled[rows], wanted[rows]) for rows in (taught, control))
        training = trainer.train(self.network_, start, examples, judged)

        self.parameters_ = training.parameters[training.best]
        self.n_iter_ = int(training.epochs[training.best])
        units = None if groups is None else np.asarray(groups)[control]
        self.temperature_ = fit_temperature(self._logits(inputs[control]), positions[control], units)
        return self

    def predict_proba(self, X: Any) -> np.ndarray:
        """Probabilities (n, classes) of features (n, count), in the order of `classes_`."""
        check_is_fitted(self)
        return softmax(self._logits(_matrix(self, X, reset=False)), self.temperature_)

    def predict(self, X: Any) -> np.ndarray:
        """Most probable classes (n,) of features (n, count)."""
        probabilities = self.predict_proba(X)
        return self.classes_[probabilities.argmax(axis=1)]

    def _logits(self, inputs: np.ndarray) -> np.ndarray:
        scaled = torch.from_numpy(self.scaling_.apply(inputs))
        outputs = self.network_.outputs_of(self.parameters_[None], scaled)[0].numpy()
        return class_logits(np.eye(self.network_.outputs), outputs)

    def _parts(self, positions: np.ndarray, groups: Any, random: Any) -> tuple[np.ndarray, np.ndarray]:
        """Rows that teach and rows of the control subset: whole groups, or of each class its share where that can be
        had."""
        settings: dict[str, Any] = {"n_splits": 1, "test_size": self.control, "random_state": random}
        if groups is not None:
            splitter = GroupShuffleSplit(**{**settings, "n_splits": _TRIED})
            classes = np.unique(positions)
            for taught, control in splitter.split(positions, positions, groups):
                if np.array_equal(np.unique(positions[taught]), classes):
                    return taught, control
            rule = f"such that {1.0 - self.control:.0%} of them hold records of every class"
            raise refuse("NetworkClassifier", "groups", rule, None, "some class has few groups: lower control")
        rows = round(self.control * len(positions))
        fewest, classes = int(np.bincount(positions).min()), int(positions.max()) + 1
        stratified = fewest >= 2 and classes <= rows <= len(positions) - classes
        splitter = StratifiedShuffleSplit(**settings) if stratified else ShuffleSplit(**settings)
        return next(splitter.split(positions[:, None], positions))
