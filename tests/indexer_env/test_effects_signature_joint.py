"""Play, hardening and the loose base show in their joints, and nowhere when off."""

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest

from indexer_env.machine import Machine
from indexer_env.modes import natural_frequencies
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate

CHANNELS = (
    "table_acceleration", "housing_angle", "housing_acceleration",
    "deflection_1", "deflection_rate_1", "torque_1", "region_1",
    "deflection_2", "deflection_rate_2", "torque_2", "region_2",
    "deflection_3", "deflection_rate_3", "torque_3", "region_3",
)  # fmt: skip


@functools.lru_cache(maxsize=64)
def motion(machine: Machine, samples: int = 2050, step: float = 0.25e-3) -> dict[str, np.ndarray]:
    """The first cam turns from rest on the law, at 1 kHz."""
    return simulate(machine, run=Run(samples=samples, warmup_turns=0, step=step, channels=CHANNELS)).channels


# -------------------------------------------------------------------------------- play


@pytest.mark.parametrize(("name", "number"), [("input.backlash", 1), ("output.backlash", 2)])
@pytest.mark.parametrize("own", [0.0, 2e-3])
def test_play_frees_its_joint_over_its_width(smooth, visible, name, number, own):
    """The effect's play adds to the joint's own; the dead zone is ±g/2, and in it no torque acts."""
    field = {1: "input_joint", 2: "output_joint"}[number]
    plain = dataclasses.replace(smooth, **{field: dataclasses.replace(getattr(smooth, field), backlash=own)})
    effect = visible(name, backlash=4e-3)
    r = motion(plain.with_effects(effect))
    free = r[f"region_{number}"] == 0.0
    width = own + 4e-3
    assert 0.02 < free.mean() < 0.98
    assert (r[f"torque_{number}"][free] == 0.0).all()
    inside = np.abs(r[f"deflection_{number}"]) < 0.5 * width * (1.0 - 1e-9)
    assert inside.sum() > 20 and free[inside].all()
    assert np.ptp(r[f"deflection_{number}"][inside]) == pytest.approx(width, rel=0.05)
    deepest = np.abs(r[f"torque_{number}"]).argmax()
    joint, d = getattr(smooth, field), r[f"deflection_{number}"][deepest]
    expected = joint.stiffness * (d - math.copysign(0.5 * width, d))
    expected += joint.damping * r[f"deflection_rate_{number}"][deepest]
    assert r[f"torque_{number}"][deepest] == pytest.approx(expected, rel=1e-9)


def test_the_other_joints_keep_contact(smooth, visible):
    for name, number in (("input.backlash", 1), ("output.backlash", 2)):
        r = motion(smooth.with_effects(visible(name)))
        other = 3 - number
        joint = (smooth.input_joint, smooth.output_joint)[other - 1]
        expected = joint.stiffness * r[f"deflection_{other}"] + joint.damping * r[f"deflection_rate_{other}"]
        np.testing.assert_allclose(r[f"torque_{other}"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_play_lets_the_table_be_free(smooth, visible):
    """Inside the play of joint 2 nothing but the load torque turns the table: φ̈ = -T_L/J_t."""
    r = motion(smooth.with_effects(visible("output.backlash", backlash=4e-3)))
    free = r["region_2"] == 0.0
    assert free.sum() > 20
    np.testing.assert_allclose(r["table_acceleration"][free], -2.0 / 5.0, rtol=1e-12)
    assert np.abs(motion(smooth)["region_2"]).min() == 1.0


# -------------------------------------------------------------------------------- hardening


@pytest.mark.parametrize("play", [0.0, 2e-3])
@pytest.mark.parametrize("law", ["clipped", "kelvin_voigt"])
def test_hardening_adds_the_cube_of_the_deflection_in_contact(smooth, visible, play, law):
    effect = visible("output.cubic_stiffness")
    joint = dataclasses.replace(smooth.output_joint, backlash=play)
    machine = dataclasses.replace(smooth, output_joint=joint, contact_law=law).with_effects(effect)
    r = motion(machine)
    contact = r["region_2"] != 0.0
    x = r["deflection_2"] - 0.5 * play * r["region_2"]
    if play == 0.0:
        x = r["deflection_2"]
    linear = joint.stiffness * x + joint.damping * r["deflection_rate_2"]
    expected = np.where(contact, linear + effect.stiffness * x**3, 0.0)
    np.testing.assert_allclose(r["torque_2"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert np.abs(effect.stiffness * x**3)[contact].max() > 0.01 * np.abs(linear).max()
    assert contact.all() == (play == 0.0)


@pytest.mark.parametrize("amplitude", [1.0, 2.0])
def test_hardening_raises_the_frequency_with_the_amplitude_squared(smooth, visible, amplitude):
    """Undamped Duffing vibration of Model A in its dwell: ω² = ω0² (1 + ¾ k_c A²/k) to first order."""
    joint = dataclasses.replace(smooth.output_joint, damping=0.0)
    machine = dataclasses.replace(smooth, model="A", output_joint=joint, motion_share=0.1)
    point = OperatingPoint(motor_speed=amplitude * 20.0, load_torque=0.0)
    run = Run(samples=4000, sample_rate=2000.0, warmup_turns=0, channels=("deflection_2", "deflection_rate_2"))
    dwell = int(0.1 * 2000.0 * machine.turn_duration(point) / 8.0) + 5

    def vibration(m: Machine) -> tuple[float, float]:
        channels = simulate(m, point, run).channels
        d, v = channels["deflection_2"][dwell:], channels["deflection_rate_2"][dwell:]
        up = np.flatnonzero((d[:-1] < 0.0) & (d[1:] >= 0.0))
        crossings = (up - d[up] / (0.5 * (v[up] + v[up + 1])) * 2000.0) / 2000.0
        return 2.0 * math.pi / float(np.diff(crossings).mean()), float(np.abs(d).max())

    omega, _ = vibration(machine)
    assert omega == pytest.approx(math.sqrt(joint.stiffness / 5.0), rel=1e-4)
    stiffness = 0.1 * joint.stiffness / vibration(machine)[1] ** 2
    hardened, size = vibration(machine.with_effects(visible("output.cubic_stiffness", stiffness=stiffness)))
    rise = 0.75 * stiffness * size**2 / joint.stiffness
    assert rise > 0.03
    assert (hardened / omega) ** 2 - 1.0 == pytest.approx(rise, rel=0.05)


# -------------------------------------------------------------------------------- loose base


def test_a_loose_base_rings_at_the_new_mode(smooth, visible):
    """In the dwell the housing rings at the two modes of table and housing, one of them new."""
    effect = visible("base.looseness", compliance=1.0 / 3e5, damping_ratio=0.002)
    joint = dataclasses.replace(smooth.output_joint, damping=2.0)
    machine = dataclasses.replace(smooth, output_joint=joint).with_effects(effect)
    point = OperatingPoint(motor_speed=1e-6, load_torque=10.0, start_angle=1.5 * math.pi)
    run = Run(samples=4000, warmup_turns=0, channels=("housing_acceleration",))
    values = simulate(machine, point, run).channels["housing_acceleration"]
    spectrum = np.abs(np.fft.rfft(values * np.blackman(4000), 2**17))
    frequencies = natural_frequencies(machine, 1.5 * math.pi).frequency_hz[0]
    assert len(frequencies) == 3 and natural_frequencies(smooth, 0.0).frequency_hz.shape[1] == 2
    cam = np.argmin(np.abs(frequencies - 20.13))
    place = np.arange(len(spectrum)) * 1000.0 / 2**17
    for frequency in np.delete(frequencies, cam):
        near = np.abs(place - frequency) < 0.1 * frequency
        assert place[near][spectrum[near].argmax()] == pytest.approx(frequency, rel=0.004)


def test_a_loose_base_moves_as_its_stiffness_damping_and_play_say(smooth, visible):
    effect = visible("base.looseness", compliance=1.0 / 2e5, damping_ratio=0.1, backlash=1e-3)
    r = motion(smooth.with_effects(effect))
    damping = 2.0 * 0.1 * math.sqrt(2e5 * (smooth.housing_inertia + smooth.follower_inertia))
    d, v = r["deflection_3"], r["deflection_rate_3"]
    assert (r["housing_angle"] == d).all() and set(r["region_3"]) == {-1.0, 0.0, 1.0}
    pushing = 2e5 * (np.abs(d) - 0.5e-3) + damping * np.sign(d) * v
    expected = np.where(np.abs(d) > 0.5e-3, np.sign(d) * np.maximum(pushing, 0.0), 0.0)
    np.testing.assert_allclose(r["torque_3"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_tight_base_does_not_move(smooth):
    r = motion(smooth)
    for name in ("housing_angle", "housing_acceleration", "deflection_3", "torque_3"):
        assert (r[name] == 0.0).all()


def test_model_b_is_the_limit_of_a_stiff_base(smooth, visible):
    """The difference falls in proportion to the compliance. Quiet start: the step of T_L would ring the base."""
    point = OperatingPoint(load_torque=0.0)
    run = Run(samples=300, warmup_turns=0, step=0.02e-3)
    model_b = simulate(smooth, point, run).table_acceleration
    gaps = []
    for stiffness in (1e6, 1e7, 1e8):
        loose = smooth.with_effects(visible("base.looseness", compliance=1.0 / stiffness, damping_ratio=0.3))
        gaps.append(np.sqrt(np.mean((simulate(loose, point, run).table_acceleration - model_b) ** 2)))
    assert gaps[0] > 1e-3 * np.sqrt(np.mean(model_b**2))
    for wide, narrow in itertools.pairwise(gaps):
        assert wide / narrow == pytest.approx(10.0, rel=0.1)
