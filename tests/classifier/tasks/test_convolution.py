"""The convolutional network as a part: a second name beside the network's, stored with the model."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from classifier.diagnose.diagnosis import diagnose_turn
from classifier.export.model import left_out
from classifier.model import load_model, save_model
from classifier.tasks.convolution import Convolution, Learning
from classifier.tasks.decimate import Decimated
from classifier.train import train


@pytest.fixture(scope="module")
def trained(dataset, features, trainer):
    return train(dataset, features, trainer, hidden=6, seed=3, restarts=1, parts=["convolution"]).model


def test_it_names_tones_it_was_not_taught_with(trained, dataset):
    """Seed 3 of the training."""
    rows = dataset.rows("validation")
    records = dataset.records[rows]
    said = trained.assess(trained.scaled(records), trained.outputs(records), records)
    names = np.array(dataset.codes.names)[dataset.codes.positions(dataset.classes[rows])]
    assert np.mean(said["cnn_name"] == names) > 0.9
    assert np.all(said["cnn_probability"] >= 1.0 / len(dataset.codes.names))


def test_turns_of_one_file_make_it_no_surer(dataset, monkeypatch):
    """Each control record ten times, as turns of one file."""
    rows = np.concatenate([np.arange(len(dataset.classes)), np.repeat(np.flatnonzero(dataset.rows("control")), 9)])
    parts = {name: getattr(dataset, name)[rows] for name in ("records", "classes", "subsets")}
    turns = dataclasses.replace(dataset, table=pa.table({"machine_draw": rows}), **parts)

    class Right:
        def logits(self, records):
            found = (records[:, None] == dataset.records[None]).all(axis=-1).argmax(axis=1)
            return 4.0 * np.eye(3)[dataset.classes[found] - 1]

    monkeypatch.setattr(Learning, "fit", lambda self, data, seed: Right())
    nothing = np.empty(0)
    once, many = (Convolution.fit(data, nothing, nothing, 0).temperature for data in (dataset, turns))
    assert many == pytest.approx(once, rel=1e-3)


def test_a_sensor_with_an_offset_is_seen_as_one_without(dataset):
    high = dataclasses.replace(dataset, records=dataset.records + np.float32(500.0))
    seen, plain = (Decimated.fit(data, 100.0).apply(data.records) for data in (high, dataset))
    assert seen.std() == pytest.approx(plain.std(), rel=1e-3)


def test_it_tells_whether_the_other_network_agrees(trained, dataset):
    records = dataset.records[:6]
    scaled = trained.scaled(records)
    (part,) = trained.parts
    own = part.seen.logits(records).argmax(axis=1)
    same, other = part.codes[own], part.codes[(own + 1) % len(part.codes)]
    assert part.assess(scaled, same, records)["cnn_agrees"].all()
    assert not part.assess(scaled, other, records)["cnn_agrees"].any()


def test_it_comes_back_from_the_file_bit_for_bit(trained, dataset, tmp_path):
    save_model(trained, tmp_path)
    loaded = load_model(tmp_path)
    records = dataset.records
    seen = trained.scaled(records), trained.outputs(records), records
    for name, column in trained.assess(*seen).items():
        assert np.array_equal(loaded.assess(*seen)[name], column)
    assert loaded.parts[0].body() == trained.parts[0].body()


def test_weights_of_another_network_are_refused(trained):
    (part,) = trained.parts
    arrays = part.arrays()
    name = next(name for name in arrays if name.endswith("weight"))
    for changed in ({**arrays, name: arrays[name][:1]}, {key: value for key, value in arrays.items() if key != name}):
        with pytest.raises(ValueError, match="the weights of convolution are not those of its network"):
            Convolution.restore(part.body(), changed)


def test_a_diagnosis_says_it_in_words(trained, dataset):
    said = diagnose_turn(trained, dataset.records[0]).to_dict()["assessment"]
    assert said["cnn_name"] in dataset.codes.names
    assert isinstance(said["cnn_agrees"], bool) and 0.0 < said["cnn_probability"] <= 1.0


def test_it_is_fitted_on_request_alone(dataset, features, trainer):
    model = train(dataset, features, trainer, hidden=6, seed=3, restarts=1).model
    assert Convolution.kind not in [part.kind for part in model.parts]


def test_an_exported_model_is_without_it(trained):
    assert left_out(trained)["convolution"] == "cannot be exported"


def test_the_same_seed_gives_the_same_network(dataset):
    one, two, other = (Learning(epochs=3).fit(dataset, seed).logits(dataset.records) for seed in (1, 1, 2))
    assert np.array_equal(one, two) and not np.array_equal(one, other)
