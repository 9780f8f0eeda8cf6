"""The command over files, patterns, folders and data sets; in this process, to save time."""

import dataclasses
import hashlib
import json
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.csv
import pytest
from scipy.signal import resample

from classifier.dataset import rows_sha256
from classifier.diagnose import __main__ as command
from classifier.diagnose import diagnose
from classifier.diagnose.__main__ import _stem
from classifier.diagnose.report import CaseReport, summary, summary_lines
from classifier.model import save_model
from datagen.store import MANIFEST
from indexer_env.signal import Signal


def write(path, records, rate=200.0):
    path.parent.mkdir(parents=True, exist_ok=True)
    values = np.concatenate(records)
    time = np.arange(len(values)) / rate
    header = "time [s],acceleration [rad/s^2]"
    np.savetxt(path, np.column_stack([time, values]), delimiter=",", fmt="%.6f", header=header, comments="")


@pytest.fixture(scope="module")
def place(result, dataset, write_dataset, tmp_path_factory):
    """A model, files of one to three turns of classes 1 to 3 (one dead, one too short), and their data set."""
    folder = tmp_path_factory.mktemp("diagnose")
    (folder / "model").mkdir()
    save_model(result.model, folder / "model")
    chosen = [dataset.records[np.flatnonzero(dataset.classes == label)[-1]] for label in (1, 2, 3)]
    write(folder / "bench" / "one.csv", chosen[:1])
    write(folder / "bench" / "b" / "one.csv", [chosen[1], chosen[1], chosen[2]])
    write(folder / "bench" / "dead turn.csv", [chosen[2], np.zeros(400)])
    write(folder / "bad" / "dead.csv", [np.zeros(400)])
    write(folder / "bad" / "short.csv", [chosen[0][:100]])
    rows = np.flatnonzero(dataset.subsets == "validation")
    write_dataset(dataset, folder / "set")
    assert len(rows) == 24
    return folder


@pytest.fixture
def diagnosed(place, monkeypatch, run_command, plain_pictures):
    """Run the command in the place; its exit code, what it printed and what it complained of."""
    monkeypatch.chdir(place)
    return partial(run_command, command, "model=model")


def turns(place, out):
    return pyarrow.csv.read_csv(place / out / "turns.csv").to_pylist()


def test_a_folder_of_files_gives_a_report_and_a_picture_each(place, diagnosed):
    code, out, err = diagnosed("measured=bench", "out=folder")
    assert (code, err) == (0, "")
    assert "bench/b/one.csv  rings at 20 Hz  (2 of 3 turns)" in out
    names = {path.name for path in (place / "folder").iterdir()}
    stems = {"one", "one-2", "dead-turn"}
    assert names == {"diagnosis.json", "turns.csv"} | {
        f"{stem}.diagnosis.{end}" for stem in stems for end in ("json", "png")
    }
    told = json.loads((place / "folder" / "diagnosis.json").read_text())
    assert (told["signals"], told["turns"], told["turns_not_diagnosed"]) == (3, 6, 1)
    assert told["verdicts"] == {"rings at 20 Hz": 2, "rings at 30 Hz": 2, "rings at 10 Hz": 1}
    rows = turns(place, "folder")
    assert [row["turn"] for row in rows] == [0, 1, 2, 0, 1, 0]
    assert [row["problem"][:9] for row in rows] == ["", "", "", "", "must vary", ""]


@pytest.mark.parametrize(
    ("signal", "found"),
    [
        ("measured='bench/**/one.csv'", 2),
        ("measured=[bench/one.csv,bench/b/one.csv]", 2),
        ("measured=[bench,bad/dead.csv]", 4),
    ],
)
def test_patterns_and_lists_of_files(diagnosed, signal, found):
    _, out, _ = diagnosed(signal)
    assert sum(".csv  " in text for text in out.splitlines()) == found
    assert "bench/one.csv  rings at 10 Hz" in out


def test_a_data_set_is_compared_with_its_own_labels(place, diagnosed):
    code, _, err = diagnosed("measured=set", "out=rows", "pictures=2")
    assert (code, err) == (0, "")
    told = json.loads((place / "rows" / "diagnosis.json").read_text())
    assert (told["signals"], told["turns"], told["right_percent"]) == (72, 72, 100.0)
    assert len(list((place / "rows").glob("*.png"))) == 2
    assert (place / "rows" / "set-item-7.diagnosis.json").is_file()
    assert {row["true_class"] == row["class_name"] for row in turns(place, "rows")} == {True}
    assert (
        _stem("data/table2.v1, item 7", set()) == "table2.v1-item-7" and _stem("days/one two.csv", set()) == "one-two"
    )


@pytest.mark.parametrize("key", ["data", "fine_tuned_on"])
def test_what_is_right_is_told_of_records_that_the_model_did_not_see(result, dataset, place, diagnosed, key):
    """Of the 72 rows 24 are validation."""
    digest = hashlib.sha256((place / "set" / MANIFEST).read_bytes()).hexdigest()
    provenance = {"data": {}, key: {"manifest_sha256": digest}}
    (place / key).mkdir()
    save_model(dataclasses.replace(result.model, provenance=provenance), place / key)
    code, out, _ = diagnosed(f"model={key}", "measured=set", f"out=of_{key}", "pictures=0")
    assert code == 0 and "right        100 % of 24 turns that the model did not see" in out
    assert "taught       48 turns that the training used: not compared" in out
    told = json.loads((place / f"of_{key}" / "diagnosis.json").read_text())
    assert (told["turns"], told["turns_of_the_training"], told["turns_compared"]) == (72, 48, 24)
    assert [row["subset"] for row in turns(place, f"of_{key}")] == dataset.subsets.tolist()


def test_rows_of_a_longer_data_set_of_the_same_seed_are_those_that_were_taught(result, dataset, place, diagnosed):
    """The first 30 of 72 items, as if the model had been trained on `count=30`."""
    shutil.copytree(place / "set", place / "longer")
    manifest = json.loads((place / "longer" / MANIFEST).read_text())
    manifest |= {"campaign": "bench", "config": {"count": 72, "campaign": {"name": "bench"}}}
    (place / "longer" / MANIFEST).write_text(json.dumps(manifest))
    (place / "short").mkdir()
    provenance = {"data": {"manifest_sha256": "of 30", "rows_sha256": rows_sha256(manifest), "count": 30}}
    save_model(dataclasses.replace(result.model, provenance=provenance), place / "short")
    assert diagnosed("model=short", "measured=longer", "out=longer_out", "pictures=0")[0] == 0
    assert [row["subset"] or None for row in turns(place, "longer_out")] == [*dataset.subsets[:30], *[None] * 42]


def test_a_clipped_record_of_a_data_set_is_not_diagnosed(dataset, place, diagnosed, write_dataset):
    """Its file had flat tops that a filter has hidden: the row says so."""
    write_dataset(dataset, place / "clipped", clipped_share=0.2)
    code, _, err = diagnosed("measured=clipped", "out=of_clipped", "pictures=0")
    assert code == 2 and "item 71" in err and "must stay within the sensor's range, got 20 % clipped samples" in err
    told = [row["problem"] for row in turns(place, "of_clipped")]
    assert told[:-1] == [""] * 71 and told[-1].startswith("must stay within the sensor's range")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("read.unit=g", "read.unit must be left out for the data set stated"),
        ("read.sample_rate=1000", "read.sample_rate must be left out"),
        ("pulse.column=tacho", "pulse.column must be left out for the data set stated, whose records are read and cut"),
        ("known.motor_speed_rpm=1400", "as stated, item 0 states it"),
        ("known.machine=press", "known.machine must be bench as stated, item 0 states it, got 'press'"),
    ],
)
def test_what_a_data_set_says_otherwise_is_refused(dataset, place, diagnosed, write_dataset, given, said):
    if not (place / "stated").exists():
        write_dataset(dataset, place / "stated", {"motor_speed": 157.08, "machine_name": "bench"})
    code, _, err = diagnosed("measured=stated", given)
    assert code == 2 and said in err and len(err.splitlines()) == 1
    agreed = ("known.motor_speed_rpm=1500", "known.machine=bench", "pulse.tolerance=0.05")
    assert diagnosed("measured=stated", *agreed)[0] == 0


def test_what_was_taught_has_no_say_in_what_is_right(result, dataset):
    """A wrong record of the training beside a right one of the validation."""
    record = dataset.records[np.flatnonzero(dataset.classes == 2)[0]]
    said = diagnose(result.model, Signal(record, dataset.sample_rate, dataset.quantity, dataset.unit, "a record"))
    reports = [
        CaseReport.of("one", "rings at 20 Hz", said, "validation"),
        CaseReport.of("two", "rings at 30 Hz", said, "control"),
    ]
    assert summary(reports)["right_percent"] == 100.0
    assert "right_percent" not in summary(reports[1:]) and "taught" in "".join(summary_lines(summary(reports[1:])))


def test_a_bad_file_costs_itself_and_the_exit_code(place, diagnosed):
    code, out, err = diagnosed("measured=[bad/short.csv,bench/one.csv,bad/dead.csv,nowhere.csv]", "out=mixed")
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert err.startswith(
        "error: 3 of 4 signals could not be diagnosed; the first: bad/short.csv must hold at least 2 s"
    )
    assert "bench/one.csv  rings at 10 Hz" in out and "bad/dead.csv  not diagnosed" in out
    told = json.loads((place / "mixed" / "diagnosis.json").read_text())
    problems = {entry["signal"]: entry["problem"] for entry in told["signals_told"]}
    assert "must vary, got one value over 100 %" in problems["bad/dead.csv"]
    assert "nowhere.csv does not exist" in problems["nowhere.csv"]
    assert problems["bench/one.csv"] == ""


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["measured=bad/dead.csv"], "bad/dead.csv: the turn that begins at 0 s must vary"),
        (["measured=[bad/dead.csv,bad/short.csv]"], "2 signals, none of which could be diagnosed"),
        (["measured=nowhere.csv"], "nowhere.csv does not exist"),
        (["measured='nowhere/*.csv'"], "folder or pattern with measured files"),
        (["measured=[]"], "error: measured must be"),
        (["measured=5"], "error: measured must be"),
        (["measured=bench/one.csv", "pictures=-1"], "error: pictures must be a whole number >= 0"),
        (["measured=bench/one.csv", "pulse.column=tacho"], "no numeric column 'tacho'"),
        (["measured=bench/one.csv", "pulse.threshold=2.5"], "pulse.threshold must be left out where no pulse.column"),
        (["measured=bench/one.csv", "pulse.edge=up"], "pulse.edge must be one of rising, falling"),
        (["measured=bench/one.csv", "known.sensor_radius=-1"], "known.sensor_radius must be"),
        (["measured=bench/one.csv", "known=null"], "known must be a mapping"),
        (["measured=bench/one.csv", "known.speed=3"], "known.speed"),
    ],
)
def test_what_gives_no_diagnosis_at_all_is_one_sentence_and_nothing_is_written(place, diagnosed, overrides, words):
    before = set(place.iterdir())
    code, _, err = diagnosed(*overrides, "out=new")
    assert code == 2
    assert err.startswith("error: ") and len(err.strip().splitlines()) == 1
    assert words in err
    assert set(place.iterdir()) == before


def test_what_is_said_and_the_training_does_not_know_is_told(place, diagnosed):
    code, out, _ = diagnosed("measured=bench/one.csv", "known.machine=press", "known.motor_speed_rpm=3")
    assert code == 0 and "not compared motor_speed_rpm, machine, as not all training records state it" in out


@pytest.mark.parametrize("samples", [396, 399, 404])
def test_a_row_of_a_table_that_turned_a_little_faster_or_slower_is_diagnosed(
    result, dataset, place, diagnosed, write_dataset, samples
):
    """It is stretched to the turn that was taught, so that its orders stay."""
    other = dataclasses.replace(dataset, records=resample(dataset.records, samples, axis=1))
    write_dataset(other, place / f"of {samples}")
    assert diagnosed(f"measured='of {samples}'", f"out=as_{samples}", "pictures=0")[0] == 0
    assert diagnosed("measured=set", "out=as_taught", "pictures=0", "overwrite=true")[0] == 0
    told = [[row["class_name"] for row in turns(place, out)] for out in (f"as_{samples}", "as_taught")]
    same = [one == other for one, other in zip(*told, strict=True)]
    assert len(same) == 72 and sum(same) >= 70


def test_a_model_of_known_conditions_asks_for_them(result, place, diagnosed, dataset):
    conditions = dataclasses.replace(result.model.conditions, motor_speed=(157.0, 157.1), machines=("bench",))
    (place / "strict").mkdir(exist_ok=True)
    save_model(dataclasses.replace(result.model, conditions=conditions), place / "strict")
    code, out, _ = diagnosed("model=strict", "measured=bench/one.csv")
    assert code == 0 and "motor_speed_rpm, machine as in the training records" in out
    code, out, _ = diagnosed(
        "model=strict", "measured=bench/one.csv", "known.motor_speed_rpm=1500", "known.machine=bench"
    )
    assert code == 0 and "assumed" not in out
    code, _, err = diagnosed("model=strict", "measured=bench/one.csv", "known.motor_speed_rpm=900")
    assert code == 2 and "1499.24 to 1500.19 rpm within 2 %" in err and "got 900 rpm" in err


def test_what_the_rows_of_a_data_set_state_is_not_assumed(result, place, diagnosed, dataset, write_dataset):
    conditions = dataclasses.replace(result.model.conditions, motor_speed=(157.0, 157.1), machines=("bench",))
    (place / "known").mkdir()
    save_model(dataclasses.replace(result.model, conditions=conditions), place / "known")
    write_dataset(dataset, place / "stated", every={"motor_speed": 157.05, "machine_name": "bench"})
    code, out, _ = diagnosed("model=known", "measured=stated")
    assert code == 0 and "assumed" not in out
    code, out, _ = diagnosed("model=known", "measured=[stated,bench]")
    assert code == 0 and out.count("assumed      motor_speed_rpm, machine as in the training") == 1
    code, out, _ = diagnosed("model=known", "measured=set", "known.machine=bench")
    assert code == 0 and out.count("assumed      motor_speed_rpm as in the training records") == 1


def test_a_data_set_without_a_record_is_one_sentence(diagnosed, monkeypatch):
    monkeypatch.setattr(command, "cases_of", lambda *given: iter(()))
    code, _, err = diagnosed("measured=set")
    assert code == 2 and err.startswith("error: measured must hold at least one record")


@pytest.mark.parametrize("door", [["indexer_cli", "diagnose"], ["classifier.diagnose"]])
def test_a_reader_that_leaves_takes_no_result_away(place, door):
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONUNBUFFERED": "1", "PYTHONPATH": str(root)}
    reader, writer = os.pipe()
    os.close(reader)
    words = ["model=model", "measured=[bench/one.csv,bench/one.csv]", f"out=left_{door[0]}", "pictures=0"]
    line = [sys.executable, "-m", *door, *words]
    done = subprocess.run(line, stdout=writer, stderr=subprocess.PIPE, text=True, cwd=place, env=environment)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")
    assert (place / f"left_{door[0]}" / "diagnosis.json").is_file()


def test_a_model_that_nothing_guards_says_so_everywhere(result, place, diagnosed):
    left_out = {"novelty": "not available, 2 independent records of calibration and control, 19 needed"}
    (place / "bare").mkdir()
    save_model(dataclasses.replace(result.model, parts=(), left_out=left_out), place / "bare")
    code, out, err = diagnosed("model=bare", "measured=bench/one.csv", "out=unguarded")
    assert (code, err) == (1, "")
    assert f"without      novelty: {left_out['novelty']}" in out and "unguarded: the model gives any record" in out
    assert "verdict      unguarded, nearest to rings at 10 Hz" in out
    told = json.loads((place / "unguarded" / "diagnosis.json").read_text())
    assert (told["guards"], told["left_out"], told["turns_unguarded"]) == ([], left_out, 1)
    (row,) = turns(place, "unguarded")
    assert (row["guarded"], row["verdict"]) == (False, "unguarded, nearest to rings at 10 Hz")
    assert row["left_out"] == f"novelty: {left_out['novelty']}"
    code, out, _ = diagnosed("model=bare", "measured=bench")
    assert code == 1 and "unguarded    5 turns" in out
    # In a sweep every job is done, and the greatest code is that of the command.
    sweep = ("-m", "model=bare,model", "measured=bench/one.csv", "out=swept")
    code, _, err = diagnosed.func(command, *sweep)
    assert (code, err) == (1, "") and (place / "swept" / "1" / "diagnosis.json").is_file()


def test_earlier_results_are_replaced_only_when_asked(place, diagnosed):
    assert diagnosed("measured=bench/one.csv", "out=again")[0] == 0
    code, _, err = diagnosed("measured=bench", "out=again")
    assert code == 2 and "overwrite=true" in err
    assert diagnosed("measured=bench", "out=again", "overwrite=true")[0] == 0
    assert (place / "again" / "dead-turn.diagnosis.json").is_file()
