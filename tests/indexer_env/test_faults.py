"""Faults of the bench: from severities to the effects they stand for."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

from indexer_env.coefficients import coefficients
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError
from indexer_env.faults import LOOSE_HOUSING_HZ, Faults, most_backlash
from indexer_env.machine import Joint
from indexer_env.modes import natural_frequencies
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.reference import simulate_reference
from indexer_env.simulate import Run, simulate

POINT = OperatingPoint()
SHORT = Run(samples=150, warmup_turns=0)
SEVERITIES = {
    "roller_crack": 0.4, "screw_looseness": 0.6, "backlash": math.radians(5.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SEVERITIES)
@pytest.mark.parametrize("value", [True, "0.1", None, math.nan, -0.1, 2.1])
def test_severities_are_checked(name, value):
    with pytest.raises(ParameterError, match=rf"^Faults\.{name} must be a finite number >= 0 and <=? \d"):
        Faults(**{name: value})


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"roller_crack": 1.0}, "Faults.roller_crack must be a finite number >= 0 and < 1, got 1.0."),
        ({"backlash": 3.0}, "Faults.backlash must be a finite number >= 0 and <= 2 rad at the motor shaft, got 3.0."),
        ({"cracked_station": 1.0}, "Faults.cracked_station must be a whole number >= 0, got 1.0."),
        ({"cracked_station": True}, "Faults.cracked_station must be a whole number >= 0, got True."),
        ({"cracked_station": -1}, "Faults.cracked_station must be a whole number >= 0, got -1."),
    ],
)
def test_faults_say_what_they_refuse(values, said):
    with pytest.raises(ParameterError) as caught:
        Faults(**values)
    assert str(caught.value) == said


def test_faults_are_frozen_and_picklable():
    faults = Faults(roller_crack=0.2)
    with pytest.raises(dataclasses.FrozenInstanceError):
        faults.roller_crack = 0.3
    assert pickle.loads(pickle.dumps(faults)) == faults


@pytest.mark.parametrize("faults", [Faults(), Faults(cracked_station=3)])
@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
def test_severity_zero_is_the_healthy_machine_bit_for_bit(reference, faults, model):
    healthy = dataclasses.replace(reference, model=model)
    faulty = faults.applied_to(healthy)
    assert faulty == healthy
    ours, theirs = coefficients(faulty, POINT), coefficients(healthy, POINT)
    assert ours.row.tobytes() == theirs.row.tobytes()
    assert (ours.model, ours.features) == (theirs.model, theirs.features)
    run = dataclasses.replace(SHORT, step=0.1e-3)
    assert (
        simulate(faulty, POINT, run).table_acceleration.tobytes()
        == simulate(healthy, POINT, run).table_acceleration.tobytes()
    )


@pytest.mark.parametrize("name", SEVERITIES)
def test_each_fault_changes_the_record(reference, name):
    machine = Faults(**{name: SEVERITIES[name]}).applied_to(reference)
    healthy, faulty = simulate(reference, POINT, SHORT), simulate(machine, POINT, SHORT)
    assert np.abs(healthy.table_acceleration - faulty.table_acceleration).max() > 0.1


def test_roller_crack_is_the_stiffness_ratio_of_joint_2(reference):
    machine = Faults(roller_crack=0.4).applied_to(reference)
    joint = dataclasses.replace(reference.output_joint, stiffness_ratio=0.6)
    paper = dataclasses.replace(reference, output_joint=joint)
    assert coefficients(machine, POINT).row.tobytes() == coefficients(paper, POINT).row.tobytes()


def test_a_cracked_station_is_the_single_crack(reference, visible):
    machine = Faults(roller_crack=0.4, cracked_station=2).applied_to(reference)
    assert machine.effects == (visible("roller.crack_single", stiffness_loss=0.4, station=2),)
    with pytest.raises(ParameterError, match=r"^roller\.crack_single\.station must be below the machine's 8 "):
        coefficients(Faults(roller_crack=0.4, cracked_station=8).applied_to(reference), POINT)


def test_backlash_is_read_at_the_motor_shaft(reference):
    healthy, faulty = reference, Faults(backlash=math.radians(20.0)).applied_to(reference)
    added = 2.0 * (coefficients(faulty, POINT)["edge_1"] - coefficients(healthy, POINT)["edge_1"])
    assert added == pytest.approx(math.radians(20.0) / 25.625, rel=1e-12)
    assert added == pytest.approx(13.6e-3, rel=2e-3)  # docs/explanation/physics.md, section Faults


def test_fully_loose_screws_put_the_housing_at_its_frequency(reference):
    """In the dwell, with an output joint far too soft to hold the housing by the table."""
    soft = dataclasses.replace(reference.output_joint, stiffness=1.0)
    machine = Faults(screw_looseness=1.0).applied_to(dataclasses.replace(reference, output_joint=soft))
    assert natural_frequencies(machine, 1.5 * math.pi).frequency_hz.max() > LOOSE_HOUSING_HZ
    frequencies = natural_frequencies(machine, 1.5 * math.pi).frequency_hz[0]
    assert np.abs(frequencies - LOOSE_HOUSING_HZ).min() < 1e-3


def test_half_as_loose_is_twice_as_stiff(reference):
    stiffness = [
        coefficients(Faults(screw_looseness=share).applied_to(reference), POINT)["stiffness_3"] for share in (0.5, 1.0)
    ]
    assert stiffness[0] == pytest.approx(2.0 * stiffness[1], rel=1e-14)


def test_faults_add_up(reference):
    machine = Faults(**SEVERITIES).applied_to(reference)
    assert {effect.name for effect in machine.effects} == {"roller.crack", "base.looseness", "input.backlash"}
    assert reference.effects == ()


def test_faults_come_on_top_of_what_the_machine_has():
    machine = load_machine("reference")
    worn = Faults(backlash=0.1, roller_crack=0.5, screw_looseness=0.5).applied_to(machine)
    worse = Faults(backlash=0.1, roller_crack=0.5, screw_looseness=0.5).applied_to(worn)
    first, second = ({effect.name: effect for effect in one.effects} for one in (worn, worse))
    assert second["input.backlash"].backlash == pytest.approx(2.0 * first["input.backlash"].backlash)
    assert second["roller.crack"].stiffness_loss == pytest.approx(0.75)
    assert second["base.looseness"].compliance == pytest.approx(2.0 * first["base.looseness"].compliance)


def test_a_second_single_crack_elsewhere_is_refused():
    machine = Faults(roller_crack=0.3, cracked_station=2).applied_to(load_machine("reference"))
    with pytest.raises(ParameterError, match=r"^Faults\.cracked_station must be 2, .* got 5\.$"):
        Faults(roller_crack=0.3, cracked_station=5).applied_to(machine)


def test_looseness_comes_on_top_of_the_base_a_machine_stands_on(reference):
    on_base = dataclasses.replace(reference, model="B_on_base", base_joint=Joint(2e5, 400.0, 0.002))
    healthy = coefficients(on_base, POINT)
    loose = [coefficients(Faults(screw_looseness=s).applied_to(on_base), POINT) for s in (1e-9, 0.2, 1.0)]
    assert loose[0]["stiffness_3"] == pytest.approx(healthy["stiffness_3"], rel=1e-6)
    assert loose[0]["damping_3"] == pytest.approx(healthy["damping_3"], rel=1e-6)
    assert loose[0]["stiffness_3"] > loose[1]["stiffness_3"] > loose[2]["stiffness_3"]
    assert all(one["edge_3"] == healthy["edge_3"] > 0.0 for one in loose)


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_loose_screws_lie_in_series_with_the_base_a_machine_stands_on(reference, ratio):
    """Compliances, plays and r/k² add; a looseness of almost nothing is the machine as it is, which it stiffened."""
    on_base = dataclasses.replace(reference, model="B_on_base", base_joint=Joint(2e5, 400.0, 0.002, ratio))
    nothing = coefficients(on_base.with_effects(make_effect("base.looseness", compliance=1e-15)), POINT)
    np.testing.assert_allclose(nothing.row, coefficients(on_base, POINT).row, rtol=1e-6)
    loose = coefficients(on_base.with_effects(make_effect("base.looseness", compliance=1e-5, backlash=1e-3)), POINT)
    inertia = on_base.follower_inertia + on_base.housing_inertia
    assert 1.0 / loose["stiffness_3"] == pytest.approx(1.0 / 2e5 + 1e-5)
    assert 1.0 / (loose["ratio_3"] * loose["stiffness_3"]) == pytest.approx(1.0 / (ratio * 2e5) + 1e-5)
    assert loose["edge_3"] == pytest.approx(0.5 * (0.002 + 1e-3))
    own = 2.0 * 0.05 * math.sqrt(1e5 * inertia) / 1e5**2
    assert loose["damping_3"] / loose["stiffness_3"] ** 2 == pytest.approx(400.0 / 2e5**2 + own)


def test_loose_screws_on_a_base_move_as_the_references(reference):
    base = Joint(2e6, 400.0, 1e-4, 0.6)
    on_base = dataclasses.replace(reference, model="B_on_base", base_joint=base)
    machine = on_base.with_effects(make_effect("base.looseness", compliance=4e-7, damping_ratio=0.1, backlash=1e-4))
    expected = simulate_reference(machine, POINT, samples=200).table_acceleration
    found = simulate(machine, POINT, Run(samples=200, warmup_turns=0)).table_acceleration
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()


def test_more_backlash_than_the_input_joint_can_have_is_refused_by_its_own_name(reference):
    """At a reduction of 5, 0.2 rad at the cam are 1 rad at the motor."""
    quick = dataclasses.replace(reference, reduction_ratio=5.0, name="quick")
    with pytest.raises(
        ParameterError, match=r"^Faults\.backlash must be <= 1 rad at the motor shaft of quick, .* got 1\.5"
    ):
        Faults(backlash=1.5).applied_to(quick)
    worn = quick.with_effects(make_effect("input.backlash", backlash=0.15))
    with pytest.raises(ParameterError, match=r"^Faults\.backlash must be <= 0\.25 rad at the motor shaft of quick"):
        Faults(backlash=0.3).applied_to(worn)
    for machine in (quick, worn):
        full = Faults(backlash=most_backlash(machine)).applied_to(machine)
        assert coefficients(full, POINT)["edge_1"] == pytest.approx(0.5 * (reference.input_joint.backlash + 0.2))
