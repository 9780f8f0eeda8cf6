"""The reference solver against closed forms: free decay, driven motion, bilinear period, free flight and impact."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.motion_law import Cycloidal
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.reference import simulate_reference

DWELL = 1.2 * math.pi
J_T = 5.0
K_2 = J_T * (2.0 * math.pi * 15.0) ** 2


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Model B without any play."""
    return load_machine("smooth")


def channels_of(machine: Machine, point: OperatingPoint, *names: str, **more) -> list[np.ndarray]:
    trajectory = simulate_reference(machine, point, channels=names, **more)
    return [trajectory.channels[name] for name in names]


def test_free_decay_in_the_dwell(machine: Machine) -> None:
    """The cam stands on its dwell: the load's step on a damped oscillator of one degree of freedom."""
    zeta, omega = 0.03, 2.0 * math.pi * 15.0
    joint = Joint(stiffness=K_2, damping=2.0 * zeta * math.sqrt(K_2 * J_T))
    one = dataclasses.replace(machine, model="A", output_joint=joint)
    trajectory = simulate_reference(one, OperatingPoint(load_torque=50.0, start_angle=DWELL), samples=350)
    t, damped = trajectory.time, omega * math.sqrt(1.0 - zeta**2)
    swing = np.cos(damped * t) - zeta / math.sqrt(1.0 - zeta**2) * np.sin(damped * t)
    expected = -50.0 / J_T * np.exp(-zeta * omega * t) * swing
    np.testing.assert_allclose(trajectory.table_acceleration, expected, atol=1e-9 * 10.0)


def test_driven_motion_over_the_junctions_of_the_law(machine: Machine) -> None:
    """Undamped Model A under a cycloidal cam: δ'' + ω²δ = -β''α̇², a sine, then free vibration in the dwell."""
    joint = Joint(stiffness=K_2, damping=0.0)
    one = dataclasses.replace(machine, model="A", output_joint=joint, motion_law=Cycloidal())
    point = OperatingPoint(load_torque=0.0)
    trajectory = simulate_reference(one, point, samples=1000)
    rate = one.reduction * point.motor_speed
    period = 2.0 * math.pi * one.motion_share / rate
    p, omega = 2.0 * math.pi / period, math.sqrt(K_2 / J_T)
    peak = one.advance * 2.0 * math.pi / period**2
    factor = peak / (p**2 - omega**2)
    t = trajectory.time
    moving = t < period

    def delta(t: np.ndarray | float) -> np.ndarray:
        return factor * (np.sin(p * t) - p / omega * np.sin(omega * t))

    def slope(t: float) -> float:
        return factor * p * (math.cos(p * t) - math.cos(omega * t))

    rest = t - period
    free = delta(period) * np.cos(omega * rest) + slope(period) / omega * np.sin(omega * rest)
    expected = -(omega**2) * np.where(moving, delta(t), free)
    np.testing.assert_allclose(trajectory.table_acceleration, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("ratio", [0.25, 0.7])
def test_period_of_a_bilinear_joint(machine: Machine, ratio: float) -> None:
    """Free vibration about zero takes half a period of each stiffness: π/ω1 + π/ω2."""
    joint = Joint(stiffness=K_2, damping=0.0, stiffness_ratio=ratio)
    one = dataclasses.replace(machine, model="A", output_joint=joint)
    point = OperatingPoint(load_torque=0.0, start_angle=0.5 * math.pi)
    rate = 10_000.0
    delta, speed, region = channels_of(
        one, point, "deflection_2", "deflection_rate_2", "region_2", samples=7000, sample_rate=rate
    )
    dwell = np.arange(delta.size) / rate > 0.5 * math.pi / (one.reduction * point.motor_speed)
    upward = np.flatnonzero((delta[:-1] < 0.0) & (delta[1:] >= 0.0) & dwell[:-1])
    crossings = []
    for i in upward:
        y0, y1, v0, v1 = delta[i], delta[i + 1], speed[i] / rate, speed[i + 1] / rate

        def hermite(s: float, y0=y0, y1=y1, v0=v0, v1=v1) -> float:
            return (
                (1 + 2 * s) * (1 - s) ** 2 * y0 + s * (1 - s) ** 2 * v0
                + s * s * (3 - 2 * s) * y1 - s * s * (1 - s) * v1
            )  # fmt: skip

        crossings.append((i + brentq(hermite, 0.0, 1.0)) / rate)
    omega = math.sqrt(K_2 / J_T)
    assert len(crossings) >= 4
    np.testing.assert_allclose(np.diff(crossings), math.pi / omega * (1.0 + ratio**-0.5), rtol=1e-7)
    np.testing.assert_array_equal(region, np.where(delta >= 0.0, 1.0, -1.0))


@pytest.mark.parametrize("law", CONTACT_LAWS)
def test_free_flight_and_impact(machine: Machine, law: str) -> None:
    """Inside the play only the load acts (and the damper of damped_play), until the negative flank is hit."""
    play, torque, damping = 0.05, 2.0, 28.0
    joint = Joint(stiffness=K_2, damping=damping, backlash=play)
    one = dataclasses.replace(machine, model="A", contact_law=law, output_joint=joint)
    point = OperatingPoint(load_torque=torque, start_angle=1.05 * math.pi)
    samples = 400 if law != "damped_play" else 430
    acc, delta, region, pull = channels_of(
        one, point, "table_acceleration", "deflection_2", "region_2", "torque_2", samples=samples
    )
    t = np.arange(acc.size) / 1000.0
    flight = np.cumprod(region == 0.0).astype(bool)
    if law == "damped_play":
        expected = -torque / J_T * np.exp(-damping * t / J_T)
        np.testing.assert_allclose(pull[flight], -(torque + J_T * expected)[flight], atol=1e-9)
    else:
        expected = np.full(acc.size, -torque / J_T)
        hit = math.sqrt(play * J_T / torque)
        assert np.flatnonzero(~flight)[0] == math.ceil(hit * 1000.0)
        np.testing.assert_array_equal(pull[flight], 0.0)
    np.testing.assert_allclose(acc[flight], expected[flight], rtol=1e-10)
    if law != "damped_play":
        assert region.min() == -1.0
        assert delta.min() < -0.5 * play
        contact = np.flatnonzero(~flight)[0]
        speed = -torque / J_T * hit
        since = t[contact] - hit
        # just behind the flank: the damper's step, then the damped spring
        omega, decay = math.sqrt(K_2 / J_T), damping / (2.0 * J_T)
        damped, push = math.sqrt(omega**2 - decay**2), torque / K_2
        a, b = push, (speed + decay * push) / damped
        envelope = math.exp(-decay * since)
        x = envelope * (a * math.cos(damped * since) + b * math.sin(damped * since)) - push
        v = envelope * (
            (b * damped - decay * a) * math.cos(damped * since) - (a * damped + decay * b) * math.sin(damped * since)
        )
        assert pull[contact] == pytest.approx(K_2 * x + damping * v, rel=1e-8)


def test_contact_laws_part_as_contact_ends(machine: Machine) -> None:
    """On the way out the clipped flank lets go where Kelvin-Voigt's pulls."""
    pulls = {}
    for law in ("clipped", "kelvin_voigt"):
        joint = Joint(stiffness=K_2, damping=200.0, backlash=0.02)
        one = dataclasses.replace(machine, model="A", contact_law=law, output_joint=joint)
        point = OperatingPoint(load_torque=20.0, start_angle=1.05 * math.pi)
        pull, region = channels_of(one, point, "torque_2", "region_2", samples=4000, sample_rate=10_000.0)
        pulls[law] = float((pull * region).min())  # < 0: the flank pulls
    assert pulls["clipped"] == 0.0
    assert pulls["kelvin_voigt"] < -1.0
