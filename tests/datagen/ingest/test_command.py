"""`indexer ingest`: one line makes a data set, every mistake is one sentence and exit code 2."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import datagen.ingest.__main__ as command
from datagen.shard import read_manifest, read_shards
from tests.indexer_records.formats.samples import written


@pytest.fixture
def call(tmp_path, monkeypatch, run_command):
    """Run the command in a folder with files/<class>/a.csv; gives exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    for place, name in enumerate(("intact", "worn")):
        (tmp_path / "files" / name).mkdir(parents=True)
        values = np.random.default_rng(place).normal(size=1100)
        written("csv", tmp_path / "files" / name, values, np.zeros(1100), 1000.0)

    return functools.partial(run_command, command)


GOOD = ("measured=files", "out=set", "period=0.5", "read.signal_column=acc")


def test_one_line_makes_a_data_set(call, tmp_path):
    code, out, _ = call(*GOOD, "known.motor_speed_rpm=1500")
    assert code == 0 and "4 turns" in out and "2 partial turns" in out
    assert "no labels table was given, so the files have no groups" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["files", "set"]
    manifest = read_manifest("set")
    assert manifest["classes"] == {"intact": 2, "worn": 2} and manifest["config"]["period"] == 0.5
    assert "measured" not in manifest["config"] and "out" not in manifest["config"]
    assert read_shards("set").row(0)["motor_speed"] == pytest.approx(157.08, abs=0.01)


def test_a_labels_table(call, tmp_path):
    (tmp_path / "labels.csv").write_text(
        "file,class,machine,sensor_radius\nintact/a.csv,cracked,M1,0.4\nworn/a.csv,intact,M2,\n"
    )
    code, _, err = call(*GOOD, "labels=labels.csv", "split.by=machine")
    assert (code, err) == (0, "")
    rows = [read_shards("set").row(index) for index in (0, 2)]
    assert [(row["class_name"], row["groups"], row["sensor_radius"]) for row in rows] == [
        ("cracked", '{"machine": "M1"}', 0.4),
        ("intact", '{"machine": "M2"}', None),
    ]


def test_what_was_rejected_and_what_may_be_misspelled_is_said(call, tmp_path):
    (tmp_path / "labels.csv").write_text(
        "file,class,machine,motor_sped_rpm\nintact/a.csv,cracked,M1,1500\nworn/a.csv,intact,M2,1500\n"
    )
    (tmp_path / "files" / "worn" / "a.csv").write_text("time,acc\n0,1\n0.001,2\n")
    code, out, _ = call(*GOOD, "labels=labels.csv")
    assert code == 0 and "1 file or turn rejected, with reasons in set/rejected.parquet\n  worn/a.csv, column" in out
    assert "motor_sped_rpm is taken for a group; write 'motor_speed_rpm' if that was meant" in out
    assert "machine is taken" not in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("out=set", "period=1"), "measured must be given"),
        (("measured=files", "out=set", "pulse.column=pulse"), "error: period must be the duration of one turn"),
        (
            ("measured=files", "out=set", "motor_turns=205"),
            "error: motor_turns must be given with known.motor_speed_rpm",
        ),
        (("measured=nowhere", "out=set", "period=1"), "error: measured must be a folder or pattern"),
        ((*GOOD, "puls.column=x"), "puls"),
        ((*GOOD, "pulse.colunm=x"), "did you mean 'column'"),
        ((*GOOD, "pulse.edge=up"), "pulse.edge must be one of rising, falling"),
        ((*GOOD, "pulse.column=pulse"), "the pulse must change, got 0 throughout"),
        ((*GOOD, "labels=none.csv"), "the labels table none.csv cannot be read"),
        ((*GOOD, "known.sensor_radius=-1"), "known.sensor_radius must be"),
        ((*GOOD, "split.calibration=-1"), "split.calibration must be"),
        ((*GOOD, "split.calibration=60"), "split.calibration must be a finite number >= 0 and <= 1, got 60"),
        (
            (*GOOD, "split.calibration=0", "split.control=0", "split.validation=0"),
            "split.calibration must be > 0 where control and validation are 0",
        ),
        ((*GOOD, "split.by=day"), "split.by must be one of file"),
        ((*GOOD, "sample_rate=5000"), "sample_rate must be at most 1.1 times"),
        ((*GOOD, "overwrite=2"), "overwrite must be true or false"),
        ((*GOOD, "read.scale=2"), "read.unit must be one of"),
    ],
)
def test_mistakes_are_one_sentence_and_leave_nothing(call, tmp_path, arguments, said):
    code, _, err = call(*arguments)
    lines = [line for line in err.splitlines() if not line.startswith("ingesting")]
    assert code == 2 and len(lines) == 1 and said in lines[0], err
    assert not (tmp_path / "set").exists()


def test_overwrite_replaces_a_data_set(call):
    assert call(*GOOD)[0] == 0
    code, _, err = call(*GOOD)
    assert code == 2 and "overwrite=true" in err
    assert call(*GOOD, "overwrite=true")[0] == 0
