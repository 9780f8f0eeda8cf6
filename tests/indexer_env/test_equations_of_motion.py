"""Recorded motions obey docs/explanation/physics.md: each row of the equations put together from channels alone."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate
from indexer_env.trajectory import CHANNELS

EFFECTS = (
    None, "friction.coulomb", "load.imbalance", "load.process", "drive.slip", "drive.speed_ripple",
    "drive.transmission_error", "drive.mesh_stiffness", "cam.profile_error", "cam.station_spacing", "roller.crack",
    "roller.crack_single", "input.backlash", "output.backlash", "output.cubic_stiffness",
)  # fmt: skip
POINT = OperatingPoint(load_torque=15.0, start_angle=4.0)


def law_of(machine: Machine, cam_angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """β, β' and β'' with what the effects on the cam make of them."""
    values = machine.motion_law.evaluate(cam_angle, machine.stations, machine.motion_share)
    b0, b1, b2 = (np.array(value) for value in values)
    turn, advance = np.floor(cam_angle / (2.0 * math.pi)), 2.0 * math.pi / machine.stations
    for effect in machine.effects:
        if effect.name == "cam.profile_error":
            width = 2.0 * math.pi * effect.half_width
            y = ((cam_angle / (2.0 * math.pi) - effect.centre + 0.5) % 1.0 - 0.5) / effect.half_width
            q = np.maximum(1.0 - y**2, 0.0)
            b0 += effect.height * q**4
            b1 += effect.height * -8.0 * y * q**3 / width
            b2 += effect.height * (48.0 * y**2 * q**2 - 8.0 * q**3) / width**2
        if effect.name == "cam.station_spacing":
            to, away = (turn + 1) % machine.stations == effect.station, turn % machine.stations == effect.station
            factor = np.select([to, away], [effect.error / advance, -effect.error / advance], 0.0)
            b0 += factor * (b0 - turn * advance) + np.where(away, effect.error, 0.0)
            b1, b2 = b1 * (1.0 + factor), b2 * (1.0 + factor)
    return b0, b1, b2


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("model", ["B", "B_on_base"])
def test_the_cam_and_the_housing_obey_their_rows(smooth, visible, name, model):
    base = Joint(stiffness=5e5, damping=800.0, backlash=1e-4)
    machine = dataclasses.replace(smooth, model=model, base_joint=base)
    if name is not None:
        machine = machine.with_effects(visible(name))
    run = Run(samples=2500, warmup_turns=0, channels=tuple(CHANNELS))
    r = simulate(machine, POINT, run).channels
    b0, b1, b2 = law_of(machine, r["cam_angle"])
    J_C, J_F, J_b = machine.cam_inertia, machine.follower_inertia, machine.housing_inertia
    w, M1, M2, M3 = r["cam_rate"], r["torque_1"], r["torque_2"], r["torque_3"]
    cam, housing = r["cam_acceleration"], r["housing_acceleration"]

    left = (J_C + J_F * b1**2) * cam + J_F * b1 * housing
    right = M1 + b1 * M2 - J_F * b1 * b2 * w**2
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-6 * np.abs(M1).max())
    if model == "B_on_base":
        left = J_F * b1 * cam + (J_F + J_b) * housing
        right = M2 - M3 - J_F * b2 * w**2
        np.testing.assert_allclose(left, right, rtol=0, atol=1e-6 * np.abs(M2).max())
    else:
        assert (housing == 0.0).all()

    d2, v2 = r["table_angle"] - b0 - r["housing_angle"], r["table_rate"] - b1 * w - r["housing_rate"]
    np.testing.assert_allclose(r["deflection_2"], d2, rtol=0, atol=1e-9)
    np.testing.assert_allclose(r["deflection_rate_2"], v2, rtol=0, atol=1e-7)
    np.testing.assert_allclose(r["deflection_3"], r["housing_angle"], rtol=0, atol=0)


@pytest.mark.parametrize("name", [None, "drive.transmission_error", "cam.profile_error", "friction.viscous"])
def test_model_a_s_cam_follows_its_drive(smooth, visible, name):
    machine = dataclasses.replace(smooth, model="A")
    if name is not None:
        machine = machine.with_effects(visible(name))
    r = simulate(machine, POINT, Run(samples=2500, warmup_turns=0, channels=tuple(CHANNELS))).channels
    waver = 1e-3 if name == "drive.transmission_error" else 0.0
    gamma, omega = r["motor_angle"], POINT.motor_speed
    alpha = machine.reduction * gamma + waver * np.sin(2.0 * gamma)
    np.testing.assert_allclose(r["cam_angle"], alpha, rtol=0, atol=1e-11)
    rate = machine.reduction * omega + waver * 2.0 * omega * np.cos(2.0 * gamma)
    np.testing.assert_allclose(r["cam_rate"], rate, rtol=1e-10)
    np.testing.assert_allclose(r["cam_acceleration"], -waver * 4.0 * omega**2 * np.sin(2.0 * gamma), atol=1e-6)
    b0, b1, _ = law_of(machine, r["cam_angle"])
    np.testing.assert_allclose(r["deflection_2"], r["table_angle"] - b0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(r["deflection_rate_2"], r["table_rate"] - b1 * rate, rtol=0, atol=1e-7)
    assert np.abs(r["deflection_1"]).max() < 1e-12
