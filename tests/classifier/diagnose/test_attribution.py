"""Contributions are complete and agree with what they are derived from."""

import dataclasses

import numpy as np
import pytest
import torch

from classifier.diagnose import attribution
from classifier.diagnose.attribution import COMPLETE, bands_of, contributions
from classifier.train import train


def agreement(model, features, position):
    bits, outputs = model.codes.matrix[position], model.outputs_of(features[None])[0]
    return float(np.mean(np.where(bits == 1, outputs, 1 - outputs)))


@pytest.fixture(
    scope="module",
    params=[
        {},
        {"hidden_function": "tanh", "output_function": "tanh", "targets": "bipolar"},
        {"output_function": "linear"},
    ],
)
def model(request, dataset, features, trainer):
    return train(dataset, features, trainer, hidden=6, seed=3, restarts=1, **request.param).model


def test_contributions_sum_to_what_the_agreement_gained(model, dataset):
    for place, features in enumerate(model.scaled(dataset.records[:6])):
        position = place % 3
        gained = agreement(model, features, position) - agreement(model, model.mean_features, position)
        assert contributions(model, features, position).sum() == pytest.approx(gained, abs=2 * COMPLETE)


def test_also_for_features_far_outside_those_of_the_training(model, dataset):
    features = 1000.0 * model.scaled(dataset.records[:1])[0]
    gained = agreement(model, features, 0) - agreement(model, model.mean_features, 0)
    assert contributions(model, features, 0).sum() == pytest.approx(gained, abs=1e-6)


def test_they_are_the_mean_gradient_along_the_way(model, dataset):
    """Against automatic differentiation and the plain rule of the middle points."""
    features, position = model.scaled(dataset.records[:1])[0], 1
    bits = torch.from_numpy(model.codes.matrix[position])
    mean, end = (torch.from_numpy(values) for values in (model.mean_features, features))
    way = (mean + (torch.arange(4000, dtype=torch.float64)[:, None] + 0.5) / 4000 * (end - mean)).requires_grad_()
    layers = model.network.layers(model.parameters[None])
    functions = {"logistic": torch.sigmoid, "tanh": torch.tanh, "linear": lambda s: s}
    hidden = functions[model.network.hidden_function](way @ layers.w1[0].T + layers.b1[0])
    outputs = functions[model.network.output_function](hidden @ layers.w2[0].T + layers.b2[0])
    outputs = model.network.bits_of(outputs)
    torch.where(bits == 1, outputs, 1 - outputs).mean(dim=1).sum().backward()
    wanted = (end - mean) * way.grad.mean(dim=0)
    np.testing.assert_allclose(contributions(model, features, position), wanted, atol=1e-6)


def test_the_band_of_the_resonance_speaks_loudest(result, dataset):
    """The classes ring at 10, 20 and 30 Hz, in the bands from 10, 20 and 30 Hz on of the ten up to 50 Hz."""
    model = result.model
    for label in (1, 2, 3):
        row = np.flatnonzero((dataset.classes == label) & dataset.rows("validation"))[0]
        bands = bands_of(model, contributions(model, model.scaled(dataset.records[row][None])[0], label - 1))
        assert (len(bands), bands[0].low_hz, bands[-1].high_hz) == (10, 0.0, 50.0)
        loudest = max(bands, key=lambda band: band.contribution)
        assert loudest.low_hz <= 10 * label <= loudest.high_hz


def test_bands_hold_all_contributions_and_none_twice(result, dataset):
    model = result.model
    found = contributions(model, model.scaled(dataset.records[:1])[0], 0)
    assert sum(band.contribution for band in bands_of(model, found)) == pytest.approx(found.sum())
    few = dataclasses.replace(model, features=dataclasses.replace(model.features, resolution_hz=25.0))
    assert [(band.low_hz, band.contribution) for band in bands_of(few, np.array([1.0, 2.0, 3.0]))] == [
        (0.0, 1.0),
        (25.0, 2.0),
        (45.0, 3.0),
    ]


def test_the_panels_have_an_end_where_the_contributions_stay_incomplete(model, dataset, monkeypatch):
    """A record in another unit must not take all memory."""
    panels = []
    monkeypatch.setattr(
        attribution, "_quadrature", lambda n, known=attribution._quadrature: panels.append(n) or known(n)
    )
    found = contributions(model, 1e9 * model.scaled(dataset.records[:1])[0], 0)
    assert np.isfinite(found).all() and max(panels) <= 2048
