"""Compressed, standardised and whitened features."""

import numpy as np
import pytest

from classifier.tasks.spectrum import Compression, Standard, Whitening
from indexer_env.errors import ParameterError


@pytest.fixture(scope="module")
def features():
    rng = np.random.default_rng(1)
    return np.exp(rng.normal(0, 2, (200, 6))) @ np.diag([1, 1, 10, 0.1, 1, 5])


def test_large_features_are_compressed_like_a_logarithm_and_small_ones_not_at_all():
    compression = Compression(np.array([1e-3]))
    large, small = np.array([[1.0], [10.0]]), np.array([[1e-6], [2e-6]])
    assert np.diff(compression.apply(large)[:, 0])[0] == pytest.approx(np.log(10), rel=1e-5)
    assert np.diff(compression.apply(small)[:, 0])[0] == pytest.approx(1e-3, rel=1e-3)
    assert compression.apply(-large) == pytest.approx(-compression.apply(large))


def test_a_feature_that_most_records_lack_is_compressed_as_the_others_are(features):
    features = features.copy()
    features[:, 0] = 0.0
    features[0, 0] = 1.0
    compression = Compression.fit(features)
    assert compression.knee[0] == np.median(compression.knee[1:])
    assert np.isfinite(compression.apply(features)).all()


def test_a_knee_of_zero_is_refused():
    with pytest.raises(ParameterError, match="finite numbers > 0"):
        Compression(np.array([1.0, 0.0]))


def test_standardised_features_have_mean_0_and_deviation_1_and_constant_ones_are_0(features):
    features = np.column_stack([features, np.full(len(features), 3.0)])
    scaled = Standard.fit(features).apply(features)
    assert scaled[:, :-1].mean(axis=0) == pytest.approx(0, abs=1e-12)
    assert scaled[:, :-1].std(axis=0) == pytest.approx(1)
    assert not scaled[:, -1].any()


def test_whitened_components_are_uncorrelated_with_variance_1(features):
    components = Whitening.fit(features, share=1.0).apply(features)
    assert np.cov(components.T) == pytest.approx(np.eye(components.shape[1]), abs=1e-9)


def test_the_residual_is_that_of_an_explicit_projection(features):
    whitening = Whitening.fit(features, share=0.9)
    assert whitening.axes.shape[1] < features.shape[1]
    centred = features - features.mean(axis=0)
    vectors = np.linalg.eigh(np.cov(centred.T))[1][:, ::-1][:, : whitening.axes.shape[1]]
    rest = np.linalg.norm(centred - centred @ vectors @ vectors.T, axis=1)
    assert whitening.residual(features) * whitening.spread == pytest.approx(rest)


def test_features_that_do_not_vary_cannot_be_whitened():
    with pytest.raises(ParameterError, match="vary"):
        Whitening.fit(np.ones((5, 3)))
