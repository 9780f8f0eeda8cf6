"""The joint law of what healthy records leave open, and whether a machine has moved."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from datagen.campaigns.own import LOAD_FACTOR
from discrepancy.grades import ESTABLISHED, STANDS_IN
from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from discrepancy.records.conditions import Conditions
from discrepancy.records.experiments import experiments
from discrepancy.records.reading import Record
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env import EFFECTS, Joint, OperatingPoint, Run, Sensor, Signal, load_machine, make_effect, simulate
from indexer_env.effects import SensorEffect
from twin.__main__ import with_its_effects
from twin.bench import Bench
from twin.calibrate import Calibrated, Finding, _in_draws
from twin.moved import as_before, gone_on, moved_since
from twin.posterior import _bracket, _covariance, rescaled, simulated
from twin.turns import PASSING, quiet

SMOOTH = load_machine("smooth")


def test_the_common_scale_leaves_the_motion_as_it_is():
    names = ["table_inertia", "cam_inertia", "follower_inertia"]
    joints = [f"{j}.{q}" for j in ("input_joint", "output_joint") for q in ("stiffness", "damping")]
    units = ["kg m²"] * 3 + ["N m/rad", "N m s/rad"] * 2 + ["-"]
    before = [np.array([read(SMOOTH, name)]) for name in [*names, *joints]] + [np.ones(1)]
    after = rescaled([*names, *joints, LOAD_FACTOR], units, before, np.array([1.07]))
    values = {name: float(column[0]) for name, column in zip([*names, *joints], after, strict=False)}
    heavy, factor = changed(SMOOTH, values), float(after[-1][0])
    run = Run(500.0, 2000)
    one = simulate(SMOOTH, OperatingPoint(load_torque=10.0), run).table_acceleration
    other = simulate(heavy, OperatingPoint(load_torque=10.0 * factor), run).table_acceleration
    np.testing.assert_allclose(other, one, atol=1e-6 * np.abs(one).max())
    unscaled = simulate(heavy, OperatingPoint(load_torque=10.0), run).table_acceleration
    assert np.abs(unscaled - one).max() > 1e-3


def test_a_covariance_is_nowhere_narrower_than_curvature_and_misfit_leave_it():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((4, 4))
    information, prior = root @ root.T + np.eye(4), np.eye(4)
    quiet = _covariance(information, prior, np.zeros((12, 4)), 1.0)
    assert np.linalg.eigvalsh(quiet - np.linalg.inv(information)).min() > -1e-9
    wide = _covariance(information, prior, 30.0 * rng.standard_normal((12, 4)), 1.0)
    assert np.trace(wide) > 10.0 * np.trace(quiet)
    assert np.trace(_covariance(information, prior, np.zeros((12, 4)), 4.0)) == pytest.approx(
        4.0 * np.trace(quiet), rel=0.6
    )


def calibrated(machine, *findings: Finding) -> Calibrated:
    return Calibrated(machine, Sensor(), 1.0, (), (), np.zeros((1, 0)), findings, "none", "", 1.0, 1.0, 0.03, {}, ())


BEFORE = {"spread": dict.fromkeys(UNCERTAINTY, 0.01), "findings": [], "level": 1.0}


def test_a_machine_that_stayed_has_not_moved_and_one_that_changed_has():
    machine = load_machine("reference")
    assert not moved_since(BEFORE, machine, calibrated(machine))["since"]
    near = dataclasses.replace(machine, table_inertia=1.005 * machine.table_inertia)
    assert not moved_since(BEFORE, machine, calibrated(near))["since"]
    joint = machine.output_joint
    soft = dataclasses.replace(machine, output_joint=Joint(0.92 * joint.stiffness, joint.damping))
    moved = moved_since(BEFORE, machine, calibrated(soft))
    assert moved["since"] and "output_joint.stiffness -8.0 %" in moved["sentence"]


def test_an_effect_that_came_in_is_a_move():
    machine = load_machine("reference")
    finding = Finding("friction.coulomb", "established", {"torque": 5.0}, (4.0, 6.0), "torque")
    moved = moved_since(BEFORE, machine, calibrated(machine, finding))
    assert moved["since"] and "friction.coulomb came in" in moved["sentence"]
    stands_in = dataclasses.replace(finding, grade="stands in")
    assert not moved_since(BEFORE, machine, calibrated(machine, stands_in))["since"], "no name"


def test_an_effect_that_grew_is_a_move():
    machine = load_machine("reference")
    row = {"effect": "friction.coulomb", "grade": "family", "values": {"torque": 5.0}, "interval": [4.6, 5.4],
           "size": "torque", "rivals": ["friction.stribeck"]}  # fmt: skip
    known = {**BEFORE, "findings": [row]}

    def now(torque: float) -> Calibrated:
        found = Finding("friction.coulomb", "established", {"torque": torque}, (torque - 0.4, torque + 0.4), "torque")
        return calibrated(machine, found)

    assert not moved_since(known, machine, now(5.1))["since"]
    moved = moved_since(known, machine, now(3.0))
    assert moved["since"] and "friction.coulomb.torque from 5 to 3." in moved["sentence"]
    (kept,) = as_before(now(3.0), known).findings
    assert (kept.grade, kept.rivals, kept.values) == ("family", ("friction.stribeck",), {"torque": 3.0})
    (gone,) = as_before(calibrated(machine), known).findings
    assert gone.values == {"torque": 5.0}


def test_what_the_draws_leave_open_has_no_name() -> None:
    """A gain error of 1.8 % that is established, where the chain's gain is known to 2 % alone: seed 5."""
    found = Finding("sensor.gain", ESTABLISHED, {"error": 0.018}, (0.01, 0.026), "error")
    rng = np.random.default_rng(5)
    for spread, grade in ((0.02, STANDS_IN), (0.003, ESTABLISHED)):
        drawn = {"effects.sensor.gain.error": 0.018 + spread * rng.standard_normal(500)}
        told = _in_draws(found, drawn)
        assert told.grade == grade and told.interval != found.interval
        assert (told.interval[0] < 0.0) == (grade == STANDS_IN)


ABOUT = {
    "cells": {"stations": 8, "count": 64, "rate": 500.0}, "noise": 0.1, "shift": 0.002,
    "radius": None, "range": {"motor_speed_rpm": [1200.04, 1500.0], "load_torque": [2.0, 20.0]},
    "taught": {"noise": 0.1, "shift": 0.002, "radius": None},
}  # fmt: skip
STAYED = {"since": False, "sentence": "The machine has not moved since."}


def test_networks_are_kept_where_what_they_were_taught_on_holds_for_the_new_records():
    """Speeds as measured are never the same twice."""
    near = {**ABOUT, "range": {"motor_speed_rpm": [1200.01, 1499.9], "load_torque": [2.0, 20.0]}, "noise": 0.105}
    told, kept = gone_on(ABOUT, near, STAYED)
    assert kept and told["range"] == ABOUT["range"] and told["noise"] == 0.105
    assert told["moved"]["sentence"] == "The machine has not moved since; the networks are kept."


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"noise": 0.05}, "the noise differs"),
        ({"shift": 0.004, "noise": 0.2}, "the noise and the accuracy of the cam angle differ,"),
        ({"range": {"motor_speed_rpm": [1000.0, 1500.0], "load_torque": [2.0, 20.0]}}, "the range of speeds and loads"),
        ({"cells": {**ABOUT["cells"], "rate": 1000.0}}, "the sampling rate differs"),
        ({"radius": 0.2}, "the sensor's distance from the axis differs"),
    ],
)
def test_networks_are_not_kept_for_records_of_another_kind(change, words):
    told, kept = gone_on(ABOUT, {**ABOUT, **change}, STAYED)
    assert not kept and words in told["moved"]["sentence"] and "all is learned anew" in told["moved"]["sentence"]
    moved = {"since": True, "sentence": "The machine has moved since: x."}
    assert gone_on(ABOUT, ABOUT, moved) == ({**ABOUT, "moved": moved}, False)


def test_an_effect_of_the_drawing_that_may_grow_is_fitted_about_what_the_drawing_says():
    """Friction may grow, so it is free; a profile error is no fault of the table and stays as it is."""
    bump = make_effect("cam.profile_error", height=1e-4)
    machine = SMOOTH.with_effects(make_effect("friction.coulomb", torque=20.0), bump)
    point = OperatingPoint(150.0, 2.0)
    values = simulate(machine, point, Run(500.0, 9000)).table_acceleration
    record = Record(
        "run.csv", Signal(values, 500.0, unit="rad/s^2"), Conditions(150.0, 2.0, start_angle=0.0, noise=0.1)
    )
    bench = with_its_effects(Bench(IndexerSubject(machine, Sensor(), experiments([record], machine, Sensor()))))
    assert bench.subject.machine.effects == (bump,)
    assert "the machine has cam.profile_error already: it is taken as it is" in bench.subject.notes[-1]
    (known,) = bench.subject.model.known
    assert known.name == "friction.coulomb"
    torque = next(p for p in known.parameters if p.name.endswith("torque"))
    assert torque.known and torque.nominal == 20.0 and torque.scale == pytest.approx(4.0)
    plain = Bench(IndexerSubject(SMOOTH, Sensor(), experiments([record], SMOOTH, Sensor())))
    assert with_its_effects(plain) is plain


def test_what_does_not_repeat_has_no_part_in_what_is_simulated():
    rng = np.random.default_rng(0)
    error, gain = 0.06 + 0.005 * rng.standard_normal(50), 1.02 + 0.01 * rng.standard_normal(50)
    rows = {
        "effects.sensor.offset_drift.rate": error, "effects.sensor.mains_hum.amplitude": error,
        "effects.sensor.mains_hum.frequency": 50.0 + error, "effects.sensor.lowpass.time_constant": error,
        "sensor.gain": gain,
    }  # fmt: skip
    assert set(simulated(rows)) == {"effects.sensor.lowpass.time_constant", "sensor.gain"}
    found = simulated({**rows, "effects.sensor.gain.error": error})
    assert "effects.sensor.gain.error" not in found
    np.testing.assert_allclose(found["sensor.gain"], gain * (1.0 + error))


def test_what_does_not_repeat_is_what_a_quiet_sensor_lacks():
    grown = {
        name: effect(**{field.name: 0.01 for field in dataclasses.fields(effect)}).extend_sensor(Sensor())
        for name, effect in EFFECTS.items()
        if issubclass(effect, SensorEffect)
    }
    assert {name for name, sensor in grown.items() if quiet(sensor) != sensor} == set(PASSING)


def test_a_loose_sensor_is_learned_on_top_of_the_bracket_that_the_sensor_stands_on():
    columns = {path: column for path, _, column in _bracket(Sensor(bracket_hz=100.0), [], 3)}
    name = "effects.sensor.bracket_resonance"
    own = 1.0 / (2.0 * np.pi * 100.0) ** 2
    np.testing.assert_allclose(columns[f"{name}.inverse_square"], np.full(3, own))
    assert set(columns) == {f"{name}.inverse_square", f"{name}.damping"}
    assert not _bracket(Sensor(), [], 3) and not _bracket(Sensor(bracket_hz=100.0), list(columns), 3)
