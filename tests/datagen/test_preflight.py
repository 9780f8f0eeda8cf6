"""What is refused before anything is simulated, and that what is called idle is idle, bit for bit."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from datagen.campaign import Base
from datagen.campaigns import make_campaign
from datagen.changes import value_at, with_changes
from datagen.preflight import check_draws
from datagen.quantities import JOINTS
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError
from indexer_env.faults import Faults
from indexer_env.machine import NOT_IN_MODEL, Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.sensors import Sensor
from indexer_env.simulate import Run, simulate

AROUND = {"around": 0.1}
RUN = Run(samples=600, warmup_turns=0)


def check(draws: dict[str, Any], base: Base | None = None, count: int = 8, **settings: Any) -> None:
    campaign = make_campaign({"name": "random", "machines": 100, "draws": draws, **settings})
    check_draws(campaign, base or Base(load_machine("reference"), OperatingPoint()), 0, count)


@pytest.mark.parametrize(
    ("draws", "said"),
    [
        (
            {"machine": {"base_joint": {"stiffness": AROUND}}},
            "campaign.machine.base_joint.stiffness must be a quantity",
        ),
        ({"machine": {"housing_inertia": AROUND}}, "leave it out, or switch on what uses it."),
        ({"machine": {"motor_inertia": AROUND}}, "a quantity that the campaign's machines and sensors use"),
        ({"machine": {"name": {"choice": ["a", "b"]}}}, "a quantity that the campaign's machines and sensors use"),
        ({"sensor": {"lowpass_order": {"choice": [2, 4]}}}, "a quantity that the campaign's machines and sensors use"),
        ({"sensor": {"hum_hz": AROUND}}, "a quantity that the campaign's machines and sensors use"),
        (
            {"faults": {"cracked_station": {"choice": [0, 1]}}},
            "a quantity that the campaign's machines and sensors use",
        ),
        (
            {"sensor": {"offset": AROUND}},
            "must be other than 0 where its law is around a nominal value, got {around: 0.1}",
        ),
        ({"faults": {"backlash": AROUND}}, "draw it by {uniform: [low, high]} or another law."),
        ({"sensor": {"radius": {"uniform": [0.3, 0.4]}}}, "drawn only where sensor.radius is a number"),
        ({"machine": {"model": AROUND}}, "as there is no number to be around, got 'B'"),
        ({"sensor": {"lowpass_hz": AROUND}}, "as there is no number to be around, got None"),
        ({"effects": {"friction.coulomb": {"torque": AROUND}}}, "as there is no number to be around, got None"),
        (
            {"effects": {"friction.coulomb": {"smoothing": 0.01}}},
            "friction.coulomb.torque must be given, by a value or",
        ),
        ({"effects": {"friction.coulomb": {"probability": 0.5}}}, "must be a mapping of its parameters to values or"),
        (
            {"effects": {"friction.coulomb": {"torque": 1, "probability": 2}}},
            "probability must be a finite number >= 0",
        ),
        ({"effects": {"friction.colomb": {"torque": 1}}}, "did you mean 'friction.coulomb'"),
        ({"effects": {"friction.coulomb": {"torqe": 1}}}, "did you mean 'torque'"),
        ({"sensor": {"sample_rate": {"choice": [500, 1000]}}}, "has no parameter 'sample_rate'"),
    ],
)
def test_a_law_that_is_a_mistake_is_one_sentence(draws, said):
    with pytest.raises(ParameterError) as caught:
        check(draws)
    assert said in str(caught.value) and str(caught.value).endswith(".") and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "draws",
    [
        {"machine": {"base_joint": {"stiffness": AROUND}, "model": {"choice": ["B", "B_on_base"]}}},
        {"machine": {"housing_inertia": AROUND}, "faults": {"screws": "loose"}},
        {"machine": {"base_joint": {"stiffness": AROUND}, "model": "B_on_base"}, "faults": {"screws": "loose"}},
        {
            "machine": {"base_joint": {"stiffness": AROUND}, "model": "B_on_base"},
            "effects": {"base.looseness": {"compliance": 1e-6}},
        },
        {"machine": {"motor_inertia": AROUND}, "effects": {"drive.slip": {"probability": 0.01, "compliance": 0.1}}},
        {"sensor": {"hum_hz": AROUND, "hum_amplitude": {"uniform": [0.1, 0.2]}}},
        {"faults": {"cracked_station": {"choice": [0, 1]}, "roller": {"choice": ["intact", "cracked"]}}},
    ],
)
def test_a_law_that_some_item_shows_is_none(draws):
    check(draws)


def test_items_of_two_units_are_refused():
    campaign = make_campaign({"name": "grid", "axes": {"sensor": {"radius": [None, 0.4]}}})
    with pytest.raises(ParameterError, match="radius must be a number in all items or null in all"):
        check_draws(campaign, Base(load_machine("reference"), OperatingPoint()), 0, 2)


RARE = {"friction.coulomb": {"probability": 0.01, "torque": {"uniform": [1, 2]}}}


@pytest.mark.parametrize("seed", range(3))
def test_an_effect_that_is_too_rare_to_be_looked_at_is_none_either(seed):
    """At one machine in a hundred, none of 64 has it in every second seed."""
    campaign = make_campaign({"name": "random", "machines": 100, "draws": {"effects": RARE}})
    check_draws(campaign, Base(load_machine("reference"), OperatingPoint()), seed, 100)


def test_an_effect_that_no_machine_can_have_is_refused():
    with pytest.raises(ParameterError, match="torque must be a quantity that the campaign's machines and sensors use"):
        check({"effects": {"friction.coulomb": {"probability": 0, "torque": {"uniform": [1, 2]}}}})


def test_items_that_would_all_be_the_same_are_refused():
    with pytest.raises(ParameterError, match="must be <= 1 where nothing is drawn"):
        check({})
    check({}, count=1)
    check({}, Base(load_machine("reference"), OperatingPoint(), sensor=Sensor(noise_density=0.1)))
    check({"sensor": {"noise_density": {"uniform": [0.1, 0.2]}}})


@pytest.mark.parametrize(
    ("drift", "said"),
    [
        ({"machine": {"cam_inertia": {"uniform": [0.4, 0.6]}}}, "{around: share}, as the campaign draws it for each"),
        (
            {"effects": {"friction.coulomb": {"torque": 1.0}}},
            "campaign.drift must be free of effects and of sobol laws",
        ),
        ({"machine": {"table_inertia": {"sobol": [4, 6]}}}, "campaign.drift must be free of effects and of sobol laws"),
    ],
)
def test_drift_that_is_none(drift, said):
    with pytest.raises(ParameterError) as caught:
        check({"machine": {"cam_inertia": AROUND}}, drift=drift)
    assert said in str(caught.value)


def test_drift_around_what_was_drawn():
    draws, drift = {"machine": {"cam_inertia": {"uniform": [0.4, 0.6]}}}, {"machine": {"cam_inertia": {"around": 0.01}}}
    campaign = make_campaign({"name": "random", "machines": 9, "repeats": 4, "draws": draws, "drift": drift})
    base = Base(load_machine("reference"), OperatingPoint())
    inertia = np.array([campaign.item(i, base, 0).machine["cam_inertia"] for i in range(36)]).reshape(9, 4)
    assert (np.ptp(inertia, axis=1) < 0.02 * inertia.mean(axis=1)).all() and np.ptp(inertia.mean(axis=1)) > 0.1


def test_sobol_quantities_share_one_sequence():
    law = {"sobol": [0, 1]}
    draws = {
        "machine": {"cam_inertia": {"sobol": [1, 2]}, "follower_inertia": {"sobol": [1, 2]}},
        "faults": {"backlash": law},
    }
    campaign = make_campaign({"name": "random", "machines": 64, "draws": draws})
    base = Base(load_machine("reference"), OperatingPoint())
    items = [campaign.item(index, base, 3) for index in range(64)]
    inertia = np.array([[item.machine["cam_inertia"], item.machine["follower_inertia"]] for item in items]) - 1.0
    # a Sobol' sequence has one point in each of 8 x 8 boxes after 64 points, which chance has not
    assert len({tuple(place) for place in np.floor(8 * inertia).astype(int)}) == 64
    assert sorted(int(64 * item.faults["backlash"]) for item in items) == list(range(64))


# ---------------------------------------------------------------------------------------------- what is idle


def shifted(machine: Machine, path: str) -> Machine:
    value = value_at(machine, path)
    return with_changes(machine, {path: value * 0.9 if value else 0.001})


def machine_of(model: str) -> Machine:
    """A machine in which every parameter that its model has is at work."""
    joint = dataclasses.replace
    machine = load_machine("reference")
    return dataclasses.replace(
        machine,
        model=model,
        base_joint=joint(machine.base_joint, stiffness=1.2e6, damping=150.0, backlash=1e-5, stiffness_ratio=0.9),
        input_joint=joint(machine.input_joint, stiffness_ratio=0.9),
        output_joint=joint(machine.output_joint, stiffness_ratio=0.9),
    )


NUMBERS = [f"{part}_inertia" for part in ("cam", "follower", "table", "housing", "motor")]
NUMBERS += [f"{joint}.{field.name}" for joint in JOINTS for field in dataclasses.fields(Joint)]


@pytest.mark.parametrize("model", NOT_IN_MODEL)
def test_what_a_model_has_not_changes_no_bit_and_the_rest_does(model):
    machine = machine_of(model)
    record = simulate(machine, OperatingPoint(), RUN).table_acceleration
    for path in NUMBERS:
        same = np.array_equal(simulate(shifted(machine, path), OperatingPoint(), RUN).table_acceleration, record)
        assert same == (path.partition(".")[0] in NOT_IN_MODEL[model]), path


@pytest.mark.parametrize("screws", [True, False])
def test_a_loose_base_brings_the_housing_in_and_lies_in_series_with_the_base_joint(screws):
    """Screws that come loose do, and so does an effect of the machine's own; Model B has no base joint."""

    def loosened(machine: Machine) -> Machine:
        own = make_effect("base.looseness", compliance=1e-6)
        return Faults(screw_looseness=1.0).applied_to(machine) if screws else machine.with_effects(own)

    for model in ("B", "B_on_base"):
        machine = machine_of(model)
        record = simulate(loosened(machine), OperatingPoint(), RUN).table_acceleration
        for path in ("housing_inertia", "base_joint.stiffness", "base_joint.backlash", "base_joint.stiffness_ratio"):
            other = simulate(loosened(shifted(machine, path)), OperatingPoint(), RUN).table_acceleration
            assert np.array_equal(other, record) == (path != "housing_inertia" and model == "B"), path


def test_slip_brings_the_motor_in():
    machine = machine_of("B").with_effects(make_effect("drive.slip", compliance=0.1))
    other = shifted(machine, "motor_inertia")
    records = [simulate(each, OperatingPoint(), RUN).table_acceleration for each in (machine, other)]
    assert not np.array_equal(*records)
