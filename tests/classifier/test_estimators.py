"""The estimators keep scikit-learn's rules and say what the classifier says. Every random choice is seeded."""

import numpy as np
import pytest
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import parametrize_with_checks

from classifier.dataset import Dataset
from classifier.estimators import NetworkClassifier, SpectralFeatures
from classifier.features import Psd
from indexer_env.errors import ParameterError


@parametrize_with_checks([NetworkClassifier(epochs=80, restarts=2, random_state=0), SpectralFeatures()])
def test_rules_of_scikit_learn(estimator, check) -> None:
    check(estimator)


def _pipeline(dataset: Dataset):
    spectrum = SpectralFeatures(dataset.sample_rate, resolution_hz=2.0, maximum_hz=50.0, scale="linear")
    return make_pipeline(spectrum, NetworkClassifier(6, epochs=300, random_state=1))


def test_a_pipeline_on_records_tells_their_classes(dataset: Dataset) -> None:
    """Records that ring at one frequency by class: those held out are named, with probabilities that add to 1."""
    held = dataset.rows("validation")
    model = _pipeline(dataset).fit(dataset.records[~held], dataset.classes[~held])
    assert model.score(dataset.records[held], dataset.classes[held]) > 0.9
    np.testing.assert_allclose(model.predict_proba(dataset.records[held]).sum(axis=1), 1.0)


def test_features_are_those_of_the_classifier(dataset: Dataset) -> None:
    spectrum = SpectralFeatures(dataset.sample_rate, resolution_hz=2.0, maximum_hz=50.0).fit(dataset.records)
    wanted = Psd(2.0, 50.0, "log")
    np.testing.assert_array_equal(
        spectrum.transform(dataset.records), wanted.compute(dataset.records, dataset.sample_rate)
    )
    np.testing.assert_array_equal(spectrum.frequencies_, wanted.frequencies(dataset.sample_rate))
    assert spectrum.get_feature_names_out()[1] == "psd_2Hz"


def test_a_search_and_a_cross_validation_by_groups(dataset: Dataset) -> None:
    groups = np.arange(len(dataset.classes)) % 4
    scores = cross_val_score(_pipeline(dataset), dataset.records, dataset.classes, groups=groups, cv=GroupKFold(4))
    assert scores.mean() > 0.9
    search = GridSearchCV(_pipeline(dataset), {"networkclassifier__hidden": [2, 6]}, cv=2)
    assert search.fit(dataset.records, dataset.classes).best_score_ > 0.8


def test_the_same_state_gives_the_same_network(dataset: Dataset) -> None:
    first, again = (_pipeline(dataset).fit(dataset.records, dataset.classes) for _ in range(2))
    np.testing.assert_array_equal(first.predict_proba(dataset.records), again.predict_proba(dataset.records))


def test_groups_are_not_parted() -> None:
    rng = np.random.default_rng(4)
    positions, groups = np.arange(60) % 2, rng.integers(0, 10, 60)
    model = NetworkClassifier()
    model.classes_ = np.array([0, 1])
    taught, control = model._parts(positions, groups, np.random.RandomState(0))
    assert len(control) and not set(groups[taught]) & set(groups[control])


def test_each_class_is_taught_or_refused() -> None:
    """A class of two of twelve groups, in many of all draws in the control subset alone; states 0 to 29."""
    groups = np.arange(60) // 5
    positions = np.where(groups < 2, 2, groups % 2)
    model = NetworkClassifier()
    for state in range(30):
        taught, control = model._parts(positions, groups, np.random.RandomState(state))
        assert set(positions[taught]) == {0, 1, 2} and not set(groups[taught]) & set(groups[control])
    with pytest.raises(ParameterError, match=r"NetworkClassifier\.groups must be such that 50% .* lower control"):
        NetworkClassifier(control=0.5)._parts(np.array([0, 0, 1, 1]), np.array([0, 0, 1, 1]), np.random.RandomState(0))


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"control": 1.0}, r"NetworkClassifier\.control must be"),
        ({"restarts": 0}, r"NetworkClassifier\.restarts must be"),
        ({"rule": "traingdy"}, r"NetworkClassifier\.rule must be one of .* did you mean 'traingd"),
        ({"hidden": 0}, r"NetworkClassifier\.hidden must be"),
        ({"epochs": 0}, r"NetworkClassifier\.epochs must be"),
        ({"patience": 1.5}, r"NetworkClassifier\.patience must be"),
    ],
)
def test_refusals(settings, sentence: str) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ParameterError, match=sentence):
        NetworkClassifier(**settings).fit(rng.normal(size=(20, 3)), np.arange(20) % 2)
