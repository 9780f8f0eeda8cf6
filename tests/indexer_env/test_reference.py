"""The reference solver against conservation laws, a plain integration without edges, and its own channels."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from indexer_env.effects import make_effect
from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.reference import simulate_reference

J_T = 5.0


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Model B without any play."""
    return load_machine("smooth")


def with_joints(machine: Machine, **changes: dict) -> Machine:
    joints = {name: dataclasses.replace(getattr(machine, name), **change) for name, change in changes.items()}
    return dataclasses.replace(machine, **joints)


def channels_of(machine: Machine, point: OperatingPoint, *names: str, **more) -> list[np.ndarray]:
    trajectory = simulate_reference(machine, point, channels=names, **more)
    return [trajectory.channels[name] for name in names]


# --- conservation


@pytest.mark.parametrize(
    ("output", "base"),
    [
        ({}, {}),
        ({"backlash": 5e-4}, {"backlash": 2e-5}),
        ({"stiffness_ratio": 0.5}, {"stiffness_ratio": 0.3}),
        ({"backlash": 5e-4, "stiffness_ratio": 0.5}, {"backlash": 2e-5, "stiffness_ratio": 0.5}),
    ],
    ids=["linear", "play", "bilinear", "both"],
)
def test_energy_is_kept(machine: Machine, output: dict, base: dict) -> None:
    """No damping, no drive (a flywheel of a cam that never reaches the end of its play): T + V + T_L φ stays."""
    one = with_joints(
        dataclasses.replace(machine, model="B_on_base", cam_inertia=50.0),
        input_joint={"backlash": 0.5},
        output_joint={"damping": 0.0, **output},
        base_joint={"stiffness": 1e6, "damping": 0.0, **base},
    )
    point = OperatingPoint(load_torque=2.0)
    names = (
        "cam_angle", "cam_rate", "table_angle", "table_rate", "housing_rate", "deflection_2", "deflection_3",
        "region_1", "region_2", "region_3",
    )  # fmt: skip
    alpha, w, phi, v, q, d2, d3, region_1, region_2, region_3 = channels_of(one, point, *names, samples=2000)
    beta1 = one.motion_law.evaluate(alpha, one.stations, one.motion_share)[1]
    kinetic = 0.5 * (50.0 * w**2 + 0.3 * (beta1 * w + q) ** 2 + J_T * v**2 + 20.0 * q**2)
    energy = kinetic + 2.0 * phi
    for joint, delta in ((one.output_joint, d2), (one.base_joint, d3)):
        over = np.maximum(delta - joint.backlash / 2.0, 0.0)
        under = np.minimum(delta + joint.backlash / 2.0, 0.0)
        energy += 0.5 * joint.stiffness * (over**2 + joint.stiffness_ratio * under**2)
    assert (region_1 == 0.0).all()
    if output or base:
        assert {1.0, -1.0} <= set(region_2) and {1.0, -1.0} <= set(region_3)
    assert np.abs(energy / energy[0] - 1.0).max() <= 1e-9


def test_momentum_of_the_machine_off_its_base(machine: Machine) -> None:
    """With the base inside its play only the load changes J_t φ̇ + J_F (β'α̇ + θ̇) + J_b θ̇, whatever the joints do."""
    one = with_joints(
        dataclasses.replace(machine, model="B_on_base"),
        input_joint={"backlash": 2e-3}, output_joint={"backlash": 5e-4}, base_joint={"backlash": 0.5},
    )  # fmt: skip
    names = ("cam_angle", "cam_rate", "table_rate", "housing_rate", "region_1", "region_2", "region_3")
    alpha, w, v, q, *regions = channels_of(one, OperatingPoint(), *names, samples=1000)
    beta1 = one.motion_law.evaluate(alpha, one.stations, one.motion_share)[1]
    momentum = J_T * v + 0.3 * (beta1 * w + q) + 20.0 * q
    expected = -2.0 * np.arange(1000) / 1000.0
    np.testing.assert_allclose(momentum - momentum[0], expected, atol=1e-9)
    assert {-1.0, 0.0, 1.0} <= set(regions[0]) and {-1.0, 0.0, 1.0} <= set(regions[1])


def test_stiff_base_approaches_model_b(machine: Machine) -> None:
    base = {"stiffness": 1e9, "damping": 2e4}
    on_base = with_joints(dataclasses.replace(machine, model="B_on_base"), base_joint=base)
    tight = simulate_reference(machine, samples=300).table_acceleration
    loose = simulate_reference(on_base, samples=300).table_acceleration
    assert np.linalg.norm(loose - tight) <= 1e-3 * np.linalg.norm(tight)


# --- edges and regions


@pytest.mark.parametrize("law", CONTACT_LAWS)
def test_agrees_with_a_plain_integration_without_regions(machine: Machine, law: str) -> None:
    """The torques written as functions of the state alone, fine steps and no edges at all: Model B with play."""
    one = with_joints(
        dataclasses.replace(machine, contact_law=law),
        input_joint={"backlash": 4e-4, "stiffness_ratio": 0.5}, output_joint={"backlash": 1e-4},
    )  # fmt: skip
    point = OperatingPoint(load_torque=20.0, start_angle=0.2)
    rate = one.reduction * point.motor_speed

    def torque(joint: Joint, delta: float, speed: float) -> float:
        over, under = delta - joint.backlash / 2.0, delta + joint.backlash / 2.0
        linear = joint.damping * speed
        if over > 0.0:
            pull = joint.stiffness * over + linear
            return max(pull, 0.0) if law == "clipped" else pull
        if under < 0.0:
            pull = joint.stiffness_ratio * joint.stiffness * under + linear
            return min(pull, 0.0) if law == "clipped" else pull
        return linear if law == "damped_play" else 0.0

    def rates(t: float, y: np.ndarray) -> list[float]:
        alpha, w, phi, v = y
        b0, b1, b2 = map(float, one.motion_law.evaluate(alpha, one.stations, one.motion_share))
        m1 = torque(one.input_joint, 0.2 + rate * t - alpha, rate - w)
        m2 = torque(one.output_joint, phi - b0, v - b1 * w)
        return [w, (m1 + b1 * (m2 - 0.3 * b2 * w * w)) / (0.5 + 0.3 * b1 * b1), v, -(20.0 + m2) / J_T]

    b0, b1, _ = map(float, one.motion_law.evaluate(0.2, one.stations, one.motion_share))
    t = np.arange(60) / 1000.0
    plain = solve_ivp(
        rates, (0.0, t[-1]), [0.2, rate, b0, b1 * rate], method="RK45", t_eval=t, rtol=1e-9, atol=1e-11, max_step=2e-4
    )
    expected = np.array([rates(s, y)[3] for s, y in zip(t, plain.y.T, strict=True)])
    found, region_1, region_2 = channels_of(one, point, "table_acceleration", "region_1", "region_2", samples=60)
    assert np.linalg.norm(found - expected) <= 2e-6 * np.linalg.norm(expected)
    assert np.diff(region_1).any() and np.diff(region_2).any()


def test_regions_and_torques_fit_the_deflections(machine: Machine) -> None:
    """Under Kelvin-Voigt a region is where the deflection is; outside contact there is no torque."""
    plays = {"input_joint": 5e-3, "output_joint": 1e-3, "base_joint": 2e-4}
    one = with_joints(
        dataclasses.replace(machine, model="B_on_base", contact_law="kelvin_voigt"),
        **{joint: {"backlash": play} for joint, play in plays.items()},
    )
    one = with_joints(one, base_joint={"stiffness": 1e6, "damping": 500.0})
    for number, play in enumerate(plays.values(), start=1):
        names = [f"{name}_{number}" for name in ("deflection", "deflection_rate", "torque", "region")]
        delta, speed, torque, region = channels_of(one, OperatingPoint(), *names, samples=600)
        joint = (one.input_joint, one.output_joint, one.base_joint)[number - 1]
        where = np.where(delta > play / 2.0, 1.0, np.where(delta < -play / 2.0, -1.0, 0.0))
        np.testing.assert_array_equal(region, where)
        expected = joint.stiffness * (delta - where * play / 2.0) + joint.damping * speed
        np.testing.assert_allclose(torque, np.where(where == 0.0, 0.0, expected), atol=1e-9)
        assert np.diff(region).any()


def test_rigid_joints_are_in_region_one_and_undeflected(machine: Machine) -> None:
    one = with_joints(dataclasses.replace(machine, model="A"), input_joint={"backlash": 0.01})
    names = ("deflection_1", "deflection_3", "torque_1", "torque_3", "housing_angle", "cam_acceleration")
    for values in channels_of(one, OperatingPoint(), *names, samples=50):
        np.testing.assert_array_equal(values, 0.0)
    for values in channels_of(one, OperatingPoint(), "region_1", "region_3", samples=50):
        np.testing.assert_array_equal(values, 1.0)


def test_cracked_roller_is_soft_in_its_cam_turn_only(machine: Machine) -> None:
    effect = make_effect("roller.crack_single", {"stiffness_loss": 0.5, "station": 1})
    point = OperatingPoint(start_angle=4.0)
    names = ("cam_angle", "deflection_2", "deflection_rate_2", "torque_2")
    alpha, delta, speed, torque = channels_of(machine.with_effects(effect), point, *names, samples=900)
    cracked = np.floor(alpha / (2.0 * math.pi)) % machine.stations == 1
    stiffness = np.where(cracked & (delta < 0.0), 0.5, 1.0) * machine.output_joint.stiffness
    np.testing.assert_allclose(torque, stiffness * delta + machine.output_joint.damping * speed, atol=1e-8)
    assert cracked.any() and not cracked.all() and (delta[cracked] < 0.0).any() and (delta[~cracked] < 0.0).any()


def test_kinematic_cam_of_model_a_follows_its_rippling_drive(machine: Machine) -> None:
    """drive side = τγ + τ (depth/order) sin(order γ + phase) + e sin(order γ + phase), and its two derivatives."""
    effects = (
        make_effect("drive.speed_ripple", {"depth": 0.1, "order": 2.0, "phase": 0.3}),
        make_effect("drive.transmission_error", {"amplitude": 1e-3, "order": 3.0, "phase": 0.7}),
    )
    one = dataclasses.replace(machine, model="A").with_effects(*effects)
    speed, tau = 50.0, one.reduction
    alpha, w, acc = channels_of(
        one, OperatingPoint(motor_speed=speed), "cam_angle", "cam_rate", "cam_acceleration", samples=100
    )
    g = speed * np.arange(100) / 1000.0
    np.testing.assert_allclose(
        alpha, tau * g + tau * 0.05 * np.sin(2 * g + 0.3) + 1e-3 * np.sin(3 * g + 0.7), atol=1e-12
    )
    np.testing.assert_allclose(
        w, speed * (tau + tau * 0.1 * np.cos(2 * g + 0.3) + 3e-3 * np.cos(3 * g + 0.7)), atol=1e-10
    )
    np.testing.assert_allclose(
        acc, -(speed**2) * (tau * 0.2 * np.sin(2 * g + 0.3) + 9e-3 * np.sin(3 * g + 0.7)), atol=1e-8
    )


def test_turns_before_are_the_same_motion_unrecorded(machine: Machine) -> None:
    short = dataclasses.replace(machine, stations=2, motion_share=0.9)
    point = OperatingPoint(motor_speed=300.0)
    turn = short.turn_duration(point)
    rate = 400 / turn
    whole = simulate_reference(short, point, sample_rate=rate, samples=800).table_acceleration
    second = simulate_reference(short, point, sample_rate=rate, turns_before=1).table_acceleration
    assert second.shape == (400,)
    np.testing.assert_allclose(second, whole[400:], atol=1e-8 * np.abs(whole).max())


def test_converged_at_the_default_tolerances(machine: Machine) -> None:
    one = with_joints(machine, input_joint={"backlash": 13.6e-3}, output_joint={"backlash": 1e-3})
    default = simulate_reference(one, samples=300).table_acceleration
    finer = simulate_reference(one, samples=300, rtol=1e-12, atol=1e-14, max_step=3e-4).table_acceleration
    assert np.linalg.norm(default - finer) <= 1e-9 * np.linalg.norm(finer)
