"""Every method learns three tones, the same from the same seed, and looks at no validation record."""

import dataclasses

import numpy as np
import pytest
import torch

from classifier.dataset import Dataset
from classifier.features import Psd
from classifier.tasks.convolution import Learning
from classifier.tasks.decimate import Decimated
from indexer_experiments.compare.measure import METRICS, measured, temperature_of
from indexer_experiments.compare.methods import METHODS
from indexer_experiments.compare.methods.cnn import Cnn
from indexer_experiments.compare.methods.kernels import (
    PLACES,
    Convolutions,
    MiniRocket,
    convolution,
    delays,
    dilations_of,
)
from indexer_experiments.compare.methods.mlp import Paper

SMALL = {
    **METHODS,
    "mlp": Paper(Psd(), restarts=1),
    "mlp, log": Paper(Psd(scale="log"), restarts=1),
    "MiniRocket": MiniRocket(features=168),
    "CNN": Cnn(Learning(epochs=10)),
}
"""Methods that take their time are asked for less of it."""


@pytest.fixture(scope="module", params=SMALL)
def fitted(request, tones):
    return request.param, SMALL[request.param].fit(tones, 0)


def test_a_method_learns_three_tones(fitted, tones: Dataset):
    rows = tones.rows("validation")
    logits = fitted[1].logits(tones.records[rows])
    assert logits.shape == (rows.sum(), 3) and np.isfinite(logits).all()
    assert measured(tones.codes, logits, tones.classes[rows])["misclassified [%]"] < 10


def test_a_method_gives_the_same_from_the_same_seed_and_sees_no_validation_record(fitted, tones: Dataset):
    name, method = fitted
    rows = tones.rows("validation")
    records = tones.records.copy()
    records[rows] = 0.0
    threads = torch.get_num_threads()
    again = SMALL[name].fit(dataclasses.replace(tones, records=records), 0)
    assert np.array_equal(again.logits(tones.records), method.logits(tones.records))
    assert torch.get_num_threads() == threads


def test_every_metric_has_its_column(fitted, tones: Dataset):
    logits = fitted[1].logits(tones.records)
    temperature = temperature_of(tones.codes, logits, tones.classes)
    assert list(measured(tones.codes, logits, tones.classes, temperature)) == [name for name, _ in METRICS]


def test_metrics_by_hand(tones: Dataset):
    logits = np.log([[0.8, 0.1, 0.1], [0.3, 0.6, 0.1], [0.2, 0.5, 0.3]])
    found = measured(tones.codes, logits, np.array([1, 2, 3]))
    assert found["misclassified [%]"] == pytest.approx(100 / 3)
    assert found["AUROC"] == 1.0
    assert found["ECE [%]"] == pytest.approx(100 * (0.2 + 0.4 + 0.5) / 3)


# ------------------------------------------------------------------------- MiniRocket


def convolved(series: np.ndarray, places: np.ndarray, dilation: int) -> np.ndarray:
    delayed = delays(series, dilation)
    return convolution(delayed, delayed.sum(axis=0), places)


def test_there_are_84_kernels_whose_weights_sum_up_to_0():
    assert PLACES.shape == (84, 3) and len({tuple(row) for row in PLACES}) == 84
    flat = convolved(np.ones(64), PLACES[7], 2)
    assert flat[8:-8] == pytest.approx(0)


@pytest.mark.parametrize("dilation", [1, 3, 12])
def test_a_convolution_is_numpy_s(dilation):
    series, places = np.random.default_rng(0).normal(size=100), PLACES[40]
    kernel = np.zeros(8 * dilation + 1)
    kernel[::dilation] = -1
    kernel[places * dilation] = 2
    wanted = np.convolve(np.pad(series, 4 * dilation), kernel[::-1], "valid")
    assert convolved(series, places, dilation) == pytest.approx(wanted)


@pytest.mark.parametrize(("samples", "most"), [(2050, 29), (100, 119), (9, 5)])
def test_dilations_reach_over_the_series_and_share_all_biases(samples, most):
    dilations, shared = dilations_of(samples, most)
    assert dilations[0] == 1 and 8 * dilations[-1] <= samples - 1
    assert shared.sum() == most and shared.min() >= 0


def test_features_are_shares_and_a_bias_is_a_quantile_of_the_convolution():
    records = np.random.default_rng(1).normal(size=(6, 200))
    found = Convolutions.fit(records, 840, seed=0)
    features = found.apply(records)
    assert features.shape == (6, found.biases.size) == (6, 840)
    assert features.min() >= 0.0 and features.max() <= 1.0
    assert features.mean() == pytest.approx(0.5, abs=0.05)  # golden-ratio quantiles fill [0, 1) evenly


# ------------------------------------------------------------------------- records


def test_decimated_records_keep_a_tone_below_100_hz_and_lose_one_above_the_new_limit(tones: Dataset):
    time = np.arange(8200) / 1000.0
    high_and_low = np.stack([np.sin(2 * np.pi * hz * time) for hz in (60, 180)]).astype(np.float32)
    low, high = Decimated(4, 1.0).apply(high_and_low)
    assert np.std(low[50:-50]) == pytest.approx(np.sqrt(0.5), rel=0.02)
    assert np.std(high[50:-50]) < 0.05
    assert Decimated.fit(tones, 250.0).factor == 1
