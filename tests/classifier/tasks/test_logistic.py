"""Logistic regression is scikit-learn's, takes its penalty from the control subset and looks at nothing else."""

import dataclasses

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression as Peer

from classifier.tasks.logistic import STRENGTHS, LogisticRegression, _minimum, cross_entropy


@pytest.fixture(scope="module")
def inputs(dataset):
    """Noisy features of three classes; seed 4."""
    rng = np.random.default_rng(4)
    return dataset.classes[:, None] * rng.normal(size=6) + rng.normal(size=(len(dataset.classes), 6))


@pytest.mark.parametrize("strength", STRENGTHS)
def test_weights_are_those_of_scikit_learn(dataset, inputs, strength):
    positions = dataset.codes.positions(dataset.classes)
    weights, biases = _minimum(inputs, positions, 3, strength)
    peer = Peer(C=strength, max_iter=10_000, tol=1e-8).fit(inputs, positions)
    assert weights == pytest.approx(peer.coef_, abs=2e-3 * np.abs(peer.coef_).max())
    assert np.ptp(biases - peer.intercept_) < 2e-2  # a constant added to all biases changes nothing


def test_the_control_subset_chooses_the_penalty(dataset, inputs):
    fitted = LogisticRegression.fit(inputs, dataset)
    rows, control = dataset.rows("calibration"), dataset.rows("control")
    positions = dataset.codes.positions(dataset.classes)
    found = cross_entropy(fitted.logits(inputs[control]), positions[control])
    taught = fitted.standard.apply(inputs[rows])
    for strength in STRENGTHS:
        weights, biases = _minimum(taught, positions[rows], 3, strength)
        tried = dataclasses.replace(fitted, weights=weights, biases=biases)
        assert found <= cross_entropy(tried.logits(inputs[control]), positions[control]) + 1e-9


def test_validation_records_are_not_seen(dataset, inputs):
    changed = np.where(dataset.rows("validation")[:, None], 1e3, inputs)
    first, second = LogisticRegression.fit(inputs, dataset), LogisticRegression.fit(changed, dataset)
    assert np.array_equal(first.weights, second.weights)
