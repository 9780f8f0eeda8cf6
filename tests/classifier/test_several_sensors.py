"""Measured files of several sensors and channels, from the labels table to the diagnosis; by the commands."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import yaml

from benchmarks.several_sensors import CLASSES, RATE, SENSORS, records_of
from classifier import __main__ as training
from classifier import leaveout
from classifier.dataset import load_dataset
from classifier.diagnose import __main__ as diagnosing
from classifier.feature_choice import LINES, SEGMENTS, Auto, chosen, make_choice, told
from classifier.features import Fft, Psd
from classifier.groups import part
from classifier.leaveout import ACCURACY, judge, splits
from classifier.leaveout_methods import logistic
from classifier.pictures import draw_training
from classifier.tasks.convolution import Convolution, Learning
from classifier.train import train
from classifier.trainers.traingdx import TrainGdx
from datagen.check import check
from datagen.ingest import __main__ as ingesting
from indexer_env.errors import ParameterError, SignalError
from indexer_records.measured import Reading, read_recording

pytestmark = pytest.mark.usefixtures("plain_pictures")

SHORT = 1000
"""Samples of a file: a quarter of a second at 4 kHz."""


@pytest.fixture(scope="module")
def measured():
    """Records of the four sensors; seed 1."""
    return records_of(1, repeats=10)


# -------------------------------------------------------------------------------- features


def test_measured_records_get_logarithms_and_the_band_of_their_rate(measured):
    found = Auto().features_for(measured)
    assert (found.scale, found.maximum_hz) == ("log", 0.4 * RATE)
    assert found.resolution_hz == pytest.approx(SEGMENTS / (measured.records.shape[1] / RATE))
    assert "log PSD" in told(Auto(), found, measured)


def test_the_resolution_follows_the_length_but_never_gives_more_lines_than_it_may(measured):
    long = dataclasses.replace(measured, records=np.tile(measured.records, (1, 8)))
    assert Auto().features_for(long).resolution_hz == 0.4 * RATE / LINES
    short = dataclasses.replace(measured, records=measured.records[:, :800])
    assert Auto().features_for(short).resolution_hz == pytest.approx(40.0)


def test_simulated_records_get_the_paper_s(dataset):
    assert Auto().features_for(dataset) == Psd()
    assert "as in the paper" in told(Auto(), Psd(), dataset)


def test_what_is_given_wins(measured):
    given = make_choice({"kind": "auto", "resolution_hz": None, "maximum_hz": 100.0, "scale": "linear"})
    assert chosen(given, measured) == Psd(SEGMENTS / (measured.records.shape[1] / RATE), 100.0, "linear")
    assert chosen(make_choice({"kind": "psd"}), measured) == Psd()
    assert told(Fft(), Fft(), measured) == ""
    with pytest.raises(ParameterError, match="resolution_hz must be a finite number > 0 Hz, got -1"):
        make_choice({"kind": "auto", "resolution_hz": -1})
    with pytest.raises(ParameterError, match="resolution_hz must be <="):
        chosen(make_choice({"kind": "auto", "maximum_hz": 2.0, "resolution_hz": 5.0}), measured)


def test_they_hold_better_on_a_sensor_that_was_not_seen(measured):
    """The same method on both; docs/explanation/classifier.md has more seeds and methods."""
    sensors = np.array([json.loads(text)["sensor"] for text in measured.table.column("groups").to_pylist()])
    found = {}
    for name, features in {"paper": Psd(), "measured": Auto().features_for(measured)}.items():
        rows = [row for split in splits(measured, sensors)[0] for row in judge(split, name, logistic(features), 0)]
        found[name] = np.mean([row.value for row in rows if row.metric == ACCURACY])
    assert found["measured"] > found["paper"] + 10


# -------------------------------------------------------------------------------- files


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A file for each record: its sensor in a column of its own name, beside one that says nothing; labels beside."""
    monkeypatch.chdir(tmp_path)
    data, rng = records_of(2, repeats=5), np.random.default_rng(3)
    rows = ["file,class,sensor,signal_column,scale,unit"]
    (tmp_path / "files").mkdir()
    groups = [json.loads(text)["sensor"] for text in data.table.column("groups").to_pylist()]
    for number, (record, label, sensor) in enumerate(zip(data.records, data.classes, groups, strict=True)):
        table = np.column_stack([np.arange(SHORT) / RATE, record[:SHORT], rng.normal(size=SHORT)])
        head = f"time [s],{sensor} out [m/s^2],other [m/s^2]"
        np.savetxt(f"files/{number}.csv", table, fmt="%.6f", delimiter=",", header=head, comments="")
        rows.append(f"{number}.csv,{CLASSES[label - 1]},{sensor},{sensor} out,,")
    (tmp_path / "labels.csv").write_text("\n".join(rows))
    return tmp_path


TABLE = ("measured=files", "labels=labels.csv")
SMALL = ("net.hidden=5", "restarts=2", "trainer.epochs=60")


def test_each_file_has_its_channel_and_is_a_record_where_no_turn_is_cut(files, run_command):
    code, out, err = run_command(ingesting, *TABLE, "out=set")
    assert code == 0, err
    assert "each turn is a record of 0.25 s at 4000 Hz" in out and "groups of the labels table: sensor\n" in out
    data = load_dataset("set")
    assert data.measured and data.records.shape == (60, SHORT) and data.sample_rate == RATE
    written = {(json.loads(row["groups"])["sensor"], row["source_channel"]) for row in data.table.to_pylist()}
    assert written == {(sensor, f"{sensor} out") for sensor in SENSORS}
    assert check("set").faults == []


def test_the_choice_of_features_is_printed_and_stands_in_the_model(files, run_command):
    assert run_command(ingesting, *TABLE, "out=set")[0] == 0
    code, out, err = run_command(training, "data=set", "out=model", "parts=[]", *SMALL)
    assert code == 0, err
    assert "features: log PSD every 32 Hz up to 1600 Hz, as suits measured records" in out
    stands = yaml.safe_load((files / "model" / "model.yaml").read_text())["features"]
    assert stands == {"kind": "psd", "resolution_hz": 32.0, "maximum_hz": 1600.0, "scale": "log"}
    code, out, _ = run_command(training, "data=set", "out=mine", "parts=[]", "features.scale=linear", *SMALL)
    assert "features: linear PSD every 32 Hz" in out


def test_leaveout_sets_the_methods_side_by_side(files, run_command):
    assert run_command(ingesting, *TABLE, "out=set")[0] == 0
    code, out, err = run_command(leaveout, "data=set", "by=sensor", "out=left", "seeds=1", *SMALL)
    assert code == 0, err
    assert "| accuracy [%] on | S1 | S2 | S3 | S4 | mean over the groups |" in out
    for method in ("mlp", "logistic", "cnn"):
        assert out.count(f"| {method} |") == 6  # in the table of accuracies, and once a sensor and the mean
    assert "features: log PSD" in out and (files / "left" / "leaveout.png").exists()
    code, _, err = run_command(leaveout, "data=set", "by=sensor", "out=two", "methods=[forest]", *SMALL)
    assert code == 2 and "methods must be one of mlp, logistic, cnn, got 'forest'" in err


def test_several_channels_are_one_record_from_the_file_to_the_diagnosis(files, run_command):
    """The second channel of half of the files is the first times 2; what the record says is the same by any way."""
    labels = files / "labels.csv"
    rows = labels.read_text().splitlines()
    head, *rest = rows
    labels.write_text("\n".join([head, *(row.replace(" out,,", " out|other,,") for row in rest)]))
    control = ("split.calibration=0.4", "split.control=0.4")  # 24 files, as the convolution needs 20
    code, _, err = run_command(ingesting, *TABLE, *control, "out=set")
    assert code == 0, err
    data = load_dataset("set")
    assert data.records.shape == (60, 2, SHORT) and data.channels == 2
    first = np.loadtxt("files/0.csv", delimiter=",", skiprows=1)[:, 1:].T
    np.testing.assert_allclose(data.records[0], first, rtol=1e-6)
    assert data.table.column("source_channel")[0].as_py() == '["S1 out", "other"]'
    assert check("set").faults == []

    code, _, err = run_command(training, "data=set", "out=model", "parts=[range,convolution]", *SMALL)
    assert code == 0, err
    mapped = "measured=files/0.csv", "read.signal_column=[S1 out,other]"
    code, _, err = run_command(diagnosing, "model=model", *mapped, "out=told")
    assert code == 0, err
    told_of = json.loads((files / "told" / "0.diagnosis.json").read_text())["turns"][0]
    code, _, err = run_command(diagnosing, "model=model", "measured=set", "out=all", "pictures=1")
    assert code == 0, err
    of_row = json.loads((files / "all" / "set-item-0.diagnosis.json").read_text())["turns"][0]
    assert told_of["outputs"] == pytest.approx(of_row["outputs"], abs=1e-6)

    code, _, err = run_command(diagnosing, "model=model", "measured=files/0.csv", "read.signal_column=other")
    assert code == 2 and "must give 2 channels as the model was trained on, got 1" in err


def test_a_file_of_other_channels_is_refused(files, run_command):
    labels = files / "labels.csv"
    labels.write_text(labels.read_text().replace("S4 out,,", "S4 out|other,,"))
    code, _, err = run_command(ingesting, *TABLE, "out=set")
    assert code == 2 and "read.signal_column must be as many channels for each file, got '1 for" in err
    code, _, err = run_command(ingesting, "measured=files", "out=set", "read.signal_column=[other,other]")
    assert code == 2 and "read.signal_column must be a text, a list of different texts or null" in err


def test_a_unit_and_a_scale_may_stand_in_the_table(files, run_command):
    labels = files / "labels.csv"
    labels.write_text(labels.read_text().replace("S1 out,,", "S1 out,2,g"))
    assert run_command(ingesting, *TABLE, "out=set")[0] == 0
    first = np.loadtxt("files/0.csv", delimiter=",", skiprows=1)[:, 1]
    np.testing.assert_allclose(load_dataset("set").records[0], 2 * 9.80665 * first, rtol=1e-5)
    labels.write_text(labels.read_text().replace("S1 out,2,g", "S1 out,two,g"))
    code, _, err = run_command(ingesting, *TABLE, "out=again")
    assert code == 2 and "scale must be a number, got 'two'" in err


def test_a_shorter_file_is_refused_and_a_longer_one_cut(files, run_command):
    rows = (files / "files" / "0.csv").read_text().splitlines()
    (files / "files" / "0.csv").write_text("\n".join(rows[:500]))
    (files / "files" / "1.csv").write_text("\n".join(rows[:-8]))
    code, out, err = run_command(ingesting, *TABLE, "out=set")
    assert code == 0, err
    data = load_dataset("set")
    assert data.records.shape == (59, SHORT - 8) and "1 file or turn rejected" in out


# -------------------------------------------------------------------------------- several channels, in the library


def test_features_of_several_channels_stand_side_by_side():
    records = np.random.default_rng(0).normal(size=(3, 2, 400))
    for features in (Psd(10.0, 50.0, "log"), Fft(50.0, 2.0)):
        both = features.compute(records, 200.0)
        each = [features.compute(records[:, place], 200.0) for place in (0, 1)]
        assert np.array_equal(both, np.concatenate(each, axis=1))


def test_a_model_of_two_channels_draws_and_hears_both(dataset, trainer):
    """The class is told by the second channel alone."""
    rng = np.random.default_rng(6)
    both = np.stack([rng.normal(size=dataset.records.shape).astype(np.float32), dataset.records], axis=1)
    two = dataclasses.replace(dataset, records=both)
    result = train(two, Psd(2.0, 50.0), TrainGdx(epochs=300), hidden=6, restarts=2, parts=())
    model = result.model
    assert (model.channels, model.samples, len(model.frequencies)) == (2, 400, 52)
    assert result.score("validation").misclassified_percent == 0.0
    assert set(draw_training(two, result)) >= {"psds", "accelerations"}
    network = Learning(epochs=10).fit(two, 0)
    assert network.logits(both).shape == (72, 3)
    part_of_it = Convolution(network, 1.0, two.codes.names, two.codes.matrix)
    again = Convolution.restore(part_of_it.body(), part_of_it.arrays())
    assert np.array_equal(again.seen.logits(both[:4]), network.logits(both[:4]))
    assert part(two, two.classes != 2).records.shape == (48, 2, 400)


def test_a_short_record_is_decimated_less_and_too_short_a_one_refused(measured):
    short = dataclasses.replace(measured, records=measured.records[:, :600])
    assert Learning(epochs=1).fit(short, 0).decimated.factor == 2  # 16 would leave 38 samples
    with pytest.raises(SignalError, match="at least 284 samples for the convolutional network, got 283"):
        Learning(epochs=1).fit(dataclasses.replace(measured, records=measured.records[:, :283]), 0)


def test_one_channel_is_asked_for_where_only_one_can_be_used(files):
    recording = read_recording("files/0.csv", Reading(signal_column=("S1 out", "other")))
    assert recording.channels == ("S1 out", "other") and len(recording.signals) == 2
    with pytest.raises(SignalError, match="must name one channel here, got 'S1 out', 'other'"):
        _ = recording.signal
