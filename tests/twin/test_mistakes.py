"""Mistakes of a user end in a sentence that helps."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from discrepancy.indexer import Experiment
from discrepancy.records.conditions import Conditions
from indexer_env import OperatingPoint, Sensor, Signal, load_machine
from indexer_env.errors import ParameterError, SignalError
from indexer_env.units import RPM
from tests.monitor.twins import twin_folder
from tests.twin.builders import JUDGE
from twin import __main__ as command
from twin import diagnose
from twin.advice import advice
from twin.bench import Bench
from twin.folder import NETWORKS
from twin.make import Maker
from twin.quantities import spread_of
from twin.settings import Settings
from twin.teach import weights_by_control
from twin.twin import Twin
from twin.workplace import Workplace


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"faults": ["rust"]}, "twin.faults must be some of crack"),
        ({"simulated": 10}, "twin.simulated must be a whole number >= 1000"),
        ({"motor_speed_rpm": [1500.0, 1200.0]}, "the lowest and then the highest"),
        ({"load_torque": 5.0}, "two numbers"),
        ({"matters": {"rust": 1.0}}, "twin.matters must be sizes of"),
        ({"matters": 2.0}, "twin.matters must be a mapping of faults to sizes"),
        ({"false_alarms": 1.5}, "twin.false_alarms must be"),
        ({"simulated": 1000, "false_alarms": 1e-4}, "twin.simulated must be 84211 or more turns for false_alarms="),
    ],
)
def test_a_wrong_setting_is_refused(given, said):
    with pytest.raises(ParameterError) as error:
        Settings(**given)
    assert said in str(error.value)


HOUSING = {"path": "machine.housing_inertia", "unit": "kg m²", "value": 20.5, "low": 13.6, "high": 29.2}
KNOWN = {
    "scale_spread": 0.01, "spread": {"table_inertia": 0.01}, "start_compared": False, "parameters": [HOUSING],
}  # fmt: skip


def about(**changes):
    found = {
        "range": {"motor_speed_rpm": [1200.0, 1500.0], "load_torque": [2.0, 20.0]},
        "recorded": [[1200.0, 2.0], [1500.0, 20.0]], "shift": 0.05, "detection": [],
        "calibration": KNOWN,
        "check": {"turns": [{}, {}, {}]}, "weights": {"pooled": [False]},
        "settings": {"faults": ["crack"], "housing_uncertainty": 0.2},
    }  # fmt: skip
    return {**found, **changes}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"recorded": [[1500.0, 2.0], [1500.0, 20.0]]}, "Record at a second speed"),
        ({"recorded": [[1500.2, 2.0], [1500.9, 20.0]]}, "Record at a second speed"),
        ({"calibration": {**KNOWN, "scale_spread": 0.04}}, "Loads that are known better, and one larger than 20 N m"),
        ({"calibration": {**KNOWN, "start_compared": True}}, "once-per-turn pulse"),
        ({"calibration": {**KNOWN, "spread": {"cam_inertia": 0.2}}}, "Hardly known: inertia of the cam"),
        ({"check": {"turns": [{}]}}, "Hold out another healthy record"),
        (
            {"detection": [{"fault": "crack", "motor_speed_rpm": 1500.0, "load_torque": 2.0, "size": 0.01}]},
            "Diagnose at 1500 rpm and 2 N m",
        ),
    ],
)
def test_what_to_record_next_follows_from_what_is_open(changes, said):
    assert not any(said in sentence for sentence in advice(about()))
    assert any(said in sentence for sentence in advice(about(**changes)))


def test_the_advice_has_the_spread_of_the_table():
    assert advice(about())[-1].endswith(f"to {spread_of(HOUSING)} (95 %).") and spread_of(HOUSING) == "±38 %"


def test_a_twin_diagnoses_in_its_range_whatever_was_recorded_last():
    """Records at one speed alone: of a twin for that speed, of one for a wider range, and of an update."""
    one = {"recorded": [[1500.0, 2.0]]}
    alone = {"range": {"motor_speed_rpm": [1500.0, 1500.0], "load_torque": [2.0, 20.0]}}
    first, *_ = advice(about(**one, **alone))
    assert first.startswith("Record at a second speed") and "diagnoses at this speed alone" in first
    first, *_ = advice(about(**one))
    assert first.startswith("Record at a second speed") and "alone" not in first
    updated = {"calibration": {**KNOWN, "moved": {"since": False}}}
    assert not any("second speed" in sentence for sentence in advice(about(**one, **updated)))


def test_a_size_that_matters_beyond_the_largest_is_refused_before_the_work(tmp_path):
    made, asked = maker(), []
    bench = SimpleNamespace(check=asked.extend, subject=made.bench.subject)
    settings = Settings(matters={"reducer_play": 30.0}, motor_speed_rpm=[1200.0, 1500.0])
    with pytest.raises(ParameterError, match=r"twin\.matters\.reducer_play must be 20 ° .* got 30"):
        Maker(bench, settings, tmp_path / "twin")  # type: ignore[arg-type]
    assert not (tmp_path / "twin").exists() and asked == [1200.0 * RPM, 1500.0 * RPM], "speeds that records must allow"
    # a torque's largest size is known when the machine is calibrated and the range known
    made.settings, made.out = Settings(matters={"friction": 400.0}), twin_folder(tmp_path / "twin")
    held = {"cells": {"stations": 8, "count": 64, "rate": 500.0}, "load_factor": 1.0, "shift": 0.002,
            "range": {"motor_speed_rpm": [1200.0, 1500.0], "load_torque": [0.0, 20.0]}}  # fmt: skip
    made.work = SimpleNamespace(read=lambda name: held)  # type: ignore[assignment]
    made._calibrate = lambda: None  # type: ignore[method-assign]
    write_bracket(made.out)
    with pytest.raises(ParameterError, match=r"twin\.matters\.friction must be .* N m or less"):
        made.make()
    assert made.faults[-2].told(0.0, made.healthy.machine) == pytest.approx(100.0), "of the bracket that was found"


def write_bracket(folder) -> None:
    """The sensor of a twin stands on a bracket of 100 Hz."""
    values = dataclasses.asdict(Sensor(bracket_hz=100.0))
    (folder / "sensor.yaml").write_text(yaml.safe_dump(values), encoding="utf-8")


def test_a_loaded_twin_tells_a_loose_sensor_by_the_bracket_in_all(tmp_path):
    write_bracket(twin_folder(tmp_path / "twin"))
    twin = Twin.load(tmp_path / "twin")
    (loose,) = [fault for fault in twin.faults if fault.name == "sensor_loose"]
    assert loose.told(0.0, twin.machine) == pytest.approx(100.0) and loose.before > 0.0
    assert twin.synthesis is not None and loose in twin.synthesis.faults


@pytest.mark.parametrize(("speeds", "said"), [((150.0, 150.1), True), ((150.0, 170.0), False)])
def test_records_at_one_speed_are_told_before_the_work_begins(monkeypatch, tmp_path, capsys, speeds, said):
    bench = SimpleNamespace(points=[OperatingPoint(speed, 2.0) for speed in speeds])
    monkeypatch.setattr(command, "bench_of", lambda config: bench)
    monkeypatch.setattr(command, "with_its_effects", lambda bench: bench)
    monkeypatch.setattr("twin.make.Maker", lambda *args, **kwargs: None)
    monkeypatch.setattr(command, "made", lambda maker: print("the work begins"))
    command.run({"out": str(tmp_path / "twin"), "overwrite": False})
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "the work begins" and any("Record at a second speed" in one for one in lines[:-1]) == said
    assert any("at this speed alone" in one for one in lines) == said
    command.run({"out": str(tmp_path / "twin"), "overwrite": False, "motor_speed_rpm": [1200.0, 1500.0]})
    assert "at this speed alone" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("days", "error: signal must be a folder or pattern with measured files, got"),
        ("days/*.csv", "a pattern is quoted: signal='"),
    ],
)
def test_records_that_are_not_there_are_told_with_the_commands_own_key(tmp_path, run_command, given, said):
    twin_folder(tmp_path / "twin")
    (tmp_path / "days").mkdir()
    code, _, err = run_command(diagnose, f"twin={tmp_path / 'twin'}", f"signal='{tmp_path / given}'")
    assert code == 2 and said in err and "discrepancy" not in err and "measured=" not in err


@pytest.mark.parametrize("given", ["[]", "[1]"])
def test_a_list_that_names_no_files_is_refused(tmp_path, run_command, given):
    twin_folder(tmp_path / "twin")
    code, _, err = run_command(diagnose, f"twin={tmp_path / 'twin'}", f"signal={given}")
    assert code == 2 and "error: signal must be a path, got" in err and err.count("\n") == 1


def test_a_folder_that_is_no_twin_is_refused(tmp_path, run_command):
    (tmp_path / "notes.txt").write_text("mine")
    signal = tmp_path / "a.csv"
    table = np.column_stack([np.arange(100) / 500.0, np.ones(100)])
    np.savetxt(signal, table, delimiter=",", header="time [s],a [rad/s^2]", comments="")
    code, _, err = run_command(diagnose, f"twin={tmp_path}", f"signal={signal}")
    assert code == 2
    assert "which holds no twin.yaml; make one with indexer twin." in err and err.count("\n") == 1


def maker(**changes) -> Maker:
    """A maker of two records, one of them held out, that has no folder."""
    record = Experiment(Signal(np.arange(20.0), 500.0, unit="rad/s^2"), OperatingPoint(150.0, 2.0))
    given = {"fitted": [record], "held_out": [record], "sensor": Sensor(), **changes}
    model, held_out = (SimpleNamespace(experiments=given[name], known=()) for name in ("fitted", "held_out"))
    subject = SimpleNamespace(
        machine=load_machine("reference"), uncertainty={"table_inertia": 0.1}, sensor=given["sensor"], model=model,
        held_out=held_out,
    )  # fmt: skip
    made = Maker.__new__(Maker)
    made.bench, made.settings, made.before = Bench(subject), Settings(), given.get("before")  # type: ignore[arg-type]
    return made


def test_a_folder_is_that_of_the_same_records_sensor_and_division(tmp_path):
    (tmp_path / "twin.yaml").write_text("version: 5", encoding="utf-8")
    (record,) = maker().bench.subject.model.experiments
    faster = dataclasses.replace(record, signal=Signal(record.signal.values, 1000.0, unit="rad/s^2"))
    vaguer = dataclasses.replace(record, speed_uncertainty=0.01)
    loaded = dataclasses.replace(record, inertia_uncertainty=0.1)
    changes = [
        {}, {"sensor": Sensor(gain=1.2)}, {"sensor": Sensor(lowpass_hz=80.0)},
        {"fitted": [record, record], "held_out": []},
        {"fitted": [faster]}, {"fitted": [vaguer]}, {"fitted": [loaded]}, {"before": tmp_path},
    ]  # fmt: skip
    assert maker()._fingerprint() == maker()._fingerprint()
    assert len({maker(**change)._fingerprint() for change in changes}) == len(changes)


def test_records_that_cannot_make_a_twin_are_refused_before_any_fit():
    bench = maker().bench
    with pytest.raises(SignalError, match="must hold a whole turn of the table"):
        bench.check()
    slow = Experiment(Signal(np.arange(2000.0), 50.0, unit="rad/s^2"), OperatingPoint(150.0, 2.0))
    with pytest.raises(SignalError, match="must hold 128 samples or more a cam turn, got 54 at 1432 rpm; record with"):
        maker(fitted=[slow], held_out=[slow]).bench.check()
    with pytest.raises(SignalError, match="must hold 128 samples or more a cam turn, got 103 at 7500 rpm"):
        bench.check([7500.0 * RPM])


def test_an_old_twin_without_the_network_beside_goes_on(tmp_path):
    """The paper's network stands in the folder for comparison alone."""
    before = tmp_path / "before"
    before.mkdir()
    for name in (*NETWORKS, "synthesis"):
        (before / f"{name}.safetensors").write_bytes(name.encode())
    made = maker(before=before)
    made.out, made.work = tmp_path / "twin", Workplace(tmp_path / "twin", "these", False)
    keys = ("judge", "paper_judge", "weights", "records", "scores", "detection", "taught")
    made._take_over(dict.fromkeys(keys, 1))
    assert made.work.has(["learned.yaml", "detection.yaml", "synthesis.safetensors"])
    assert not made.work.has(["calibration.yaml"]), "written last, so that a run that was stopped begins again"


def test_faults_of_which_none_raises_an_alarm_are_told(monkeypatch, tmp_path):
    silent = {"any": np.full(3, -9.0), "faults": np.full((3, 1), -9.0)}
    monkeypatch.setattr("twin.teach.noisy", lambda *_: (np.zeros((3, 8, 64)), silent, []))
    with pytest.raises(SignalError, match="none of 3 simulated turns with faults of all sizes raises an alarm"):
        weights_by_control((), JUDGE, None, None, None, None, 0.9, 0, tmp_path)  # type: ignore[arg-type]


def test_a_record_at_another_radius_is_read_as_at_the_twins_own(tmp_path):
    twin = dataclasses.replace(Twin.load(twin_folder(tmp_path / "twin")), sensor=Sensor(radius=0.4))
    signal = Signal(np.arange(20.0), 500.0, unit="m/s^2", source="today.csv")
    told = Conditions(150.0, 2.0, sensor_radius=0.2, noise=0.1)
    read, conditions, notes = twin._at_own_radius(signal, told)
    assert read.values.tolist() == (2.0 * np.arange(20.0)).tolist() and conditions.noise == pytest.approx(0.2)
    assert notes == ("today.csv was taken at a radius of 0.2 m and is compared as at the twin's 0.4 m",)
    assert twin._at_own_radius(signal, Conditions(150.0, 2.0))[0] is signal
