"""What the twin's table counts."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.signal import correlate

from benchmarks.twin import __main__ as command
from benchmarks.twin import records, truth
from benchmarks.twin.judging import judged, misnamed, row_of
from benchmarks.twin.pipelines import _Fixed
from benchmarks.twin.records import drawn, records_of
from benchmarks.twin.table import Judged, counts, markdown
from benchmarks.twin.truth import HEALTHY, Truth, write_bench
from indexer_env import OperatingPoint, load_machine
from indexer_env.units import RPM
from tests.monitor.twins import twin_folder
from twin.diagnosis import FAULTY
from twin.folder import machine_and_sensor, stored_remains
from twin.make import Maker
from twin.turns import Cells, Healthy

CRACK, BOTH, NONE = frozenset({"crack"}), frozenset({"crack", "loose_base"}), frozenset()


def test_a_slight_false_name_counts_among_all_records_but_not_in_the_headline():
    found = counts([Judged(CRACK, BOTH, CRACK, False, True), Judged(CRACK, CRACK, CRACK, False, True)])
    assert found["misnamed"] == (1, 2) and found["misnamed above"] == (0, 2)
    refused = counts([Judged(CRACK, CRACK, CRACK, True, True)])
    assert refused["misnamed"] == refused["misnamed above"] == (1, 1)


def test_a_healthy_record_with_a_slight_false_name_is_named_but_not_called_faulty():
    rows = [Judged(NONE, CRACK, NONE, False, True), Judged(NONE, CRACK, CRACK, False, True)]
    found = counts([*rows, Judged(NONE, NONE, NONE, True, True), Judged(NONE, NONE, NONE, False, True)])
    assert found["healthy called faulty"] == (2, 4) and found["healthy named"] == (3, 4)


def test_physics_is_asked_about_what_is_misnamed_but_not_about_strangers():
    none = Judged(NONE, CRACK, CRACK, False, True)
    rows = [none, Judged(CRACK, CRACK, CRACK, False, True), Judged(NONE, CRACK, CRACK, False, True, left_out=True)]
    assert misnamed(["a", "b", "c"], rows) == ["a"]  # type: ignore[list-item, comparison-overlap]


def test_intervals_are_counted_in_both_groups():
    rows = [Judged(CRACK, CRACK, CRACK, False, True, (True,)), Judged(BOTH, BOTH, BOTH, False, True, (True, False))]
    found = counts(rows)
    assert (found["alone"], found["beside others"]) == ((1, 1), (1, 2))


def test_records_of_the_stated_size_and_strangers_have_rows_of_their_own():
    rows = [
        Judged(CRACK, NONE, NONE, False, True, at_size=True), Judged(CRACK, NONE, NONE, False, True, at_size=False),
        Judged(NONE, NONE, NONE, True, True, left_out=True), Judged(NONE, NONE, NONE, False, True),
    ]  # fmt: skip
    found = counts(rows)
    assert found["detected at the stated size"] == (1, 2) and found["left out refused"] == (1, 1)
    assert found["misnamed"] == (0, 1) and found["healthy called faulty"] == (0, 1)
    told = markdown({("twin", "as modelled"): [found]})
    assert "| twin | as modelled | 1 | 0.0 (0.0–79.3), 0 of 1 | – |" in told and "50.0 (9.5–90.5), 1 of 2" in told


def test_strangers_are_faults_of_no_table_and_tables_of_another_make():
    truth = Truth(load_machine("reference"), "as modelled", 0.1, 1.0)
    rng = np.random.default_rng(0)
    strangers = [row for row in (drawn(truth, rng) for _ in range(300)) if row[3]]
    makes = {type(real.machine.motion_law).__name__ for real, _, effects, _ in strangers if not effects}
    assert 10 < len(strangers) < 60 and len(makes) >= 2
    assert any(effects and effects[0].name == "cam.profile_error" for _, _, effects, _ in strangers)


def test_records_are_solved_once_and_come_back_as_they_were(tmp_path, monkeypatch):
    truth, file = Truth(load_machine("reference"), "as modelled", 0.1, 1.05), tmp_path / "records.npz"
    made = records_of(truth, 2, np.random.default_rng(7), file)
    monkeypatch.setattr(records, "taken", None)
    again = records_of(truth, 2, np.random.default_rng(7), file)
    for one, other in zip(made, again, strict=True):
        np.testing.assert_array_equal(one.signal.values, other.signal.values)
        assert (one.stated, one.sizes, one.stranger) == (other.stated, other.sizes, other.stranger)
    assert len(records_of(truth, 1, np.random.default_rng(7), file)) == 1


def noises(tmp_path, monkeypatch, seed: int) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
    """Whitened noise of a bench, of records that are asked about and of the stated size, and what is drawn to teach
    `transfer`: all of machine 1, which stands still."""
    machine, asked = Truth(load_machine("reference"), "as modelled", 1.0, 1.0), []
    seen = SimpleNamespace(fault="crack", size=0.1, motor_speed_rpm=1400.0, load_torque=5.0)
    about = {"calibration": {"headline": ""}, "check": {"trusted": True}, "scores": {}}
    found = SimpleNamespace(alarm=1.0)
    twin = SimpleNamespace(
        seen=[seen], matters={}, about=about, synthesis=None,
        diagnose_turn=lambda signal, stated: (asked.append(signal.values), found)[1],
    )  # fmt: skip

    def judged_all(ways, truth, records, file):
        asked.extend(record.signal.values for record in records)
        return {name: [] for name in ways}

    def drawn_only(truth, records, seed, rng):
        asked.append(rng.standard_normal(10_000))
        return {}

    monkeypatch.setattr(truth, "true_motion", lambda machine, point, samples, rate: (np.zeros(samples), point))
    monkeypatch.setattr(command, "make_twin", lambda *given, **more: twin)
    monkeypatch.setattr(command, "ways_of", lambda twin: {"networks": twin})
    monkeypatch.setattr(command, "of_paper", lambda twin: twin)
    monkeypatch.setattr(command, "judged", judged_all)
    monkeypatch.setattr(command, "transferred", drawn_only)
    settings = {**command.DEFAULTS, "records": 9, "physics": 0, "at_size": 4, "seed": seed}
    command.done(machine, 1, "twin", settings, tmp_path)
    command.done(machine, 1, command.TRANSFER, settings, tmp_path)
    files = (command.work_of(tmp_path, settings, 1, "twin") / "bench").glob("*Nm.csv")
    bench = [np.loadtxt(file, delimiter=",", skiprows=1)[:, 1] for file in files]
    *records, taught = asked
    return [whitened(one) for one in bench], [whitened(one) for one in records], taught


def whitened(record: np.ndarray) -> np.ndarray:
    return record[1:] - truth.COLOUR * record[:-1]


def likeness(one: np.ndarray, other: np.ndarray) -> float:
    """Largest correlation at any shift."""
    shorter = min(one, other, key=len)
    held = np.abs(correlate(one, other, method="fft")).max()
    return float(held / len(shorter) / np.sqrt(np.mean(one**2) * np.mean(other**2)))


def test_each_purpose_has_noise_of_its_own(tmp_path, monkeypatch):
    """Seed 5, that of the tables. Of independent noise the largest correlation at any shift is below 0.1."""
    bench, records, taught = noises(tmp_path, monkeypatch, 5)
    assert len(bench) == len(HEALTHY) and len(records) == 9 + 4
    others = [*bench, *records, taught]
    assert max(likeness(one, other) for k, one in enumerate(others) for other in others[:k]) < 0.2
    assert likeness(bench[0], bench[0][3000:]) > 0.9


def test_what_an_earlier_version_drew_is_not_taken_over(tmp_path, monkeypatch):
    """Version 1 had no number: rows and folders of it are refused, and its records lie elsewhere."""
    monkeypatch.setattr(command, "machine_of", None)
    own = {key: command.DEFAULTS[key] for key in command.OF_ROWS}
    rows = tmp_path / "rows" / "0.015-0.1-0-twin.json"
    rows.parent.mkdir()
    rows.write_text(json.dumps({"kind": "as modelled", "rows": {}, "settings": own}))
    with pytest.raises(SystemExit, match=r"was made with .*'draws': 2, 'twin': \d+\}; name another out"):
        command.main([f"out={tmp_path}"])
    rows.unlink()
    command._begin(tmp_path / "work-0.015-0.1-0-twin", own)
    with pytest.raises(SystemExit, match=r"was made with .*'draws': 2, 'twin': \d+\}; name another out"):
        command.main([f"out={tmp_path}"])
    kept: list[Any] = []
    monkeypatch.setattr(command, "records_of", lambda *given: kept.append(given[-1].name) or [])
    monkeypatch.setattr(command, "transferred", lambda *given: {})
    machine = Truth(load_machine("reference"), "as modelled", 0.1, 1.0)
    command.done(machine, 0, command.TRANSFER, dict(command.DEFAULTS), tmp_path)
    assert kept == ["0.015-0.1-0-5-draws-2.npz"]


@pytest.mark.parametrize("left", ['{"networks": {"tr', '{"networks": {}}', ""])
def test_a_record_whose_row_was_not_finished_is_asked_again(tmp_path, left):
    """A killed run leaves half a line, or a whole one without its end."""
    machine, file, asked = Truth(load_machine("reference"), "as modelled", 0.1, 1.0), tmp_path / "rows.jsonl", []
    verdict = SimpleNamespace(faults=(), verdict="healthy")
    twin: Any = SimpleNamespace(seen=[], matters={}, diagnose_turn=lambda one, _: (asked.append(one), verdict)[1])
    some: Any = [SimpleNamespace(signal=k, stated=None, sizes={}, stranger=False) for k in range(3)]
    first = judged({"networks": twin}, machine, some[:1], file)
    with file.open("a") as kept:
        kept.write(left)
    again = judged({"networks": twin}, machine, some, file)
    assert asked == [0, 1, 2] and again["networks"][0] == first["networks"][0]
    assert len(file.read_text().splitlines()) == len(again["networks"]) == 3


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("machines=x", r"machines must be a whole number >= 0, got 'x'\."),
        ("records=-1", r"records must be a whole number >= 0, got '-1'\."),
        ("noise=nan", r"noise must be a number >= 0, got 'nan'\."),
        ("only=1,b", r"only must be whole numbers >= 0, got 'b'\."),
        ("methods=twin,foo", r"methods must be some of twin, .*, transfer, got 'foo'\."),
        ("method=twin", r"method must be one of machines, .*, methods\."),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_made(tmp_path, monkeypatch, given, sentence):
    monkeypatch.setattr(command, "machine_of", None)
    with pytest.raises(SystemExit, match=rf"^benchmarks\.twin: {sentence}$"):
        command.main([f"out={tmp_path / 'out'}", given])
    assert not (tmp_path / "out").exists()


def test_a_judged_record_comes_back_from_a_file():
    row = Judged(BOTH, CRACK, CRACK, False, True, (True, False), sizes={"crack": 0.2, "loose_base": 0.1}, cpu=0.3)
    assert Judged.restore(json.loads(json.dumps(row.plain()))) == row


def test_what_is_above_the_stated_size_has_one():
    """A loose base is seen at no operating point, so that any of it matters."""
    seen = [SimpleNamespace(fault="crack", size=0.1), SimpleNamespace(fault="loose_base", size=None)]
    twin: Any = SimpleNamespace(seen=seen, matters={"crack": 0.1, "loose_base": 0.0})
    machine = Truth(load_machine("reference"), "as modelled", 0.1, 1.0)
    for sizes, above in (({"crack": 0.2}, True), ({"crack": 0.05}, False), ({"crack": 0.2, "loose_base": 0.9}, False)):
        one: Any = SimpleNamespace(sizes=sizes, stranger=False)
        assert row_of(one, (), FAULTY, twin, machine, 0.0).above == above, sizes


def test_a_bench_that_was_begun_is_written_anew(tmp_path, monkeypatch):
    machine, calls = Truth(load_machine("reference"), "as modelled", 0.1, 1.0), []

    def taken(*given: Any) -> tuple[np.ndarray, OperatingPoint]:
        calls.append(given)
        if len(calls) == 3:
            raise InterruptedError
        return np.zeros(3), OperatingPoint()

    monkeypatch.setattr(truth, "taken", taken)
    with pytest.raises(InterruptedError):
        write_bench(machine, tmp_path / "bench", np.random.default_rng(1))
    assert not (tmp_path / "bench").exists()
    write_bench(machine, tmp_path / "bench", np.random.default_rng(1))
    assert [path.name for path in tmp_path.iterdir()] == ["bench"]
    table = (tmp_path / "bench" / "records.csv").read_text().splitlines()
    assert len(table) == 1 + len(HEALTHY) and len(list((tmp_path / "bench").glob("*Nm.csv"))) == len(HEALTHY)


def begun(tmp_path, monkeypatch, *arguments: str) -> list[str]:
    """A run of the table whose work stops, and the folders that it has left."""

    def stopped(*given: Any) -> None:
        raise InterruptedError

    monkeypatch.setattr(command, "records_of", lambda *given: [])
    monkeypatch.setattr(command, "machine_of", lambda *given: Truth(load_machine("reference"), "as modelled", 0.1, 1.0))
    monkeypatch.setattr(command, "write_bench", stopped)
    with pytest.raises(InterruptedError):
        command.main(["machines=1", f"out={tmp_path}", *arguments])
    return sorted(path.name for path in tmp_path.iterdir())


@pytest.mark.parametrize("other", ["seed=6", "records=20", "simulated=1000"])
def test_a_run_that_was_stopped_goes_on_with_its_own_settings_alone(tmp_path, monkeypatch, other):
    for _ in range(2):
        assert begun(tmp_path, monkeypatch) == ["counts", "rows", "work-0.015-0.1-0-twin"]
    with pytest.raises(SystemExit, match=r"work-0\.015-0\.1-0-twin was made with .*; name another out"):
        command.main(["machines=1", f"out={tmp_path}", other])
    (tmp_path / "work-0.015-0.1-0-twin" / "settings.json").unlink()
    with pytest.raises(SystemExit, match="was made with settings that it does not tell, not"):
        command.main(["machines=1", f"out={tmp_path}"])


def test_what_was_made_goes_when_its_rows_are_written_and_not_before(tmp_path, monkeypatch):
    begun(tmp_path, monkeypatch)
    work, rows = tmp_path / "work-0.015-0.1-0-twin", tmp_path / "rows"
    monkeypatch.setattr(command, "done", lambda *given: {"kind": object(), "rows": {}})
    with pytest.raises(TypeError):
        command.main(["machines=1", f"out={tmp_path}"])
    assert work.exists() and not list(rows.glob("*.json"))
    monkeypatch.setattr(command, "done", lambda *given: {"kind": "as modelled", "rows": {}})
    command.main(["machines=1", f"out={tmp_path}"])
    assert not work.exists() and [path.name for path in rows.iterdir()] == ["0.015-0.1-0-twin.json"]
    # of a run that was stopped between the two
    next((tmp_path / "counts").iterdir()).unlink()
    command._begin(work, json.loads(next(rows.iterdir()).read_text())["settings"])
    command.main(["machines=1", f"out={tmp_path}"])
    assert not work.exists()


def test_what_is_counted_of_a_machine_is_kept_apart_from_its_rows(tmp_path, monkeypatch, capsys):
    """Another folder takes counts over and makes nothing anew; such of other settings are refused."""
    begun(tmp_path / "first", monkeypatch)
    rows = [Judged(CRACK, NONE, NONE, False, True, cpu=0.5), Judged(CRACK, CRACK, CRACK, False, True, (True,), cpu=1.5)]
    found = {"kind": "as modelled", "headline": "as drawn", "rows": {"networks": [row.plain() for row in rows]}}
    monkeypatch.setattr(command, "done", lambda *given: found)
    command.main(["machines=1", f"out={tmp_path / 'first'}"])
    told = capsys.readouterr().out
    kept = tmp_path / "first" / "counts"
    held = json.loads((kept / "0.015-0.1-0-twin.json").read_text())
    assert held["counts"]["networks"]["misnamed"] == [1, 2] and held["cpu_s"] == {"networks": [1.0, 1.45]}
    assert held["headline"] == "as drawn" and "| twin, networks | as modelled | 1 | 50.0 (9.5–90.5), 1 of 2 |" in told
    monkeypatch.setattr(command, "done", None)
    command.main(["machines=1", f"out={tmp_path / 'other'}", f"counts={kept}"])
    assert capsys.readouterr().out in told and not list((tmp_path / "other" / "rows").iterdir())
    with pytest.raises(SystemExit, match=r"counts/0\.015-0\.1-0-twin\.json was made with .*; name another counts"):
        command.main(["machines=1", f"out={tmp_path / 'other'}", f"counts={kept}", "records=20"])


def test_the_drawing_without_a_fit_has_what_records_leave_of_the_drawing(tmp_path, monkeypatch):
    """Records of the drawing itself, of which the fitted machine, another one, would leave much."""
    out, point = twin_folder(tmp_path / "twin"), OperatingPoint(1400.0 * RPM, 5.0)
    machine, sensor = machine_and_sensor(out)
    about = {"cells": {"stations": 8, "count": 64, "rate": 500.0}, "load_factor": 1.1, "noise": 9.0, "shift": 0.002,
             "range": {"motor_speed_rpm": [1200.0, 1500.0], "load_torque": [0.0, 20.0]}}  # fmt: skip
    turn = Healthy(machine, sensor, Cells(**about["cells"])).turn(point)
    record: Any = SimpleNamespace(operating_point=point)
    kept: dict[str, Any] = {}
    maker: Any = _Fixed.__new__(_Fixed)
    maker.method, maker.out = "nominal", out
    maker.work = SimpleNamespace(read=lambda name: about, write=kept.__setitem__)
    subject = SimpleNamespace(machine=machine, model=SimpleNamespace(experiments=[record]))
    maker.bench = SimpleNamespace(subject=subject, shift=0.002)
    monkeypatch.setattr(Maker, "_calibrate", lambda maker: None)
    monkeypatch.setattr("twin.make.turns_of", lambda experiment, healthy: np.stack([turn, turn]))
    pq.write_table(pa.table({"machine.table_inertia": [1.0]}), out / "posterior.parquet")
    maker._calibrate()
    left = stored_remains(out)
    assert left.points.tolist() == [[point.motor_speed, point.load_torque]] and np.abs(left.fixed).max() < 1e-3
    assert kept["calibration"]["load_factor"] == 1.0 and kept["calibration"]["noise"] < 0.01
