import dataclasses
import re

import numpy as np
import pytest

from classifier.diagnose import diagnose, diagnose_turn
from classifier.diagnose.report import CaseReport, line, lines
from indexer_env.errors import SignalError
from indexer_env.signal import Signal


@pytest.fixture
def signal(dataset):
    row = np.flatnonzero((dataset.classes == 2) & dataset.rows("validation"))[0]
    return Signal(dataset.records[row], dataset.sample_rate, dataset.quantity, dataset.unit, "a record")


def named(result, signal):
    (report,) = diagnose(result.model, signal)
    assert report.diagnosis is not None
    return report.diagnosis


def test_a_record_is_named(result, dataset, signal):
    said = named(result, signal)
    assert (said.class_label, said.class_name, said.code) == (2, "rings at 20 Hz", "101")
    assert said.outputs == pytest.approx(result.model.outputs(signal.values[None])[0], abs=0)
    distances = np.sort(np.linalg.norm(np.array(said.outputs) - dataset.codes.matrix, axis=1))
    assert said.distance == pytest.approx(distances[0])
    assert said.margin == pytest.approx(distances[1] - distances[0])
    assert said.second_name != said.class_name
    assert said == diagnose_turn(result.model, signal.values)


def test_every_whole_turn_of_a_longer_record_is_diagnosed(result, signal):
    long = dataclasses.replace(signal, values=np.concatenate([signal.values, 1.5 * signal.values, signal.values[:100]]))
    first, second = diagnose(result.model, long)
    assert first.diagnosis == named(result, signal)
    assert (first.turn, first.start, first.duration) == (0, 0.0, 2.0)
    assert (second.turn, second.start, second.duration) == (1, 2.0, 2.0)
    assert second.diagnosis.outputs != first.diagnosis.outputs


@pytest.mark.parametrize("rate", [200.1, 199.9])
def test_the_clock_of_a_data_logger_may_be_a_little_off(result, signal, rate):
    assert named(result, dataclasses.replace(signal, sample_rate=rate)) == named(result, signal)


def test_a_faster_record_is_brought_to_the_rate_of_the_model(result, signal):
    time = np.arange(1024) / 512
    fast = Signal(np.sin(2 * np.pi * 20 * time), 512.0, unit=signal.unit)
    slow = Signal(np.sin(2 * np.pi * 20 * np.arange(400) / 200), 200.0, unit=signal.unit)
    assert named(result, fast).outputs == pytest.approx(named(result, slow).outputs, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: {"unit": "m/s^2"}, r"in rad/s\^2 .* got table_acceleration in m/s\^2"),
        (lambda s: {"sample_rate": 100.0}, "sampled at 200 Hz or faster .* got 100 Hz"),
        (lambda s: {"values": s.values[:300]}, r"at least 2 s, one turn of the table, got 1\.5 s"),
    ],
)
def test_a_record_that_does_not_fit_is_refused_in_one_sentence(result, signal, change, words):
    with pytest.raises(SignalError, match=words) as caught:
        diagnose(result.model, dataclasses.replace(signal, **change(signal)))
    assert str(caught.value).startswith("a record must")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda v: np.full_like(v, 1.25), "must vary, got one value over 100 % of it; check the sensor and its cable"),
        (lambda v: np.where(np.arange(400) < 100, 0.0, v), "must vary, got one value over 25 % of it"),
        (lambda v: np.clip(v, -0.6, 0.6), r"must stay within the sensor's range, got \d\d.* % clipped samples; lower"),
    ],
)
def test_a_dead_or_clipped_sensor_is_reported_and_not_diagnosed(result, signal, spoil, words):
    bad = dataclasses.replace(signal, values=np.concatenate([signal.values, spoil(signal.values), signal.values]))
    good, flawed, last = diagnose(result.model, bad)
    assert good.diagnosis == last.diagnosis == named(result, signal)
    assert flawed.diagnosis is None and flawed.record is None
    report = CaseReport.of("a record", None, [flawed])
    assert not report.diagnosed
    assert report.problem.startswith("a record: the turn that begins at 2 s must") and report.problem.endswith(".")
    assert re.search(words, report.problem)


def test_the_verdict_is_the_name_or_why_there_is_none(result, signal):
    loud_signal = dataclasses.replace(signal, values=10 * signal.values)
    assert named(result, signal).verdict == "rings at 20 Hz" and named(result, signal).guarded
    (loud,) = diagnose(result.model, loud_signal)
    assert loud.verdict == "none of the classes it was taught, outside the range of the training"
    novelty = tuple(part for part in result.model.parts if part.kind == "novelty")
    (novel,) = diagnose(dataclasses.replace(result.model, parts=novelty), loud_signal)
    assert novel.verdict == "none of the classes it was taught"
    assert novel.diagnosis.is_novel and not novel.diagnosis.is_right("rings at 20 Hz")
    (dead,) = diagnose(result.model, dataclasses.replace(signal, values=np.zeros(400)))
    assert dead.verdict.startswith("not diagnosed: it must vary, got one value")
    unguarded = dataclasses.replace(result.model, parts=(), left_out={"novelty": "not asked for"})
    (turn,) = diagnose(unguarded, signal)
    assert turn.verdict == "unguarded, nearest to rings at 20 Hz" and turn.diagnosis.is_right("rings at 20 Hz")
    told = turn.to_dict()
    assert (told["verdict"], told["guarded"]) == (turn.verdict, False)
    assert told["left_out"] == {"novelty": "not asked for"}


def test_a_turn_that_is_none_of_the_classes_is_not_named(result, signal):
    (turn,) = diagnose(result.model, signal)
    assessment = {"is_novel": True, "backlash_deg": 3.0, "backlash_deg_low": 2.0, "backlash_deg_high": 4.5}
    novel = dataclasses.replace(turn, diagnosis=dataclasses.replace(turn.diagnosis, assessment=assessment))
    report = CaseReport.of("a record", "rings at 20 Hz", [novel, turn, novel])
    assert report.verdict == "none of the classes it was taught"
    assert "(2 of 3 turns)" in line(report) and "(is: rings at 20 Hz)" in line(report)
    words = lines(report)
    assert "verdict      none of the classes it was taught" in words and "nearest      2: rings at 20 Hz" in words
    assert "backlash deg 3 (2 to 4.5)" in words


@pytest.mark.parametrize("guarded", [True, False])
def test_a_wrong_name_that_ends_with_the_true_one_is_told_as_wrong(result, signal, guarded):
    (turn,) = diagnose(result.model, signal)
    for name, told in (("rings at 20 Hz", ""), ("spoke bent, rings at 20 Hz", "(is: rings at 20 Hz)")):
        diagnosis = dataclasses.replace(turn.diagnosis, class_name=name, guarded=guarded)
        said = dataclasses.replace(turn, diagnosis=diagnosis)
        assert line(CaseReport.of("a record", "rings at 20 Hz", [said])).partition("  (")[2] == told[1:]
