import dataclasses

import numpy as np
import pytest

from classifier.diagnose import diagnose, lines
from classifier.pictures import draw_diagnosis, draw_training
from indexer_env.errors import SignalError
from indexer_env.signal import Signal


@pytest.fixture
def signal(dataset):
    row = np.flatnonzero((dataset.classes == 2) & dataset.rows("validation"))[0]
    return Signal(dataset.records[row], dataset.sample_rate, dataset.quantity, dataset.unit, "a record")


def test_a_record_is_named(result, dataset, signal):
    said = diagnose(result.model, signal)
    assert (said.class_label, said.class_name, said.code) == (2, "rings at 20 Hz", "101")
    assert said.outputs == pytest.approx(result.model.outputs(signal.values[None])[0], abs=0)
    distances = np.sort(np.linalg.norm(np.array(said.outputs) - dataset.codes.matrix, axis=1))
    assert said.distance == pytest.approx(distances[0])
    assert said.margin == pytest.approx(distances[1] - distances[0])
    assert said.second_name != said.class_name
    assert any("2: rings at 20 Hz" in line for line in lines(said))


def test_the_first_turn_of_a_longer_record_is_used(result, signal):
    long = dataclasses.replace(signal, values=np.concatenate([signal.values, 100 * signal.values]))
    said = diagnose(result.model, long)
    assert said.outputs == diagnose(result.model, signal).outputs
    assert (said.used_duration, said.duration) == (2.0, 4.0)


@pytest.mark.parametrize("rate", [200.1, 199.9])
def test_the_clock_of_a_data_logger_may_be_a_little_off(result, signal, rate):
    said = diagnose(result.model, dataclasses.replace(signal, sample_rate=rate))
    assert said.class_label == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: {"unit": "m/s^2"}, r"in rad/s\^2 .* got table_acceleration in m/s\^2"),
        (lambda s: {"sample_rate": 500.0}, "sampled at 200 Hz .* got 500 Hz"),
        (lambda s: {"values": s.values[:300]}, r"at least 2 s .* got 1\.5 s"),
        (lambda s: {"values": np.full(400, 1.25)}, r"must vary, got 400 samples of 1\.25"),
    ],
)
def test_a_record_that_does_not_fit_is_refused_in_one_sentence(result, signal, change, words):
    with pytest.raises(SignalError, match=words) as caught:
        diagnose(result.model, dataclasses.replace(signal, **change(signal)))
    assert str(caught.value).startswith("a record must")
    assert "\n" not in str(caught.value)


def test_pictures_label_their_axes_with_units(result, dataset, signal):
    figures = draw_training(dataset, result)
    assert set(figures) == {"accelerations", "psds", "training", "confusion"}
    figures["diagnosis"] = draw_diagnosis(result.model, signal, diagnose(result.model, signal))

    def words(figure):
        labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel(), ax.get_title(loc="left"))]
        return " ".join([*labels, figure.get_supxlabel(), figure.get_supylabel()])

    assert "table acceleration [rad/s²]" in words(figures["accelerations"])
    assert "time [s]" in words(figures["accelerations"])
    assert "frequency [Hz]" in words(figures["psds"])
    assert "PSD [(rad/s²)²/Hz]" in words(figures["psds"])
    assert "mean square error [%]" in words(figures["training"])
    assert "validation: 24 records" in words(figures["confusion"])
    assert "class 2: rings at 20 Hz" in words(figures["diagnosis"])
    for label in (1, 2, 3):
        assert f"class {label}: rings at {10 * label} Hz" in words(figures["accelerations"])
