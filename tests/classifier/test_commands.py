"""The two commands from end to end: as a user starts them, or in this process where that tells as much."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from classifier import __main__ as training
from classifier.diagnose import __main__ as diagnosing
from tests.patience import PATIENCE

SETTINGS = (
    "features.maximum_hz=50",
    "features.resolution_hz=2",
    "net.hidden=6",
    "trainer.epochs=200",
    "restarts=2",
)


def start(module, *overrides, cwd):
    command = [sys.executable, "-W", "error", "-m", module, *overrides]
    # A checkout must serve as it is, installed or not.
    environment = {**os.environ, "PYTHONPATH": str(Path(training.__file__).parents[1])}
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def place(dataset, write_dataset, tmp_path_factory):
    """A folder with a data set and the model that the command trained on it."""
    folder = tmp_path_factory.mktemp("commands")
    write_dataset(dataset, folder / "set")
    code, out, err = start("classifier", "data=set", "out=model", *SETTINGS, cwd=folder)
    assert (code, err) == (0, ""), err
    assert "mean square error [%]" in out
    assert "misclassified [%]" in out
    return folder


@pytest.fixture(scope="module")
def csv(place, dataset):
    row = np.flatnonzero((dataset.classes == 3) & dataset.rows("validation"))[0]
    time = np.arange(dataset.records.shape[1]) / dataset.sample_rate
    table = np.column_stack([time, dataset.records[row]])
    np.savetxt(
        place / "record.csv",
        table,
        delimiter=",",
        fmt="%.6f",
        header="time [s],acceleration [rad/s^2]",
        comments="",
    )
    return "record.csv"


def test_training_leaves_a_model_its_results_and_pictures(place):
    names = {path.name for path in (place / "model").iterdir()}
    pictures = {f"{name}.png" for name in ("accelerations", "psds", "training", "confusion", "reliability")}
    assert names == {"model.safetensors", "model.yaml", "results.json", "results.parquet"} | pictures
    assert names | {"tensorboard"} == set(training.FILES)
    assert {path.name for path in place.iterdir()} >= {"set", "model"}
    assert not [path for path in place.iterdir() if path.name.startswith((".", "outputs"))]
    results = json.loads((place / "model" / "results.json").read_text())
    assert results["scores"]["validation"]["misclassified_percent"] == 0.0
    assert len(results["restarts"]) == 2
    assert results["config"]["net"]["hidden"] == 6
    assert len(results["curve"]["control_mse"]) == results["restarts"][results["kept"]]["epochs"] + 1


def test_training_again_is_refused_unless_asked(place, run_command, monkeypatch):
    before = (place / "model" / "model.safetensors").read_bytes()
    monkeypatch.chdir(place)
    code, _, err = run_command(training, "data=set", "out=model", *SETTINGS, "seed=1")
    assert code == 2
    assert "overwrite=true" in err
    assert len(err.strip().splitlines()) == 1
    assert (place / "model" / "model.safetensors").read_bytes() == before


def test_diagnosis_of_a_csv_file(place, csv, run_command, monkeypatch):
    monkeypatch.chdir(place)
    code, out, err = run_command(diagnosing, "model=model", f"measured={csv}", "out=diagnosis")
    assert (code, err) == (0, ""), err
    assert "3: rings at 30 Hz" in out
    names = {path.name for path in (place / "diagnosis").iterdir()}
    assert names == {"diagnosis.json", "turns.csv", "record.diagnosis.json", "record.diagnosis.png"}
    (said,) = json.loads((place / "diagnosis" / "record.diagnosis.json").read_text())["turns"]
    assert (said["class_label"], said["code"], len(said["outputs"])) == (3, "110", 3)
    assert (place / "diagnosis" / "record.diagnosis.png").stat().st_size > 10_000


def test_diagnosis_without_a_folder_only_prints(place, csv, run_command, monkeypatch):
    before = set(place.iterdir())
    monkeypatch.chdir(place)
    code, out, err = run_command(diagnosing, "model=model", f"measured={csv}")
    assert (code, err) == (0, ""), err
    assert "3: rings at 30 Hz" in out
    assert set(place.iterdir()) == before


@pytest.mark.parametrize(
    ("module", "overrides", "words"),
    [
        ("classifier", ("data=nowhere", "out=new"), "nowhere"),
        ("classifier", ("data=set",), "out must be given"),
        ("classifier", ("data=set", "out=new", "net.hiden=3"), "hidden"),
        ("classifier", ("data=set", "out=new", "trainer=traingdy"), "traingdx"),
        ("classifier", ("data=set", "out=new", "trainer.momentum=2"), "momentum"),
        ("classifier", ("data=set", "out=new", "trainer=trainlm", "trainer.damping=0"), "damping"),
        ("classifier", ("data=set", "out=new", "net.targets=bipolar"), "bipolar"),
        ("classifier", ("data=set", "out=new", "net.output_function=step"), "output_function"),
        ("classifier", ("data=set", "out=new", "threads=0"), "threads"),
        ("classifier", ("data=set", "out=new", "features.maximum_hz=150"), "half the sample rate"),
        ("classifier", ("data=set", "out=set"), "other files"),
        ("classifier", ("data=set", "out=new", "+net.layers=2"), "layers"),
        ("classifier", ("data=set", "out=new", "+layers=2"), "layers"),
        ("classifier", ("data=null", "out=new"), "data must be a path"),
        ("classifier.diagnose", ("model=set", "measured=record.csv", "out=new"), "model.yaml"),
        ("classifier.diagnose", ("model=model", "measured=nowhere.csv", "out=new"), "nowhere.csv"),
        ("classifier.diagnose", ("model=model", "measured=record.csv", "out=new", "read.unit=5"), "read.unit"),
        (
            "classifier.diagnose",
            ("model=model", "measured=record.csv", "overwrite=perhaps", "out=new"),
            "overwrite",
        ),
        ("classifier.diagnose", ("model=model", "measured=short.csv", "out=new"), "short.csv"),
        ("classifier.diagnose", ("model=model", "measured=record.csv", "out=new", "read.sample_rate=200"), "leave"),
        ("classifier.diagnose", ("model=model", "measured=record.csv", "out=new", "read.unit=g"), "given once"),
        ("classifier.diagnose", ("model=model", "measured=record.csv", "read=null"), "mapping"),
        ("classifier.diagnose", ("model=model", "measured=record.csv", "overwrite=5"), "overwrite"),
        ("classifier.diagnose", ("-m", "model=model", "measured=record.csv"), "one folder in a sweep"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(place, csv, monkeypatch, capsys, module, overrides, words):
    rows = (place / csv).read_text().splitlines()
    (place / "short.csv").write_text("\n".join(rows[:200]) + "\n")
    before = set(place.iterdir())
    monkeypatch.chdir(place)
    monkeypatch.setattr(sys, "argv", [module, *overrides])
    with pytest.raises(SystemExit) as stopped:
        {"classifier": training, "classifier.diagnose": diagnosing}[module].main()
    assert stopped.value.code == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert len(err.strip().splitlines()) == 1
    assert words in err
    assert set(place.iterdir()) == before
