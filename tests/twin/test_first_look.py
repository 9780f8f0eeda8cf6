"""What is said of the healthy files before anything is simulated."""

from __future__ import annotations

import dataclasses
import logging
from types import SimpleNamespace

import numpy as np
import pytest

from discrepancy.indexer import Experiment
from indexer_env import OperatingPoint, Sensor, load_machine, make_effect
from tests.twin.builders import CELLS, NOISE, record, view
from twin import first_look, make
from twin.check import PREDICTED, level_of
from twin.learn import View
from twin.make import Maker
from twin.remains import remains_of
from twin.settings import Settings
from twin.turns import Healthy, in_phase

MACHINE = load_machine("reference")
"""With play: without any a load moves the table not otherwise."""

POINTS = {
    "slow.csv": (1200.0, 3.0),
    "fast.csv": (1500.0, 4.0),
    "loaded.csv": (1300.0, 25.0),
    "held.csv": (1400.0, 12.0),
}
CRACKED = dataclasses.replace(MACHINE, effects=(make_effect("roller.crack", stiffness_loss=0.3),))


def files(
    machines: dict | None = None, stated: dict | None = None, noisier: dict | None = None
) -> list[Experiment]:  # fmt: skip
    """A record of 2.1 turns of each file, white noise of `NOISE` a cell; seed 3. Some of another machine, some taken
    under a load that is stated otherwise, some so many times as noisy."""
    random, found = np.random.default_rng(3), []
    for file, (rpm, load) in POINTS.items():
        signal, told = record((machines or {}).get(file, MACHINE), rpm, load, turns=2.1)
        noise = 3.0 * NOISE * (noisier or {}).get(file, 1.0)
        values = signal.values + noise * random.standard_normal(len(signal.values))
        point = OperatingPoint(told.motor_speed, (stated or {}).get(file, load), told.start_angle or 0.0)
        found.append(Experiment(dataclasses.replace(signal, values=values, source=file), point, noise=3.0 * NOISE))
    return found


def healthy() -> Healthy:
    return Healthy(MACHINE, Sensor(), CELLS)


def seen_of(fitted: list[Experiment], machine: Healthy) -> View:
    parts = [part for theirs in first_look.by_file(fitted, machine).values() for part in theirs]
    remains = remains_of([turns for _, turns in parts], [point for point, _ in parts], 0.002, machine)
    return dataclasses.replace(view(), remains=remains)


def levels(every: list[Experiment]) -> dict[str, float]:
    machine, fitted = healthy(), every[:3]
    of_fitted, of_all = (first_look.by_file(those, machine) for those in (fitted, every))
    return first_look.levels(of_fitted, of_all, machine, seen_of(fitted, machine))


def test_files_of_one_machine_are_told_without_a_warning():
    found = levels(files())
    assert list(found) == list(POINTS) and all(0.8 < level < 1.3 for level in found.values())
    line, warning = first_look.sentences(found)
    assert line.startswith("left of each file, in times the noise: slow.csv 1.") and warning == ""


@pytest.mark.parametrize("odd", ["fast.csv", "held.csv"])
def test_the_file_of_a_faulty_machine_is_named(odd):
    """Fitted or held out."""
    found = levels(files({odd: CRACKED}))
    assert max(found, key=found.__getitem__) == odd
    _, warning = first_look.sentences(found)
    assert warning.startswith(f"{odd} differs from its prediction by {found[odd]:.1f} times the noise, more than 2:")


def test_a_file_has_no_part_in_what_is_expected_of_it():
    """Three times the noise of the others would be less over a noise that counts it in."""
    found = levels(files(noisier={"fast.csv": 3.0}))
    assert found["fast.csv"] == pytest.approx(3.0, rel=0.1) and "fast.csv" in first_look.sentences(found)[1]


def test_the_warning_begins_where_the_check_refuses():
    assert not first_look.sentences({"a.csv": PREDICTED})[1]
    assert first_look.sentences({"a.csv": 1.01 * PREDICTED})[1]


@pytest.mark.parametrize("begun", [0, 1, 5])
def test_a_subharmonic_may_begin_at_any_station(begun: int):
    """Of a motion whose period is two cam turns every second station is unlike, from the first one or the second; a
    crack at one station is none of that."""
    cells = np.arange(64)
    common, own = np.sin(0.1 * cells), 0.3 * np.cos(0.4 * cells)
    reference = common + np.where(np.arange(8) % 2, 1.0, -1.0)[:, None] * own
    turn = common + np.roll(reference - common, begun, axis=0)
    assert in_phase(reference, turn) == pytest.approx(turn)
    cracked = turn + np.where(np.arange(8) == 3, 1.0, 0.0)[:, None] * own
    assert np.abs(cracked - in_phase(reference, cracked)).max() == pytest.approx(0.3, rel=0.15)


def test_a_record_in_another_phase_of_its_rattling_is_as_predicted(monkeypatch):
    """Its stations alternate the other way about than those of the simulated turn."""
    point = OperatingPoint(150.0, 3.0)
    common = healthy().turn(point)
    own = 10.0 * NOISE * np.where(np.arange(len(common)) % 2, 1.0, -1.0)[:, None] * np.sin(np.arange(common.shape[1]))
    asked = common - own, common + own, point, seen_of(files()[:3], healthy())
    assert level_of(*asked) < 1.3
    monkeypatch.setattr("twin.check.in_phase", lambda reference, turn: reference)
    assert level_of(*asked) > PREDICTED


def test_other_files_beyond_the_limit_are_named_too():
    _, warning = first_look.sentences({"a.csv": 2.1, "b.csv": 0.9, "c.csv": 3.5})
    assert warning.startswith("c.csv differs from its prediction by 3.5 times the noise (a.csv by 2.1), more than 2:")


def test_one_file_alone_has_what_it_left_itself():
    machine, alone = healthy(), files()[:1]
    files_of = first_look.by_file(alone, machine)
    assert first_look.levels(files_of, files_of, machine, seen_of(alone, machine))["slow.csv"] < 1.3


def wrong_load(every: list[Experiment], machine: Healthy | None = None) -> tuple[str, ...]:
    machine = machine or healthy()
    return first_look.wrong_load(first_look.by_file(every, machine), machine, seen_of(every[:3], machine), 0.1)


@pytest.mark.parametrize("factor", [1.0, 1.5])
def test_a_load_that_is_stated_wrong_is_told_with_both_values_and_its_file(factor):
    """25 N m, stated as 5; whatever factor of all loads the calibration has made of it."""
    (said,) = wrong_load(files(stated={"loaded.csv": 5.0}), dataclasses.replace(healthy(), load_factor=factor))
    fitted = float(said.removeprefix("loaded.csv: the load is ").partition(" N m by the record, 5 N m stated")[0])
    assert fitted == pytest.approx(25.0, rel=0.05) and "known to ±0.5 N m; correct load_torque" in said


def test_a_load_within_what_is_known_of_it_or_of_another_machine_is_not_told():
    assert wrong_load(files()) == ()
    assert wrong_load(files(stated={"loaded.csv": 21.0})) == (), "1.9 standard deviations"
    assert wrong_load(files({"fast.csv": CRACKED})) == (), "another load explains a crack in part"


def test_of_several_loads_the_farthest_is_told():
    (said,) = wrong_load(files(stated={"loaded.csv": 5.0, "held.csv": 8.0}))
    assert said.startswith("loaded.csv")


def test_the_calibration_says_and_notes_it(tmp_path, monkeypatch, caplog):
    """The stage with a fit that has found nothing: what it writes and what it says at once."""
    every = files(stated={"loaded.csv": 5.0})
    model, held_out = SimpleNamespace(experiments=every[:3], known=()), SimpleNamespace(experiments=every[3:])
    subject = SimpleNamespace(machine=MACHINE, model=model, held_out=held_out)
    written = {}
    maker = Maker.__new__(Maker)
    maker.settings, maker.before, maker.out = Settings(), None, tmp_path
    maker.bench = make.Bench(subject)  # type: ignore[arg-type]
    maker.work = SimpleNamespace(  # type: ignore[assignment]
        has=lambda names: False, write=written.__setitem__, forget=lambda *names: None
    )
    sound = SimpleNamespace(
        machine=MACHINE, sensor=healthy().sensor, paths=(), draws=np.zeros((1, 0)), load_factor=1.0, noise_share=1.0
    )
    monkeypatch.setattr(make, "calibrated", lambda *given, **more: sound)
    monkeypatch.setattr(make, "calibration_card", lambda found: {"notes": ["a note"]})
    with caplog.at_level(logging.INFO, logger="twin.make"):
        maker._calibrate()
    assert written["calibration"]["notes"][0] == "a note"
    (note,) = written["calibration"]["notes"][1:]
    assert note.startswith("loaded.csv: the load is 24.7 N m by the record, 5 N m stated")
    told = [one.getMessage() for one in caplog.records]
    assert told[0].startswith("left of each file, in times the noise: slow.csv") and note in told
    assert told[-1].startswith("loaded.csv differs from its prediction by")
