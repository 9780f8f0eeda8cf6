"""A part is fitted in training, stored with its model and comes back bit for bit."""

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
import yaml

from classifier.model import MODEL_YAML, UNGUARDED, ModelFileError, load_model, save_model
from classifier.parts import PARTS, Part
from classifier.tasks.need import NotAvailable
from classifier.train import train
from indexer_env.errors import ParameterError


@dataclass(frozen=True, eq=False)
class Distance:
    """Distance from the mean features of the calibration records, and whether it is beyond a limit."""

    kind: ClassVar[str] = "distance"

    centre: np.ndarray
    weights: np.ndarray
    limit: float
    words: str

    @classmethod
    def fit(cls, dataset, features, outputs, seed):
        if dataset.unit != "rad/s^2":
            raise NotAvailable("0 angular records, 1 needed")
        rng = np.random.default_rng(seed)
        centre = features[dataset.rows("calibration")].mean(axis=0)
        return cls(centre, rng.uniform(size=(2, outputs.shape[1])).astype(np.float32), 0.1 + 0.2, "größer als …")

    @classmethod
    def restore(cls, body, arrays):
        return cls(**arrays, **body)

    def body(self) -> dict[str, Any]:
        return {"limit": self.limit, "words": self.words}

    def arrays(self) -> dict[str, np.ndarray]:
        return {"centre": self.centre, "weights": self.weights}

    def assess(self, features, outputs, records):
        distance = np.linalg.norm(features - self.centre, axis=1)
        return {"distance": distance, "is_far": distance > self.limit, "mixed": outputs @ self.weights.T}


@pytest.fixture
def trained(dataset, features, trainer, monkeypatch):
    monkeypatch.setitem(PARTS, Distance.kind, Distance)
    return train(dataset, features, trainer, hidden=6, seed=3, restarts=1, parts=["distance"]).model


def test_a_part_sees_what_the_network_sees_and_says(trained, dataset):
    (part,) = trained.parts
    assert isinstance(part, Part)
    scaled = trained.scaled(dataset.records)
    said = trained.assess(scaled, trained.outputs(dataset.records), dataset.records)
    centre = scaled[dataset.rows("calibration")].mean(axis=0)
    assert np.array_equal(said["distance"], np.linalg.norm(scaled - centre, axis=1))
    assert said["is_far"].dtype == bool and said["mixed"].shape == (len(scaled), 2)


def test_a_stored_part_comes_back_bit_for_bit(trained, dataset, tmp_path):
    save_model(trained, tmp_path)
    loaded = load_model(tmp_path)
    (before,), (after,) = trained.parts, loaded.parts
    assert after.body() == before.body()
    for name, array in before.arrays().items():
        assert after.arrays()[name].dtype == array.dtype and np.array_equal(after.arrays()[name], array)
    inputs = trained.scaled(dataset.records), trained.outputs(dataset.records), dataset.records
    for name, column in trained.assess(*inputs).items():
        assert np.array_equal(loaded.assess(*inputs)[name], column)


def test_parts_are_chosen(dataset, features, trainer, monkeypatch):
    monkeypatch.setattr("classifier.parts.PARTS", {"distance": Distance})
    kinds = {None: ["distance"], (): []}
    for chosen, fitted in kinds.items():
        result = train(dataset, features, trainer, hidden=6, seed=3, restarts=1, parts=chosen)
        assert [part.kind for part in result.model.parts] == fitted


@pytest.mark.parametrize(
    ("kinds", "words"),
    [
        (
            ["distanse"],
            r"classifier\.parts must be one of distance, convolution, got 'distanse'; did you mean 'distance'\.",
        ),
        (["distance", "distance"], "names each part once"),
        (
            ["distance"],
            r"allows \(0 angular records, 1 needed\), got 'distance'; add such .* or leave distance out",
        ),
    ],
)
def test_parts_that_cannot_be_fitted_are_refused(dataset, features, trainer, monkeypatch, kinds, words):
    monkeypatch.setattr("classifier.parts.PARTS", {"distance": Distance})
    with pytest.raises(ParameterError, match=words):
        train(dataclasses.replace(dataset, unit="m/s^2"), features, trainer, hidden=6, restarts=1, parts=kinds)


@pytest.mark.parametrize(
    ("unit", "kinds", "reason"),
    [
        ("m/s^2", None, "not available, 0 angular records, 1 needed"),
        ("rad/s^2", [], "not asked for"),
        ("rad/s^2", None, None),
    ],
)
def test_a_part_that_is_left_out_is_told_with_its_reason(
    dataset, features, trainer, monkeypatch, tmp_path, unit, kinds, reason
):
    monkeypatch.setattr("classifier.parts.PARTS", {"distance": Distance})
    stated = dataclasses.replace(dataset, unit=unit)
    model = train(stated, features, trainer, hidden=6, seed=3, restarts=1, parts=kinds).model
    assert model.left_out.get("distance") == reason
    assert (f"distance: {reason}" in model.shortcomings()) == (reason is not None)
    # No part of these tells a strange record.
    assert model.guards == () and model.shortcomings()[-1] == UNGUARDED
    save_model(model, tmp_path)
    if reason is None:
        return
    assert yaml.safe_load((tmp_path / MODEL_YAML).read_text())["left_out"] == dict(model.left_out)
    assert load_model(tmp_path).left_out == model.left_out


def test_a_part_that_is_not_known_is_refused(trained, tmp_path, monkeypatch):
    save_model(trained, tmp_path)
    monkeypatch.delitem(PARTS, Distance.kind)
    with pytest.raises(ModelFileError, match=rf"{MODEL_YAML} must be as it was written, but parts\.kind must be"):
        load_model(tmp_path)
