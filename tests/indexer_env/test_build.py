"""From plain mappings to self-checking objects."""

import dataclasses
import math

import pytest

from indexer_env.build import from_mapping
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError
from indexer_env.fault_law import fault_law
from indexer_env.faults import Faults
from indexer_env.law_reader import law_of_field
from indexer_env.machine import Joint
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


@dataclasses.dataclass(frozen=True)
class Wheel:
    radius: float
    angle: float = 0.0
    spokes: list = dataclasses.field(default_factory=list)
    girth: float = dataclasses.field(init=False, default=0.0)


def sentence(*arguments, **options) -> str:
    with pytest.raises(ParameterError) as caught:
        from_mapping(*arguments, **options)
    return str(caught.value)


def test_fields_are_set_and_defaults_kept():
    wheel = from_mapping(Wheel, {"radius": 2.0})
    assert (wheel.radius, wheel.angle, wheel.spokes) == (2.0, 0.0, [])
    assert from_mapping(Joint, {"stiffness": 3, "damping": 0}) == Joint(3, 0)


def test_degrees_and_revolutions_become_si():
    point = from_mapping(OperatingPoint, {"motor_speed_rpm": 1500, "start_angle_deg": -90.0})
    assert point.motor_speed == pytest.approx(50.0 * math.pi, rel=1e-15)
    assert point.start_angle == pytest.approx(-math.pi / 2.0, rel=1e-15)
    assert from_mapping(Faults, {"backlash_deg": 20}).backlash == pytest.approx(math.pi / 9.0, rel=1e-15)


def test_a_field_that_itself_ends_like_a_unit_is_left_alone():
    @dataclasses.dataclass(frozen=True)
    class Table:
        cam_angle_deg: float

    assert from_mapping(Table, {"cam_angle_deg": 90.0}).cam_angle_deg == 90.0


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: from_mapping(Joint, {"stiffness_deg": 139.6}), "did you mean 'stiffness', which is in"),
        (lambda: from_mapping(Joint, {"stiffness_nm_per_deg": 1}), "did you mean 'stiffness', which is in SI units."),
        (lambda: from_mapping(OperatingPoint, {"load_torque_rpm": 1}), "did you mean 'load_torque', which is in SI"),
        (lambda: from_mapping(OperatingPoint, {"motor_speed_deg": 1}), "'motor_speed', .* units, or an ending of _rpm"),
        (lambda: from_mapping(Sensor, {"radius_deg": 0.4}), "has no parameter 'radius_deg'"),
        (lambda: make_effect("cam.station_spacing", error_rpm=1, station=0), "did you mean 'error', .* ending of _deg"),
        (lambda: make_effect("drive.slip", compliance_deg=1), "did you mean 'compliance', which is in SI units."),
        (lambda: fault_law({"roller_crack_rpm": 5}), "has no parameter 'roller_crack_rpm'"),
        (lambda: law_of_field("owner", "damping_deg", 1, ("damping",)), "did you mean 'damping', which is in SI."),
    ],
)  # fmt: skip
def test_an_ending_acts_only_where_it_measures(build, said):
    with pytest.raises(ParameterError, match=said):
        build()


def test_an_effect_states_which_of_its_fields_take_an_ending():
    assert make_effect("cam.station_spacing", error_deg=1, station=0).error == pytest.approx(math.radians(1.0))


@pytest.mark.parametrize(
    ("mapping", "said"),
    [
        ({"radius": 1.0, "angel": 0.0}, "Wheel has no parameter 'angel'; did you mean 'angle'."),
        ({"radius": 1.0, "zzz": 0.0}, "Wheel has no parameter 'zzz'; its parameters are radius, angle, spokes."),
        ({"radius": 1.0, "girth": 0.0}, "Wheel has no parameter 'girth'; its parameters are "),
        ({"radius": 1.0, "zzz_deg": 0.0}, "Wheel has no parameter 'zzz_deg'; "),
        ({"radius": 1.0, "angel_deg": 0.0}, "Wheel has no parameter 'angel_deg'; did you mean 'angle_deg'."),
        ({"radius": 1.0, "Angle (deg)": 0.0}, "Wheel has no parameter 'Angle (deg)'; did you mean 'angle_deg'."),
        ({"radius": 1.0, 5: 0.0}, "Wheel has no parameter '5'; "),
        ({"angle": 0.0}, "Wheel lacks radius; give a value for each."),
        ({"radius": 1.0, "angle": 1.0, "angle_deg": 2.0},
         "Wheel.angle is given twice, once as 'angle_deg'; keep one of them."),
        ({"radius": 1.0, "angle_deg": "90"}, "Wheel.angle_deg must be a finite number in deg, got '90'."),
        ({"radius": 1.0, "angle_deg": True}, "Wheel.angle_deg must be a finite number in deg, got True."),
        ({"radius": 1.0, "angle_deg": math.nan}, "Wheel.angle_deg must be a finite number in deg, got nan."),
        ({"radius": 1.0, "angle_deg": None}, "Wheel.angle_deg must be a finite number in deg, got None."),
        (None, "Wheel must be a mapping of parameters to values, got None."),
        (["radius"], "Wheel must be a mapping of parameters to values, got ['radius']."),
    ],
)  # fmt: skip
def test_refusals(mapping, said):
    text = sentence(Wheel, mapping)
    assert text.startswith(said) and text.endswith(".")


def test_all_missing_parameters_are_named_at_once():
    assert sentence(Joint, {}) == "Joint lacks stiffness, damping; give a value for each."


def test_the_owner_names_the_place():
    assert sentence(Joint, {"damping": 1.0}, owner="Machine.input_joint").startswith("Machine.input_joint lacks")


def test_the_class_itself_checks_what_it_is_given():
    assert sentence(Joint, {"stiffness": -1.0, "damping": 0.0}).startswith(
        "Joint.stiffness must be a finite number > 0"
    )


def test_the_mapping_is_left_as_it_was():
    mapping = {"motor_speed_rpm": 1500.0}
    from_mapping(OperatingPoint, mapping)
    assert mapping == {"motor_speed_rpm": 1500.0}
