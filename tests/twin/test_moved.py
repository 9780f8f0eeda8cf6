"""New healthy records of a machine that has a twin: what of it they change."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from indexer_env import OperatingPoint
from indexer_env.units import RPM
from tests.twin.test_mistakes import maker
from tests.twin.test_posterior import ABOUT, BEFORE, SMOOTH, STAYED, calibrated
from twin.calibrate import Calibrated, Finding
from twin.folder import NETWORKS, PAPER, stored_remains
from twin.moved import gone_on, moved_since
from twin.nuisance import draws_in
from twin.remains import Remains
from twin.settings import Settings
from twin.turns import Cells
from twin.workplace import Workplace

SPREAD, FAST = 0.01, OperatingPoint(1500.0 * RPM, 2.0)


def test_one_parameter_at_the_end_of_what_a_fit_allows_is_a_move():
    """Three standard deviations, which are no rare sum of squares among eight parameters."""
    for by, moved in ((3.0, True), (2.5, False)):
        heavy = dataclasses.replace(SMOOTH, table_inertia=SMOOTH.table_inertia * np.exp(by * SPREAD))
        said = moved_since(BEFORE, SMOOTH, calibrated(heavy))
        assert said["since"] == moved and said["chance"] > 0.01
        assert ("table_inertia +3.0 %" in said["sentence"]) == moved


@pytest.mark.parametrize(
    ("before", "now", "noisier", "moved"),
    [(1.0, 3.0, 1.0, True), (0.9, 1.3, 1.0, False), (3.0, 3.5, 1.0, False), (3.0, 6.0, 0.5, False)],
)
def test_where_clearly_more_is_left_the_machine_has_moved(before, now, noisier, moved):
    """Half the noise makes twice as many times the noise of what was left before."""
    found = dataclasses.replace(calibrated(SMOOTH), level=now)
    said = moved_since({**BEFORE, "level": before}, SMOOTH, found, noisier)
    assert said["since"] == moved
    assert ("3.0 times the noise remains of the new records, 1.0 before" in said["sentence"]) == moved


@pytest.mark.parametrize(("half", "moved"), [(0.4, True), (4.0, False)])
def test_a_size_that_the_new_records_leave_open_is_no_move(half, moved):
    row = {"effect": "friction.coulomb", "values": {"torque": 5.0}, "interval": [4.6, 5.4]}
    found = Finding("friction.coulomb", "established", {"torque": 7.0}, (7.0 - half, 7.0 + half), "torque")
    said = moved_since({**BEFORE, "findings": [row]}, SMOOTH, calibrated(SMOOTH, found))
    assert said["since"] == moved


def test_noise_that_grows_from_update_to_update_is_compared_with_what_was_taught():
    taught = {"noise": 0.1, "shift": 0.002, "radius": None}
    before = {**ABOUT, "noise": 0.108, "taught": taught}
    assert gone_on(before, {**ABOUT, "noise": 0.109}, STAYED)[1]
    told, kept = gone_on(before, {**ABOUT, "noise": 0.116}, STAYED)
    assert not kept and "the noise differs" in told["moved"]["sentence"]


def test_what_the_networks_were_taught_with_goes_on_with_them(tmp_path):
    before = tmp_path / "before"
    before.mkdir()
    for name in (*NETWORKS, PAPER, "synthesis"):
        (before / f"{name}.safetensors").write_bytes(name.encode())
    made = maker(before=before)
    made.out, made.work = tmp_path / "twin", Workplace(tmp_path / "twin", "these", False)
    keys = dict.fromkeys(("judge", "paper_judge", "weights", "records", "scores", "detection"), 1)
    taught = {"noise": 0.1, "shift": 0.002, "radius": None}
    made._take_over({**keys, "noise": 0.108, "shift": 0.003, "taught": taught})
    assert made.work.read("learned")["taught"] == taught


def updated(
    monkeypatch, tmp_path, rpm: float, level: float = 0.2, found: Calibrated | None = None, **settings: Any
) -> dict[str, Any]:
    """calibration.yaml of an update with records at 1200 rpm and at another speed, without any fit: nothing has
    changed, but the noise, to `level`. The twin before had found a gain of its sensor, which is part of the sensor
    since, and its records at 1200 and 1500 rpm had left ones."""
    row = {"effect": "sensor.gain", "grade": "established", "values": {"error": 0.05}, "interval": [0.04, 0.06],
           "size": "error", "rivals": []}  # fmt: skip
    before = {
        "range": {"motor_speed_rpm": [1000.0, 1500.0], "load_torque": [0.0, 20.0]}, "noise": 0.1, "shift": 0.002,
        "taught": {"noise": 0.1, "shift": 0.002, "radius": None}, "sample_noise": 0.1,
        "cells": dataclasses.asdict(Cells.of(SMOOTH, 500.0, 1500.0 * RPM)),
        "calibration": {**BEFORE, "findings": [row], "scale_spread": 0.02},
    }  # fmt: skip
    points = [OperatingPoint(speed * RPM, 2.0) for speed in (1200.0, rpm)]
    monkeypatch.setattr("twin.make.about_of", lambda folder: before)
    monkeypatch.setattr("twin.make.calibrated", lambda *given, **more: found or calibrated(SMOOTH))
    monkeypatch.setattr("twin.make.turns_of", lambda experiment, healthy: np.zeros((1, 8, 64)))
    monkeypatch.setattr("twin.make.remains_of", lambda *given: left(2.0, level, *points))
    monkeypatch.setattr("twin.make.stored_remains", lambda folder: left(1.0, 0.1, points[0], FAST))
    monkeypatch.setattr("twin.make.Maker._take_over", lambda maker, before: None)
    monkeypatch.setattr("twin.make.Maker._look", lambda maker, *given: None)
    made = maker(before=tmp_path)
    made.settings = Settings(**settings)
    records = [
        SimpleNamespace(
            operating_point=p, signal=SimpleNamespace(sample_rate=500.0, source=str(p)), start_uncertainty=0.002,
            start_compared=False, noise_level=0.2,
        )
        for p in points
    ]  # fmt: skip
    subject: Any = made.bench.subject
    subject.machine, subject.model.experiments, subject.held_out.experiments = SMOOTH, records, []
    made.out, made.work = tmp_path / "twin", Workplace(tmp_path / "twin", "these", False)
    made._calibrate()
    return made.work.read("calibration")


def left(size: float, sigma: float, *points: OperatingPoint) -> Remains:
    """What records leave: one size in all cells, and noise that is σ in the middle of the range, 1250 rpm."""
    at = np.array([(point.motor_speed, point.load_torque) for point in points])
    levels = np.full(len(points), sigma / np.sqrt(1250.0 * RPM))
    return Remains(at, np.full((len(points), 8, 128), size), levels, np.full(65, 128.0**0.5))


def test_what_records_left_at_other_speeds_stays_with_the_networks(monkeypatch, tmp_path):
    """New records at 1200 rpm alone, which leave twice as much as before."""
    told = updated(monkeypatch, tmp_path, 1201.0, level=0.102)
    assert "the networks are kept" in told["moved"]["sentence"]
    kept = stored_remains(tmp_path / "twin")
    assert kept.fixed[:, 0, 0].tolist() == [2.0, 2.0, 1.0] and kept.points[2].tolist() == [FAST.motor_speed, 2.0]
    assert told["noise"] == pytest.approx(0.102, rel=0.02)
    told = updated(monkeypatch, tmp_path / "other", 1201.0, level=0.2)
    assert "all is learned anew" in told["moved"]["sentence"]
    assert stored_remains(tmp_path / "other" / "twin").fixed[:, 0, 0].tolist() == [2.0, 2.0]


def test_turns_are_simulated_from_what_repeats(monkeypatch, tmp_path):
    paths = ("effects.sensor.offset_drift.rate", "effects.sensor.gain.error", "sensor.gain")
    found = dataclasses.replace(calibrated(SMOOTH), paths=paths, units=("",) * 3, draws=np.array([[0.02, 0.06, 1.0]]))
    updated(monkeypatch, tmp_path, 1400.0, found=found)
    drawn = draws_in(tmp_path / "twin" / "posterior.parquet")
    assert {path: column.tolist() for path, column in drawn.items()} == {"sensor.gain": [pytest.approx(1.06)]}


def test_cells_are_those_of_the_fastest_speed_that_is_asked_for(monkeypatch, tmp_path):
    told = updated(monkeypatch, tmp_path, 1400.0, motor_speed_rpm=[1200.0, 5000.0])
    assert told["cells"]["count"] == 64 and told["range"]["motor_speed_rpm"] == [1200.0, 5000.0]


@pytest.mark.parametrize(("rpm", "fastest"), [(1400.0, 1500.0), (1600.0, 1600.0)])
def test_an_update_that_learns_anew_is_for_the_old_range_too(monkeypatch, tmp_path, rpm, fastest):
    told = updated(monkeypatch, tmp_path, rpm)
    assert "all is learned anew" in told["moved"]["sentence"]
    assert told["range"] == {"motor_speed_rpm": [1000.0, pytest.approx(fastest)], "load_torque": [0.0, 20.0]}


def test_what_is_kept_of_the_sensor_is_no_change(monkeypatch, tmp_path):
    told = updated(monkeypatch, tmp_path, 1400.0)
    assert [row["effect"] for row in told["findings"]] == ["sensor.gain"]
    assert "sensor.gain.error" not in told["moved"]["changes"]


def test_records_to_diagnose_have_the_noise_that_the_calibrated_machine_shows(monkeypatch, tmp_path):
    """0.2 rad/s² by the records alone, half of it by what the machine leaves of them."""
    quieter = dataclasses.replace(calibrated(SMOOTH), noise_share=0.5)
    assert updated(monkeypatch, tmp_path, 1201.0, level=0.102, found=quieter)["sample_noise"] == 0.1
