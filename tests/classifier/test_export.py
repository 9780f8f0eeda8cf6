"""An exported model gives what the model gives, to 1e-6 and better, run by a runtime that shares no code with it."""

import dataclasses
import json
import sys
from functools import partial

import numpy as np
import onnx
import onnxruntime
import pyarrow as pa
import pytest

from classifier.export import __main__ as command
from classifier.export.model import guards, to_onnx
from classifier.features import Fft, Psd
from classifier.model import save_model
from classifier.tasks.confidence import Confidence
from classifier.tasks.novelty import SCORES, Novelty
from classifier.tasks.range import Range
from classifier.tasks.remaining import Remaining
from classifier.tasks.severity import Severity
from classifier.train import train
from indexer_env.errors import ParameterError

CLOSE = 1e-9


def run(exported, **inputs):
    session = onnxruntime.InferenceSession(exported.SerializeToString(), providers=["CPUExecutionProvider"])
    names = [output.name for output in session.get_outputs()]
    return dict(zip(names, session.run(None, inputs), strict=True))


def close(got, wanted):
    np.testing.assert_allclose(got, wanted, atol=CLOSE, rtol=CLOSE)


@pytest.mark.parametrize(
    ("features", "net"),
    [
        (Psd(2.0, 50.0), {}),
        (Psd(2.0, 100.0, "log"), {"output_function": "linear", "targets": "bipolar"}),
        (Psd(200 / 67, 90.0), {"hidden_function": "tanh", "output_function": "tanh", "targets": "bipolar"}),
        (Fft(50.0, 1.5), {}),
    ],
)
def test_outputs_from_records_and_from_features_are_those_of_the_model(dataset, trainer, features, net):
    model = train(dataset, features, trainer, hidden=6, seed=3, restarts=1, parts=[], **net).model
    records = dataset.records.astype(np.float64)
    wanted = model.outputs(records)
    nearest = np.array(model.codes.classes)[model.codes.decode(wanted)]
    unscaled = model.features.compute(records, model.sample_rate)
    for got in (run(to_onnx(model), record=records), run(to_onnx(model, "features"), features=unscaled)):
        close(got["outputs"], wanted)
        assert np.array_equal(got["class_label"], nearest)
        close(got["distance"], model.codes.distances(wanted).min(axis=1))


def test_a_feature_that_did_not_vary_says_nothing_there_either(result, dataset):
    scaling = dataclasses.replace(
        result.model.scaling, high=np.where(np.arange(26) == 3, result.model.scaling.low, 9.0)
    )
    model = dataclasses.replace(result.model, scaling=scaling)
    close(run(to_onnx(model), record=dataset.records.astype(float))["outputs"], model.outputs(dataset.records))


def with_severities(dataset):
    """The data set thrice over with some noise, so that there are enough records, and severities of two faults."""
    rng = np.random.default_rng(1)
    records = np.concatenate([dataset.records + 0.1 * rng.standard_normal(dataset.records.shape) for _ in range(3)])
    classes = np.tile(dataset.classes, 3)
    table = pa.table(
        {
            "fault_backlash": 0.1 * classes + 0.01 * rng.uniform(size=len(classes)),
            "fault_roller_crack": rng.uniform(size=len(classes)),
            "machine_draw": np.arange(len(classes)),
            "remaining_turns": 1000 * classes,
        }
    )
    subsets = np.tile(dataset.subsets, 3)
    changes = {"records": records.astype(np.float32), "classes": classes, "subsets": subsets, "table": table}
    return dataclasses.replace(dataset, **changes)


@pytest.mark.parametrize("score", SCORES)
def test_parts_say_the_same(result, dataset, score):
    stated = with_severities(dataset)
    scaled = result.model.scaled(stated.records)
    outputs = result.model.outputs_of(scaled)
    parts = (
        Confidence.fit(stated, scaled, outputs, 0),
        Range.fit(stated, scaled, outputs, 0),
        Novelty.fit(stated, scaled, outputs, 0, score=score),
        Severity.fit(stated, scaled, outputs, 0),
        Remaining.fit(stated, scaled, outputs, 0),
    )
    model = dataclasses.replace(result.model, parts=parts)
    # Some that are strange indeed, so that both flags come up.
    records = np.concatenate([dataset.records, 30.0 * dataset.records[:3]]).astype(np.float64)
    wanted = model.assess(model.scaled(records), model.outputs(records), records)
    got = run(to_onnx(model), record=records)
    assert set(got) == {"outputs", "class_label", "distance", *wanted}
    assert guards(model) == ("range", "novelty")
    assert got["is_outside"].any() and not got["is_outside"].all()
    for name, column in wanted.items():
        assert got[name].shape == column.shape
        close(got[name], column)
    assert 0 < got["is_novel"].sum() < len(records)


def test_what_the_file_cannot_say_is_told_in_it_and_by_the_command(result, exported):
    model = dataclasses.replace(result.model, parts=result.model.parts[:1], left_out={"severity": "not asked for"})
    assert model.parts[0].kind == "confidence"
    told = {entry.key: entry.value for entry in to_onnx(model).metadata_props}
    without = json.loads(told["indexer-diagnosis.left_out"])
    assert without["severity"] == "not asked for" and "the caller checks" in without["sensor"]
    assert json.loads(told["indexer-diagnosis.guards"]) == []
    ranged = {entry.key: entry.value for entry in to_onnx(result.model, "features").metadata_props}
    assert json.loads(ranged["indexer-diagnosis.left_out"])["range"] == "needs the record, not its features"
    _, out, _ = exported("out=a.onnx", "input=features")
    assert "without severity: not available, no size of a fault" in out
    assert "without range: needs the record" in out and "unguarded" not in out


def test_the_file_says_what_a_record_must_be(result):
    told = {entry.key: entry.value for entry in to_onnx(result.model).metadata_props}
    assert told["indexer-diagnosis.unit"] == "rad/s^2"
    assert json.loads(told["indexer-diagnosis.samples"]) == 400
    assert json.loads(told["indexer-diagnosis.features"])["resolution_hz"] == 2.0
    assert [entry["code"] for entry in json.loads(told["indexer-diagnosis.classes"])] == ["011", "101", "110"]
    with pytest.raises(ParameterError, match=r"export\.input must be one of record, features, got 'signal'"):
        to_onnx(result.model, "signal")


@pytest.fixture
def exported(result, tmp_path, monkeypatch, run_command):
    """Run the command in a folder with a model; what it printed, what it complained of and its exit code."""
    (tmp_path / "model").mkdir()
    save_model(result.model, tmp_path / "model")
    monkeypatch.chdir(tmp_path)
    return partial(run_command, command, "model=model")


def test_the_command_writes_one_file(exported, tmp_path):
    code, out, err = exported("out=deep/model.onnx")
    assert (code, err) == (0, "") and "deep/model.onnx" in out
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["model.onnx"]
    onnx.checker.check_model(tmp_path / "deep" / "model.onnx")
    code, _, err = exported("out=deep/model.onnx")
    assert code == 2 and "overwrite=true" in err
    assert exported("out=deep/model.onnx", "overwrite=true", "input=features")[0] == 0


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["out=model.bin"], "error: out must be a file that ends in .onnx"),
        (["out=null"], "error: out must be a path"),
        (["out=a.onnx", "input=signal"], "error: input must be one of record, features"),
        (["out=a.onnx", "model=nowhere"], "model.yaml"),
        (["out=a.onnx", "overwrite=5"], "error: overwrite must be true or false"),
        (["out=folder.onnx"], "a folder stands there"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(exported, tmp_path, overrides, words):
    (tmp_path / "folder.onnx").mkdir()
    before = sorted(tmp_path.rglob("*"))
    code, _, err = exported(*overrides)
    assert code == 2 and err.startswith("error: ") and len(err.strip().splitlines()) == 1
    assert words in err
    assert sorted(tmp_path.rglob("*")) == before


def test_without_the_extra_the_command_says_so(exported, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    code, _, err = exported("out=a.onnx")
    assert code == 2 and "pip install 'indexer-diagnosis[onnx]'" in err
