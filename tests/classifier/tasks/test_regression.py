"""Kernel ridge regression against scikit-learn's, and its cross-fitted errors."""

import numpy as np
import pytest
from sklearn.kernel_ridge import KernelRidge as Peer

from classifier.tasks import regression
from classifier.tasks.regression import cross_fitted, fit_at


@pytest.fixture(scope="module")
def examples():
    rng = np.random.default_rng(2)
    inputs = rng.normal(size=(120, 3))
    return inputs, np.column_stack([np.sin(inputs[:, 0]), inputs[:, 1] * inputs[:, 2]])


def test_with_all_records_as_centres_it_is_kernel_ridge_regression(examples):
    inputs, targets = examples
    width, ridge = 1.3, 0.05
    ours = fit_at(inputs, targets, inputs, width, ridge).predict(inputs[:20] + 0.1)
    peer = Peer(alpha=ridge, kernel="rbf", gamma=1 / (2 * width**2)).fit(inputs, targets - targets.mean(axis=0))
    assert ours == pytest.approx(peer.predict(inputs[:20] + 0.1) + targets.mean(axis=0), abs=1e-4)


def test_errors_are_those_on_records_of_other_groups(examples):
    inputs, targets = examples
    groups = np.arange(len(inputs)) // 4
    found, errors = cross_fitted(inputs, targets, groups, np.random.default_rng(0))
    fitted = found.predict(inputs) - targets
    assert np.mean(fitted**2) < np.mean(errors**2) < np.var(targets)


def test_a_copy_in_the_same_group_does_not_help(examples):
    """Each record stands twice, once a group: what is left out is left out twice."""
    inputs, targets = examples
    doubled, twice = np.repeat(inputs, 2, axis=0), np.repeat(targets, 2, axis=0)
    together = cross_fitted(doubled, twice, np.arange(240) // 2, np.random.default_rng(0))[1]
    apart = cross_fitted(doubled, twice, np.arange(240), np.random.default_rng(0))[1]
    assert np.mean(apart**2) < 0.5 * np.mean(together**2)


def test_no_more_centres_than_the_most(examples, monkeypatch):
    monkeypatch.setattr(regression, "CENTRES", 30)
    found, _ = cross_fitted(*examples, np.arange(120), np.random.default_rng(0))
    assert len(found.centres) == 30
    assert np.mean((found.predict(examples[0]) - examples[1]) ** 2) < 0.5 * np.var(examples[1])
