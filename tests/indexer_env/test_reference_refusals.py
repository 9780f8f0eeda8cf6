"""What the reference solver refuses, what it leaves out, and how it tells of a run that fails."""

import dataclasses

import numpy as np
import pytest

from indexer_env.effects import make_effect, null_effect
from indexer_env.effects.base import EFFECTS, MachineEffect, parameter
from indexer_env.errors import ParameterError, SimulationError
from indexer_env.machine import Machine
from indexer_env.motion_law import Cycloidal
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.reference import simulate_reference


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Model B without any play."""
    return load_machine("smooth")


def with_joints(machine: Machine, **changes: dict) -> Machine:
    joints = {name: dataclasses.replace(getattr(machine, name), **change) for name, change in changes.items()}
    return dataclasses.replace(machine, **joints)


def test_null_effects_change_no_bit(machine: Machine) -> None:
    names = [name for name, effect in EFFECTS.items() if issubclass(effect, MachineEffect)]
    off = machine.with_effects(*(null_effect(name) for name in names))  # type: ignore[arg-type]
    plain = simulate_reference(machine, samples=50).table_acceleration
    np.testing.assert_array_equal(simulate_reference(off, samples=50).table_acceleration, plain)


def test_unknown_effect_is_refused(machine: Machine) -> None:
    @dataclasses.dataclass(frozen=True)
    class Unheard(MachineEffect):
        name = "friction.unheard"
        torque: float = parameter("torque", "N m", null=0.0)

    with pytest.raises(ParameterError, match=r"does not know the effect 'friction\.unheard'"):
        simulate_reference(machine.with_effects(Unheard(1.0)), samples=10)


@pytest.mark.parametrize("name", ["roller.crack_single", "cam.station_spacing"])
def test_station_that_the_machine_has_not_is_refused(machine: Machine, name: str) -> None:
    size = {"roller.crack_single": "stiffness_loss", "cam.station_spacing": "error"}[name]
    effect = make_effect(name, {size: 0.01, "station": 8})
    with pytest.raises(ParameterError, match="below the machine's 8 stations"):
        simulate_reference(machine.with_effects(effect), samples=10)


def test_loose_base_needs_a_housing(machine: Machine) -> None:
    effect = make_effect("base.looseness", {"compliance": 1e-6})
    with pytest.raises(ParameterError, match=r"base\.looseness needs Machine\.model B"):
        simulate_reference(dataclasses.replace(machine, model="A").with_effects(effect), samples=10)


@pytest.mark.parametrize(
    ("argument", "value", "said"),
    [
        ("sample_rate", 0.0, "sample_rate must be a finite number > 0 Hz, got 0.0"),
        ("samples", 0, "samples must be a whole number >= 1, got 0"),
        ("samples", 10.0, "samples must be a whole number"),
        ("turns_before", -1, "turns_before must be a whole number >= 0, got -1"),
        ("rtol", 1e-15, "rtol must be"),
        ("atol", 0.0, "atol must be"),
        ("max_step", 1.0, "max_step must be"),
        ("channels", ("table_aceleration",), "did you mean 'table_acceleration'"),
        ("channels", "table_acceleration", "channels must be a row of channel names"),
        ("channels", (), "channels must be a row of channel names"),
        ("operating_point", 1500.0, "operating_point must be an OperatingPoint, got 1500.0"),
    ],
)
def test_bad_arguments_are_refused(machine: Machine, argument: str, value: object, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        simulate_reference(machine, **{argument: value})  # type: ignore[arg-type]


def test_a_machine_is_needed() -> None:
    with pytest.raises(ParameterError, match="machine must be a Machine, got 'reference'"):
        simulate_reference("reference")  # type: ignore[arg-type]


def test_leaving_the_physical_range_names_machine_time_and_state(machine: Machine) -> None:
    point = OperatingPoint(load_torque=1e5)
    with pytest.raises(
        SimulationError, match=r"^smooth deflected a joint beyond 0\.5 rad at t = 0\.0\d+ s \(cam_angle"
    ):
        simulate_reference(machine, point, samples=500)


def test_a_run_that_overflows_is_told(machine: Machine) -> None:
    with pytest.raises(SimulationError, match=r"^smooth .* at t = .* s \(cam_angle .*\)\.$"):
        simulate_reference(machine, OperatingPoint(load_torque=1e308), samples=10)


def test_a_hardening_flank_lets_go_where_its_whole_push_ends(machine: Machine) -> None:
    """A flank so soft and damped would slide along its edge for ever if the cubic push were dropped at once where the
    damped linear part ends; it lets go where k x + k_c x³ + r δ̇ ends, so that the torque has no jump to slide along."""
    flank = {"stiffness": 18_800.0, "damping": 124.0, "backlash": 3.9e-5, "stiffness_ratio": 0.13}
    effect = make_effect("output.cubic_stiffness", {"stiffness": 8.74e8})
    one = with_joints(dataclasses.replace(machine, model="A", motion_law=Cycloidal()), output_joint=flank)
    point = OperatingPoint(motor_speed=157.0, load_torque=-30.0, start_angle=0.9453571576990945)
    run = simulate_reference(one.with_effects(effect), point, samples=200, channels=("torque_2", "region_2"))  # type: ignore[arg-type]
    torque, region = run.channels["torque_2"], run.channels["region_2"]
    assert {-1.0, 0.0, 1.0} >= set(region) and (torque * region >= 0.0).all() and (torque[region == 0.0] == 0.0).all()
