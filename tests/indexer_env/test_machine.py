"""The machine, its joints and the operating point refuse what they cannot mean."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest

from indexer_env.coefficients import coefficients
from indexer_env.errors import MotionLawWarning, ParameterError
from indexer_env.machine import Joint, Machine, machine_from_mapping
from indexer_env.motion_law import Cycloidal, TableLaw
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_yaml

NOT_NUMBERS = [True, "1.0", None, math.nan, math.inf, [1.0]]


def refused(build, *arguments, **values) -> str:
    with pytest.raises(ParameterError) as caught:
        build(*arguments, **values)
    text = str(caught.value)
    assert text.endswith(".") and "\n" not in text
    return text


@pytest.fixture
def mapping() -> dict:
    return load_yaml("machine", "reference")


# -------------------------------------------------------------------------------- joints


@pytest.mark.parametrize("name", ["stiffness", "damping", "backlash", "stiffness_ratio"])
@pytest.mark.parametrize("value", [*NOT_NUMBERS, -1.0])
def test_a_joint_refuses_wrong_types_and_negative_values(name, value):
    said = refused(Joint, **{"stiffness": 1.0, "damping": 1.0, name: value})
    assert said.startswith(f"Joint.{name} must be a finite number ") and f"got {value!r}" in said


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("stiffness", 0.0, "> 0 N m/rad"),
        ("backlash", 0.6, ">= 0 and <= 0.5 rad"),
        ("stiffness_ratio", 0.0, "> 0 and <= 1"),
        ("stiffness_ratio", 1.0 + 1e-15, "> 0 and <= 1"),
    ],
)
def test_a_joint_says_its_bounds(name, value, rule):
    assert f"must be a finite number {rule}, got" in refused(Joint, **{"stiffness": 1.0, "damping": 1.0, name: value})


def test_a_joint_may_be_undamped_and_symmetric():
    assert Joint(1.0, 0.0, 0.5, 1.0) == Joint(stiffness=1, damping=0, backlash=0.5)


# -------------------------------------------------------------------------------- machine


@pytest.mark.parametrize(
    "name",
    ["cam_inertia", "follower_inertia", "table_inertia", "housing_inertia", "motor_inertia", "reduction_ratio",
     "motion_share"],
)  # fmt: skip
@pytest.mark.parametrize("value", [*NOT_NUMBERS, 0.0, -1.0])
def test_a_machine_refuses_wrong_types_and_signs(reference, name, value):
    said = refused(dataclasses.replace, reference, **{name: value})
    assert said.startswith(f"Machine.{name} must be a finite number > 0")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("motion_share", 1.01, "Machine.motion_share must be a finite number > 0 and <= 1, got 1.01."),
        ("stations", 8.0, "Machine.stations must be a whole number >= 2 and <= 1000, got 8.0."),
        ("stations", 1, "Machine.stations must be a whole number >= 2 and <= 1000, got 1."),
        ("stations", True, "Machine.stations must be a whole number >= 2 and <= 1000, got True."),
        ("stations", "8", "Machine.stations must be a whole number >= 2 and <= 1000, got '8'."),
        ("model", "C", "Machine.model must be one of A, B, B_on_base, got 'C'."),
        ("model", "B_onbase",
         "Machine.model must be one of A, B, B_on_base, got 'B_onbase'; did you mean 'B_on_base'."),
        ("model", None, "Machine.model must be one of A, B, B_on_base, got None."),
        ("contact_law", "cliped",
         "Machine.contact_law must be one of clipped, kelvin_voigt, damped_play, got 'cliped'; "
         "did you mean 'clipped'."),
        ("motion_law", "cycloidal",
         "Machine.motion_law must be a MotionLaw, got 'cycloidal'; see indexer_env.motion_law."),
        ("input_joint", None, "Machine.input_joint must be a Joint, got None."),
        ("output_joint", {"stiffness": 1.0, "damping": 1.0},
         "Machine.output_joint must be a Joint, got {'stiffness': 1.0, 'damping': 1.0}."),
        ("base_joint", 3.0, "Machine.base_joint must be a Joint, got 3.0."),
    ],
)  # fmt: skip
def test_a_machine_says_what_it_refuses(reference, name, value, said):
    assert refused(dataclasses.replace, reference, **{name: value}) == said


def test_effects_are_machine_effects_each_once(reference, visible):
    coulomb = visible("friction.coulomb")
    said = refused(dataclasses.replace, reference, effects=(coulomb, visible("friction.coulomb", torque=1.0)))
    assert said == (
        "Machine.effects must be different effects, got 'friction.coulomb'; it is there twice; merge the two."
    )
    said = refused(dataclasses.replace, reference, effects=(visible("sensor.gain"),))
    assert said.startswith("Machine.effects must be a tuple of machine effects, got SensorGain(")
    assert said.endswith("sensor effects extend a Sensor.")
    assert refused(dataclasses.replace, reference, effects=("friction.coulomb",)).startswith("Machine.effects must be")


@pytest.mark.parametrize("effects", [None, 5, "friction.coulomb", []])
def test_effects_are_a_tuple(reference, effects):
    assert refused(dataclasses.replace, reference, effects=effects).startswith("Machine.effects must be a tuple")


def test_with_effects_adds_and_replaces(reference, visible):
    first = reference.with_effects(visible("friction.coulomb"), visible("friction.viscous"))
    again = first.with_effects(visible("friction.coulomb", torque=7.0))
    assert reference.effects == ()
    assert {effect.name: effect for effect in again.effects} == {
        "friction.viscous": visible("friction.viscous"),
        "friction.coulomb": visible("friction.coulomb", torque=7.0),
    }


def test_derived_quantities(reference):
    assert reference.reduction == pytest.approx(1.0 / 25.625, rel=1e-15)
    assert reference.advance == pytest.approx(math.pi / 4.0, rel=1e-15)
    assert reference.turn_duration(OperatingPoint()) == pytest.approx(8.2, rel=1e-14)


def test_a_machine_is_frozen_hashable_and_survives_copies(reference, visible):
    machine = reference.with_effects(visible("cam.profile_error"))
    with pytest.raises(dataclasses.FrozenInstanceError):
        machine.stations = 4
    with pytest.raises(dataclasses.FrozenInstanceError):
        machine.input_joint.stiffness = 1.0
    row = coefficients(machine, OperatingPoint()).row
    for twin in (pickle.loads(pickle.dumps(machine)), copy.deepcopy(machine), copy.copy(machine)):
        assert twin == machine and hash(twin) == hash(machine)
        assert coefficients(twin, OperatingPoint()).row.tobytes() == row.tobytes()
    assert dataclasses.replace(machine, stations=4) != machine


# -------------------------------------------------------------------------------- from a mapping


def test_a_mapping_becomes_the_machine(mapping, reference, visible):
    assert machine_from_mapping(mapping) == reference
    mapping["motion_law"] = {"name": "cycloidal"}
    mapping["effects"] = {"friction.coulomb": {"torque": 20.0}, "drive.speed_ripple": {"depth": 0.1, "phase_deg": 90}}
    machine = machine_from_mapping(mapping)
    assert machine.motion_law == Cycloidal()
    assert machine.effects[0] == visible("friction.coulomb")
    assert machine.effects[1].phase == pytest.approx(math.pi / 2.0, rel=1e-15)
    assert machine_from_mapping({**mapping, "effects": None}).effects == ()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stationss": 8}, "Machine has no parameter 'stationss'; did you mean 'stations'."),
        ({"effects": {"friction.coulom": {}}},
         "There is no effect 'friction.coulom'; did you mean 'friction.coulomb'."),
        ({"effects": {"friction.coulomb": {"torqe": 1.0}}},
         "friction.coulomb has no parameter 'torqe'; did you mean 'torque'."),
        ({"effects": {"friction.coulomb": {}}}, "friction.coulomb lacks torque; give a value for each."),
        ({"effects": {"friction.coulomb": None}}, "friction.coulomb lacks torque; give a value for each."),
        ({"effects": {"friction.coulomb": {"torque": -1.0}}},
         "friction.coulomb.torque must be a finite number >= 0 N m, got -1.0."),
        ({"effects": "friction.coulomb"},
         "Machine.effects must be a mapping of effect names to their parameters, got 'friction.coulomb'."),
        ({"effects": ["friction.coulomb"]},
         "Machine.effects must be a mapping of effect names to their parameters, got ['friction.coulomb']."),
        ({"input_joint": None}, "Machine.input_joint must be a mapping of parameters to values, got None."),
        ({"input_joint": {"stiffness": 1.0, "dampin": 1.0}},
         "Machine.input_joint has no parameter 'dampin'; did you mean 'damping'."),
        ({"input_joint": {"damping": 1.0}}, "Machine.input_joint lacks stiffness; give a value for each."),
        ({"motion_law": "modified_sin"}, "motion_law.name must be one of "),
        ({"cam_inertia": "0.5"}, "Machine.cam_inertia must be a finite number > 0 kg m², got '0.5'."),
    ],
)  # fmt: skip
def test_a_mapping_is_refused_in_one_sentence(mapping, changes, said):
    assert refused(machine_from_mapping, {**mapping, **changes}).startswith(said)


@pytest.mark.parametrize("value", [5, "torque", ["torque"]])
def test_parameters_of_an_effect_are_a_mapping(mapping, value):
    said = refused(machine_from_mapping, {**mapping, "effects": {"friction.coulomb": value}})
    assert said.startswith("friction.coulomb must be a mapping of parameters to values")


def test_a_refused_joint_is_named(mapping):
    mapping["output_joint"]["stiffness"] = -5.0
    assert refused(machine_from_mapping, mapping) == (
        "Machine.output_joint.stiffness must be a finite number > 0 N m/rad, got -5.0."
    )


def test_missing_parameters_and_no_mapping_at_all(mapping):
    del mapping["stations"], mapping["cam_inertia"]
    assert refused(machine_from_mapping, mapping) == "Machine lacks cam_inertia, stations; give a value for each."
    assert refused(machine_from_mapping, None) == "A machine must be a mapping of parameters to values, got None."


# -------------------------------------------------------------------------------- operating point


@pytest.mark.parametrize("name", ["motor_speed", "load_torque", "start_angle"])
@pytest.mark.parametrize("value", NOT_NUMBERS)
def test_an_operating_point_refuses_wrong_types(name, value):
    assert refused(OperatingPoint, **{name: value}).startswith(f"OperatingPoint.{name} must be a finite number")


@pytest.mark.parametrize("value", [0.0, -157.0])
def test_the_motor_runs_forward(value):
    said = refused(OperatingPoint, motor_speed=value)
    assert said == f"OperatingPoint.motor_speed must be a finite number > 0 rad/s, got {value!r}."


def test_the_default_operating_point_is_the_reference_one():
    point = OperatingPoint()
    assert point.motor_speed == pytest.approx(50.0 * math.pi, rel=1e-15)
    assert (point.load_torque, point.start_angle) == (2.0, 0.0)
    assert np.isreal(point.motor_speed) and hash(point) == hash(pickle.loads(pickle.dumps(point)))


# -------------------------------------------------------------------------------- what the coefficients refuse


@pytest.mark.parametrize("name", ["cam.station_spacing", "roller.crack_single"])
def test_an_effect_needs_a_station_that_exists(smooth, visible, name):
    coefficients(smooth.with_effects(visible(name, station=7)), OperatingPoint())
    said = refused(coefficients, smooth.with_effects(visible(name, station=8)), OperatingPoint())
    assert said == f"{name}.station must be below the machine's 8 stations, got 8."


def test_model_a_has_no_base_to_loosen(smooth, visible):
    machine = dataclasses.replace(smooth, model="A").with_effects(visible("base.looseness"))
    assert refused(coefficients, machine, OperatingPoint()) == (
        "base.looseness needs Machine.model B or B_on_base, got 'A'; "
        "it acts on joint 3, which that model does not have."
    )


def test_looseness_turns_model_b_into_b_on_base(smooth, visible):
    machine = smooth.with_effects(visible("base.looseness"))
    on_base = coefficients(dataclasses.replace(smooth, model="B_on_base"), OperatingPoint())
    assert isinstance(machine, Machine)
    assert coefficients(machine, OperatingPoint()).model == on_base.model
    assert coefficients(smooth, OperatingPoint()).model != on_base.model


def rise_table(advance: float, decimals: int = 9) -> TableLaw:
    alpha = np.linspace(0.0, 2.0 * math.pi, 361)
    s = np.clip(alpha / math.pi, 0.0, 1.0)
    beta = advance * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return TableLaw(tuple(alpha), tuple(np.radians(np.round(np.degrees(beta), decimals))))


def test_a_table_that_does_not_close_is_refused_with_the_machine(smooth):
    with pytest.raises(ParameterError, match=r"advancing 45 deg per cam turn \(8 stations\), got 44"):
        dataclasses.replace(smooth, motion_law=rise_table(math.radians(44.0)))


def test_a_coarsely_rounded_table_warns_and_a_fine_one_does_not(smooth):
    dataclasses.replace(smooth, motion_law=rise_table(smooth.advance))
    with pytest.warns(MotionLawWarning, match="noise near 4 %"):
        dataclasses.replace(smooth, motion_law=rise_table(smooth.advance, decimals=4))
