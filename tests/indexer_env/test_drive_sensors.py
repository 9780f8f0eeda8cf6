"""What the drive measures: the motor's work is that of load and dampers, encoders count. Random choices are seeded."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import Run, load_machine, load_operating_point, make_effect, simulate
from indexer_env.drive_sensors import SIGNALS, DriveSensors
from indexer_env.errors import ParameterError

ALL = DriveSensors(tuple(SIGNALS), torque_constant=0.8, motor_counts=4096, table_counts=1000)


def test_the_motor_s_work_in_a_turn_is_that_of_the_load_and_the_dampers() -> None:
    """Smooth machine, settled: ∮ T γ̇ dt = 2π T_L + ∮ (r1 δ̇1² + r2 δ̇2²) dt, as its springs give back what they take."""
    machine, point = load_machine("smooth"), load_operating_point("reference")
    channels = (*ALL.channels, "motor_rate", "deflection_rate_1", "deflection_rate_2")
    run = Run(sample_rate=4000.0, channels=channels, warmup_turns=6, warmup_tolerance=1e-9)
    trajectory = simulate(machine, point, run)
    found = ALL.read(machine, trajectory.channels, trajectory.sample_rate)
    step = 1.0 / trajectory.sample_rate
    work = float(np.sum(found["motor_torque"] * trajectory.channels["motor_rate"])) * step
    lost = sum(
        joint.damping * float(np.sum(np.square(trajectory.channels[f"deflection_rate_{number}"]))) * step
        for number, joint in ((1, machine.input_joint), (2, machine.output_joint))
    )
    assert lost > 0.0
    assert work == pytest.approx(2.0 * math.pi * point.load_torque + lost, rel=1e-4)


def test_a_motor_that_changes_its_speed_takes_torque_for_its_rotor() -> None:
    machine = load_machine("smooth").with_effects(make_effect("drive.slip", {"compliance": 0.5}))
    run = Run(samples=500, channels=ALL.channels)
    trajectory = simulate(machine, load_operating_point("reference"), run)
    found = ALL.read(machine, trajectory.channels, trajectory.sample_rate)["motor_torque"]
    joint = machine.reduction * trajectory.channels["torque_1"]
    rotor = machine.motor_inertia * trajectory.channels["motor_acceleration"]
    assert np.ptp(rotor) > 0.0
    np.testing.assert_allclose(found, joint + rotor, rtol=1e-6)


def test_current_and_encoders() -> None:
    machine = load_machine("reference")
    trajectory = simulate(machine, load_operating_point("reference"), Run(samples=2000, channels=ALL.channels))
    found = ALL.read(machine, trajectory.channels, trajectory.sample_rate)
    assert all(values.dtype == np.float32 for values in found.values()) and list(found) == list(SIGNALS)
    np.testing.assert_allclose(found["motor_current"], found["motor_torque"] / 0.8, rtol=1e-6)
    for name, counts in (("motor_angle", 4096), ("table_angle", 1000)):
        read = found[name] * counts / (2.0 * math.pi)
        np.testing.assert_allclose(read, np.rint(read), atol=1e-3 * counts / 1000)
        assert read.min() >= 0.0 and np.rint(read).max() < counts
        apart = np.angle(np.exp(1j * (found[name] - trajectory.channels[name])))
        assert np.abs(apart).max() <= 0.501 * 2.0 * math.pi / counts


def test_noise_has_its_density_and_its_generator() -> None:
    """20 000 samples: the standard deviation is known to 0.5 %."""
    machine = load_machine("reference")
    noisy = DriveSensors(("motor_current",), current_noise_density=0.01)
    channels = {name: np.zeros(20_000) for name in noisy.channels}
    found = noisy.read(machine, channels, 1000.0, np.random.default_rng(1))["motor_current"]
    assert found.std() == pytest.approx(0.01 * math.sqrt(500.0), rel=0.02)
    with pytest.raises(ParameterError, match=r"DriveSensors\.read\.rng must be a numpy"):
        noisy.read(machine, channels, 1000.0)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"signals": ("torque",)}, "signals must be one of"),
        ({"signals": "motor_torque"}, "signals must be a list of some of"),
        ({"signals": ("motor_angle", "motor_angle")}, "names each signal once"),
        ({"torque_constant": 0.0}, r"torque_constant must be .* > 0 N m/A"),
        ({"current_noise_density": -1.0}, "current_noise_density must be"),
        ({"motor_counts": 1}, "motor_counts must be"),
        ({"table_counts": 2**25}, "table_counts must be"),
    ],
)
def test_refusals(settings, sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        DriveSensors(**settings)


def test_model_a_has_no_motor_torque() -> None:
    machine = dataclasses.replace(load_machine("reference"), model="A")
    with pytest.raises(ParameterError, match="for a machine of Model A, which has no input joint"):
        ALL.check_machine(machine)
    DriveSensors(("motor_angle",)).check_machine(machine)


def test_channels_that_are_missing_are_refused() -> None:
    sensors = DriveSensors(("motor_torque",))
    with pytest.raises(ParameterError, match=r"^DriveSensors\.read\.channels must be a mapping with torque_1, "):
        sensors.read(load_machine("reference"), {"table_acceleration": np.zeros(4)}, 1000.0)
