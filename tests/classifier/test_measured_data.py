"""Measured files with labels of one's own: ingested, learnt from, and a further one diagnosed; by the commands."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from classifier import __main__ as training
from classifier.dataset import load_dataset
from classifier.diagnose import __main__ as diagnosing
from datagen.check import check
from datagen.ingest import __main__ as ingesting

pytestmark = pytest.mark.usefixtures("plain_pictures")

RATE, PERIOD = 500.0, 1.0
TONES = {"intact": 20.0, "worn": 45.0}


def write(path, tone, seed, turns=3, rate=RATE, amplitude=1.0):
    """A tone in noise, m/s², with a pulse at each turn of about one second."""
    rng = np.random.default_rng(seed)
    time = np.arange(round((turns + 0.6) * PERIOD * rate)) / rate
    tones = amplitude * np.sin(2 * np.pi * tone * time + rng.uniform(0, 6))
    values = tones + 0.2 * rng.standard_normal(time.size)
    pulse = 5.0 * ((time - 0.25) % PERIOD < 0.1) * (time > 0.2)
    rows = [f"{t:.4f},{v:.5f},{p:.1f}" for t, v, p in zip(time, values, pulse, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["time [s],acc [m/s^2],pulse", *rows]))


@pytest.fixture
def command(monkeypatch, tmp_path, capsys):
    """Run a command in the temporary folder; what it printed, what it complained of and its exit code."""

    def run(module, *overrides):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["command", *overrides])
        code = 0
        try:
            module.main()
        except SystemExit as stopped:
            code = stopped.code
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


def test_from_a_folder_of_files_to_the_diagnosis_of_one(command, tmp_path):
    for place, (name, tone) in enumerate(TONES.items()):
        for number in range(10):
            write(tmp_path / "bench" / name / f"{number}.csv", tone, 10 * place + number)
    for machine, rate in (("new", RATE), ("fast", 2560.0)):
        write(tmp_path / f"{machine}.csv", TONES["worn"], 99, rate=rate)
    of_both = (f"sample_rate={RATE}", f"period={PERIOD}", "known.sensor_radius=0.4")
    assert command(ingesting, "measured=bench", "out=set", "pulse.column=pulse", *of_both)[0] == 0

    data = load_dataset(tmp_path / "set")
    assert data.records.shape == (60, 500) and data.unit == "m/s^2"
    assert [data.codes.names, data.codes.codes] == [("intact", "worn"), ("10", "01")]
    assert data.conditions.sensor_radius == (0.4, 0.4) and data.conditions.machines == ()

    small = ("net.hidden=5", "restarts=2", "features.resolution_hz=2", "parts=[range]")
    code, _, err = command(training, "data=set", "out=model", *small)
    assert (code, err) == (0, "")
    for name in ("new", "fast"):
        chosen = ("model=model", f"measured={name}.csv", f"out={name}", "pulse.column=pulse")
        code, _, err = command(diagnosing, *chosen)
        assert code == 2 and "give known.sensor_radius=NUMBER in m" in err
        code, _, err = command(diagnosing, *chosen, "known.sensor_radius=0.3")
        assert code == 2 and "must be 0.4 m within 1 %" in err
        assert command(diagnosing, *chosen, "known.sensor_radius=0.4")[0] == 0
        told = json.loads((tmp_path / name / "diagnosis.json").read_text())
        assert (told["verdicts"], told["turns_not_diagnosed"]) == ({"worn": 3}, 0)
    code, out, _ = command(diagnosing, "model=model", "measured=set")
    assert code == 0 and "right        100 % of 12 turns that the model did not see" in out


def test_severities_of_a_labels_table_are_learnt(command, tmp_path):
    """The tone grows with the play that the table states; seeds 0 to 59 and 99."""
    rows = ["file,class,faults.backlash_deg"]
    for number in range(60):
        backlash = 0.0 if number % 3 == 0 else 2.0 + 0.25 * number
        name = "intact" if backlash == 0.0 else "worn"
        write(tmp_path / "bench" / f"{number}.csv", TONES[name], number, turns=2, amplitude=1.0 + 0.2 * backlash)
        rows.append(f"{number}.csv,{name},{backlash}")
    (tmp_path / "labels.csv").write_text("\n".join(rows))
    of_turns = (f"sample_rate={RATE}", f"period={PERIOD}")
    assert command(ingesting, "measured=bench", "labels=labels.csv", "out=set", *of_turns)[0] == 0
    data = load_dataset(tmp_path / "set")
    assert np.ptp(np.degrees(data.table.column("fault_backlash").to_numpy())) == pytest.approx(16.75)
    assert data.table.column("fault_roller_crack").null_count == len(data.records)
    assert check(tmp_path / "set").faults == []

    code, _, err = command(training, "data=set", "out=model", "restarts=2", "features=psd", "features.resolution_hz=2")
    assert (code, err) == (0, "")
    write(tmp_path / "new.csv", TONES["worn"], 99, amplitude=1.0 + 0.2 * 10.0)
    assert command(diagnosing, "model=model", "measured=new.csv", "out=new")[0] == 0
    told = json.loads((tmp_path / "new" / "new.diagnosis.json").read_text())
    assert len(told["turns"]) == 3
    for turn in told["turns"]:
        assert turn["assessment"]["backlash_deg"] == pytest.approx(10.0, abs=2.0)


def write_record(path, record):
    """A record of 8.2 s as a data logger leaves it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    time = np.arange(record.size) / 1000.0
    header = "time [s],acc [m/s^2]"
    np.savetxt(path, np.column_stack([time, record]), delimiter=",", fmt="%.6g", header=header, comments="")


def test_a_model_of_twelve_files_refuses_what_is_strange(command, tmp_path, machines, cracked, strange_records):
    """From files to exit codes: 6 files of each class, and 28 others of the bench that it has to know again."""
    records, places = machines.records.astype(float), {"whole": ~cracked, "cracked": cracked}
    for name, rows in places.items():
        for number, row in enumerate(np.flatnonzero(rows)):
            write_record(tmp_path / ("bench" if number < 6 else "held") / f"{name}-{row}.csv", records[row])
    labels = ["file,class", *(f"{path.name},{path.stem.split('-')[0]}" for path in (tmp_path / "bench").iterdir())]
    (tmp_path / "labels.csv").write_text("\n".join(labels))
    of_turns = ("period=8.2", "known.sensor_radius=0.4", "labels=labels.csv")
    assert command(ingesting, "measured=bench", "out=set", *of_turns)[0] == 0
    code, out, _ = command(training, "data=set", "out=model", "restarts=2")
    assert code == 0
    for reason in (
        "novelty: not available, 10 independent records of calibration and control, 19 needed",
        "confidence: not available, 2 independent control records, 20 needed",
    ):
        assert reason in out
    code, _, err = command(training, "data=set", "out=other", "restarts=1", "parts=[range,novelty]")
    assert code == 2 and "10 independent records of calibration and control, 19 needed" in err

    known = ("model=model", "known.sensor_radius=0.4")
    for name, record in strange_records.items():
        write_record(tmp_path / "strange" / f"{name}.csv", record)
        code, out, err = command(diagnosing, *known, f"measured='strange/{name}.csv'")
        if name in ("noise", "tone"):
            assert code == 2 and "must show the indexing of the table" in err
        else:
            assert code == 0 and "outside the range of the training" in out
    write_record(tmp_path / "flipped.csv", -records[0])
    code, _, err = command(diagnosing, *known, "measured=flipped.csv")
    assert code == 2 and "its sign is reversed; is the sensor mounted the other way round" in err
    assert command(diagnosing, *known, "measured=held", "out=held_out", "pictures=0")[0] == 0
    told = json.loads((tmp_path / "held_out" / "diagnosis.json").read_text())
    assert (told["turns"], told["turns_not_diagnosed"]) == (28, 0)
    assert set(told["verdicts"]) == {"whole", "cracked"}


def test_a_class_that_no_validation_file_has_is_refused(command, tmp_path):
    for place, (name, tone) in enumerate(TONES.items()):
        for number in range(3 - place):
            write(tmp_path / "bench" / name / f"{number}.csv", tone, number)
    assert command(ingesting, "measured=bench", "out=set", f"sample_rate={RATE}", f"period={PERIOD}")[0] == 0
    code, _, err = command(training, "data=set", "out=model")
    assert code == 2 and err.startswith("error: the validation subset must hold at least one record of every class")
    assert not (tmp_path / "model").exists()
