"""Joint torques of simulated machines against the formulas of docs/explanation/physics.md, written anew here."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate

PLAY, RATIO = {1: 4e-3, 2: 4e-3, 3: 1.5e-3}, 0.6
SHAPES = {"linear": (0, 1.0), "play": (1, 1.0), "bilinear": (0, RATIO), "bilinear_play": (1, RATIO)}
JOINTS = {1: "input_joint", 2: "output_joint", 3: "base_joint"}
SOFT_BASE = Joint(stiffness=2e5, damping=600.0)


def machine_with(smooth: Machine, number: int, shape: str, law: str) -> Machine:
    """The smooth machine on a soft base, joint `number` of that shape."""
    machine = dataclasses.replace(smooth, model="B_on_base", base_joint=SOFT_BASE, contact_law=law)
    has_play, ratio = SHAPES[shape]
    joint = dataclasses.replace(
        getattr(machine, JOINTS[number]), backlash=has_play * PLAY[number], stiffness_ratio=ratio
    )
    return dataclasses.replace(machine, **{JOINTS[number]: joint})


def motion(machine: Machine, *numbers: int, samples: int = 2000) -> dict[str, np.ndarray]:
    channels = [f"{kind}_{n}" for n in numbers for kind in ("deflection", "deflection_rate", "torque", "region")]
    run = Run(samples=samples, warmup_turns=0, step=0.1e-3, channels=tuple(channels))
    return simulate(machine, OperatingPoint(), run).channels


def formula(joint: Joint, law: str, d: float, v: float) -> float:
    """M(δ, δ̇), one flank after the other."""
    k, r, half, ratio = joint.stiffness, joint.damping, joint.backlash / 2.0, joint.stiffness_ratio
    if d > half or (half == 0.0 and d == 0.0):
        torque = k * (d - half) + r * v
        return max(torque, 0.0) if half > 0.0 and law == "clipped" else torque
    if d < -half:
        torque = ratio * k * (d + half) + r * v
        return min(torque, 0.0) if half > 0.0 and law == "clipped" else torque
    return r * v if law == "damped_play" else 0.0


@pytest.mark.parametrize("law", CONTACT_LAWS)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("number", JOINTS)
def test_torque_is_that_of_the_formula(smooth, number, shape, law):
    machine = machine_with(smooth, number, shape, law)
    joint = getattr(machine, JOINTS[number])
    channels = motion(machine, number)
    d, v, torque = (channels[f"{kind}_{number}"] for kind in ("deflection", "deflection_rate", "torque"))
    expected = np.array([formula(joint, law, *state) for state in zip(d, v, strict=True)])
    scale = np.abs(expected).max()
    # The joint has been through all its branches, or the comparison says little.
    assert (d > joint.backlash / 2.0).mean() > 0.03 and (d < -joint.backlash / 2.0).mean() > 0.03
    if joint.backlash > 0.0:
        assert (np.abs(d) < joint.backlash / 2.0).mean() > 0.01
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("number", JOINTS)
@pytest.mark.parametrize("shape", ["play", "bilinear_play"])
def test_clipped_contact_never_pulls_and_the_others_do(smooth, number, shape):
    pulls = {}
    for law in CONTACT_LAWS:
        channels = motion(machine_with(smooth, number, shape, law), number)
        towards = np.sign(channels[f"deflection_{number}"]) * channels[f"torque_{number}"]
        pulls[law] = -towards.min() / np.abs(towards).max()
    assert pulls["clipped"] <= 1e-12
    assert pulls["kelvin_voigt"] > 1e-3 and pulls["damped_play"] > 1e-3


@pytest.mark.parametrize("number", JOINTS)
@pytest.mark.parametrize("shape", ["linear", "bilinear"])
def test_without_play_the_laws_are_the_same_bit_for_bit(smooth, number, shape):
    records = [motion(machine_with(smooth, number, shape, law), number, samples=400) for law in CONTACT_LAWS]
    for record in records[1:]:
        assert all(record[name].tobytes() == values.tobytes() for name, values in records[0].items())


@pytest.mark.parametrize("number", JOINTS)
def test_with_play_the_laws_differ(smooth, number):
    torques = [motion(machine_with(smooth, number, "play", law), number)[f"torque_{number}"] for law in CONTACT_LAWS]
    for one, other in ((0, 1), (1, 2), (0, 2)):
        assert np.abs(torques[one] - torques[other]).max() > 1e-3 * np.abs(torques[0]).max()


@pytest.mark.parametrize("number", JOINTS)
@pytest.mark.parametrize("law", CONTACT_LAWS)
def test_regions_tell_the_flank(smooth, number, law):
    joint = getattr(machine_with(smooth, number, "bilinear_play", law), JOINTS[number])
    channels = motion(machine_with(smooth, number, "bilinear_play", law), number)
    d, region, torque = (channels[f"{kind}_{number}"] for kind in ("deflection", "region", "torque"))
    half = joint.backlash / 2.0
    assert set(region) == {-1.0, 0.0, 1.0}
    assert (d[region == 1.0] >= half - 1e-12).all() and (d[region == -1.0] <= -half + 1e-12).all()
    if law == "clipped":
        # Contact opens where it would begin to pull, a little before the edge is reached.
        assert (torque[region == 0.0] == 0.0).all()
    else:
        assert (np.abs(d[region == 0.0]) <= half + 1e-12).all()
        assert (np.abs(torque[region == 0.0]).max() == 0.0) == (law == "kelvin_voigt")


def test_play_is_total_play(smooth):
    """The dead zone is ±g/2: a free cam moves by g from flank to flank, no more."""
    machine = machine_with(smooth, 1, "play", "clipped")
    channels = motion(machine, 1)
    free = channels["deflection_1"][channels["region_1"] == 0.0]
    assert free.max() == pytest.approx(PLAY[1] / 2.0, rel=0.05)
    assert free.min() == pytest.approx(-PLAY[1] / 2.0, rel=0.05)


def test_three_joints_with_play_at_once(smooth):
    machine = smooth
    for number in JOINTS:
        machine = dataclasses.replace(
            machine_with(machine, number, "bilinear_play", "clipped"),
            **{JOINTS[n]: getattr(machine, JOINTS[n]) for n in JOINTS if n < number},
        )
    channels = motion(machine, 1, 2, 3)
    for number, name in JOINTS.items():
        joint = getattr(machine, name)
        assert joint.backlash == PLAY[number] and joint.stiffness_ratio == RATIO
        d, v, torque = (channels[f"{kind}_{number}"] for kind in ("deflection", "deflection_rate", "torque"))
        expected = np.array([formula(joint, "clipped", *state) for state in zip(d, v, strict=True)])
        np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("ratio", [1.0, RATIO])
def test_free_vibration_of_a_bilinear_joint_has_the_period_of_two_half_springs(smooth, ratio):
    """Undamped Model A in its dwell: T = π/ω + π/(ω √ρ)."""
    joint = dataclasses.replace(smooth.output_joint, damping=0.0, stiffness_ratio=ratio)
    machine = dataclasses.replace(smooth, model="A", output_joint=joint, motion_share=0.1)
    run = Run(sample_rate=2000.0, samples=2000, warmup_turns=0, channels=("deflection_2", "deflection_rate_2"))
    channels = simulate(machine, OperatingPoint(load_torque=0.0), run).channels
    d, v = channels["deflection_2"][250:], channels["deflection_rate_2"][250:]  # the dwell begins at 0.1025 s
    up = np.flatnonzero((d[:-1] < 0.0) & (d[1:] >= 0.0))
    crossings = (up - d[up] / (0.5 * (v[up] + v[up + 1])) * run.sample_rate) / run.sample_rate
    omega = math.sqrt(joint.stiffness / machine.table_inertia)
    assert len(crossings) > 8
    np.testing.assert_allclose(np.diff(crossings), math.pi / omega * (1.0 + ratio**-0.5), rtol=2e-4)
