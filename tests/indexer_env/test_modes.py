"""Natural frequencies and damping ratios: closed forms, and what a free decay of the simulated machine shows."""

import dataclasses
import math
import re

import numpy as np
import pytest
from scipy.signal.windows import blackmanharris

from indexer_env.coefficients import coefficients
from indexer_env.errors import ParameterError
from indexer_env.machine import Joint, Machine
from indexer_env.modes import LARGEST_DECAY_STEP, LARGEST_PHASE_STEP, largest_steps, natural_frequencies, quick_steps
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate, simulate_batch

DWELL, MID_MOTION = 1.5 * math.pi, 0.5 * math.pi
STILL = 1e-6
"""rad/s; a motor so slow that the cam stands still while the machine rings."""


@pytest.fixture
def on_base(smooth) -> Machine:
    return dataclasses.replace(smooth, model="B_on_base", base_joint=Joint(stiffness=2e5, damping=200.0))


def hertz(stiffness: float, inertia: float) -> float:
    return math.sqrt(stiffness / inertia) / (2.0 * math.pi)


def ratio(joint: Joint, inertia: float) -> float:
    return joint.damping / (2.0 * math.sqrt(joint.stiffness * inertia))


# -------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("angle", [0.0, MID_MOTION, DWELL, 123.4])
def test_model_a_has_one_mode_at_every_cam_angle(smooth, angle):
    modes = natural_frequencies(dataclasses.replace(smooth, model="A"), angle)
    assert modes.frequency_hz.shape == modes.damping_ratio.shape == (1, 1)
    assert modes.frequency_hz[0, 0] == pytest.approx(hertz(44413.22, 5.0), rel=1e-12)
    assert modes.damping_ratio[0, 0] == pytest.approx(ratio(smooth.output_joint, 5.0), rel=1e-12)


def test_in_the_dwell_the_joints_of_model_b_vibrate_apart(smooth):
    modes = natural_frequencies(smooth, DWELL)
    expected = sorted(
        [(hertz(44413.22, 5.0), ratio(smooth.output_joint, 5.0)), (hertz(8000.0, 0.5), ratio(smooth.input_joint, 0.5))]
    )
    np.testing.assert_allclose(modes.frequency_hz[0], [f for f, _ in expected], rtol=1e-12)
    np.testing.assert_allclose(modes.damping_ratio[0], [z for _, z in expected], rtol=1e-12)


def test_in_the_dwell_the_base_carries_the_table_as_a_two_mass_chain(on_base):
    """J_t on k2 on J_F + J_b on k3: ω² from the quadratic J_t J ω⁴ - (J_t (k2 + k3) + J k2) ω² + k2 k3 = 0."""
    k2, k3, table = on_base.output_joint.stiffness, on_base.base_joint.stiffness, on_base.table_inertia
    housing = on_base.housing_inertia + on_base.follower_inertia
    squares = np.roots([table * housing, -(table * (k2 + k3) + housing * k2), k2 * k3])
    expected = sorted([*np.sqrt(squares) / (2.0 * math.pi), hertz(8000.0, 0.5)])
    np.testing.assert_allclose(natural_frequencies(on_base, DWELL).frequency_hz[0], expected, rtol=1e-10)


def test_mid_motion_model_b_is_a_two_mass_chain_through_the_law(smooth):
    """β' = Cv h/(2π f) at the steepest point of modified sine; K = [[k1 + β'² k2, -β' k2], [-β' k2, k2]]."""
    slope = 1.759603 * (math.pi / 4.0) / math.pi
    k1, k2 = smooth.input_joint.stiffness, smooth.output_joint.stiffness
    cam, table = smooth.cam_inertia + smooth.follower_inertia * slope**2, smooth.table_inertia
    squares = np.roots([cam * table, -(cam * k2 + table * (k1 + slope**2 * k2)), k1 * k2])
    expected = np.sort(np.sqrt(squares) / (2.0 * math.pi))
    np.testing.assert_allclose(natural_frequencies(smooth, MID_MOTION).frequency_hz[0], expected, rtol=1e-6)


def test_many_angles_at_once_are_each_angle_alone(on_base):
    angles = np.linspace(0.0, 2.0 * math.pi, 17)
    modes = natural_frequencies(on_base, angles)
    assert modes.cam_angle.shape == (17,) and modes.frequency_hz.shape == modes.damping_ratio.shape == (17, 3)
    assert (np.diff(modes.frequency_hz, axis=1) > 0.0).all()
    for n, angle in enumerate(angles):
        np.testing.assert_allclose(natural_frequencies(on_base, angle).frequency_hz[0], modes.frequency_hz[n])


def test_effects_that_change_stiffness_enter(smooth, visible):
    loose = natural_frequencies(smooth.with_effects(visible("base.looseness")), DWELL)
    by_hand = dataclasses.replace(smooth, model="B_on_base", base_joint=Joint(3e6, 2 * 0.05 * math.sqrt(3e6 * 20.3)))
    np.testing.assert_allclose(loose.frequency_hz, natural_frequencies(by_hand, DWELL).frequency_hz, rtol=1e-12)
    np.testing.assert_allclose(loose.damping_ratio, natural_frequencies(by_hand, DWELL).damping_ratio, rtol=1e-12)


# -------------------------------------------------------------------------------- against motion


def ringing(machine: Machine, angle: float, channel: str, seconds: float = 4.0) -> np.ndarray:
    """Free decay after the load torque is put on the standing machine."""
    point = OperatingPoint(motor_speed=STILL, load_torque=1.0, start_angle=angle)
    run = Run(samples=round(seconds * 1000), warmup_turns=0, channels=(channel,))
    return simulate(machine, point, run).channels[channel]


def spectral_peaks(values: np.ndarray) -> list[float]:
    """Frequencies of the spectrum's local maxima, down to a thousandth of the largest [Hz]."""
    size = 2**17
    spectrum = np.abs(np.fft.rfft(values * blackmanharris(len(values)), size))
    inner = spectrum[1:-1]
    peak = (inner > spectrum[:-2]) & (inner > spectrum[2:]) & (inner > 1e-3 * spectrum.max())
    return [float(n + 1) * 1000.0 / size for n in np.flatnonzero(peak)]


@pytest.mark.parametrize("angle", [DWELL, MID_MOTION, 0.8])
@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
def test_a_free_decay_peaks_at_the_natural_frequencies(on_base, model, angle):
    light = {
        name: dataclasses.replace(getattr(on_base, name), damping=0.05 * getattr(on_base, name).damping)
        for name in ("input_joint", "output_joint", "base_joint")
    }
    machine = dataclasses.replace(on_base, model=model, **light)
    frequencies = natural_frequencies(machine, angle).frequency_hz[0]
    if model != "A" and angle == DWELL:
        frequencies = np.delete(
            frequencies, np.argmin(np.abs(frequencies - hertz(8000.0, 0.5)))
        )  # nothing moves the cam
    seen = spectral_peaks(ringing(machine, angle, "table_acceleration"))
    for frequency in frequencies:
        assert min(abs(peak - frequency) for peak in seen) < 0.004 * frequency
    for peak in seen:
        assert np.abs(frequencies - peak).min() < 0.004 * peak


@pytest.mark.parametrize("damping_ratio", [0.01, 0.03, 0.1])
def test_damping_ratio_is_that_of_the_logarithmic_decrement(smooth, damping_ratio):
    joint = dataclasses.replace(smooth.output_joint, damping=2.0 * damping_ratio * math.sqrt(44413.22 * 5.0))
    machine = dataclasses.replace(smooth, output_joint=joint)
    values = ringing(machine, DWELL, "table_rate", seconds=3.0)
    place = np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))[:6] + 1
    low, mid, high = values[place - 1], values[place], values[place + 1]
    peaks = mid + (high - low) ** 2 / (8.0 * (2.0 * mid - low - high))
    decrement = np.log(peaks[:-1] / peaks[1:]).mean()
    ratios = natural_frequencies(machine, DWELL).damping_ratio[0]
    seen = decrement / math.hypot(2.0 * math.pi, decrement)
    assert seen == pytest.approx(damping_ratio, rel=2e-3)
    assert np.abs(ratios - seen).min() < 2e-3 * seen


def test_model_a_in_its_dwell_answers_a_step_as_the_textbook_says(smooth):
    """J φ̈ + r φ̇ + k (φ - β) = -T: φ̈ = -(T/J) e^(-ζωt) (cos ω_d t - ζω/ω_d sin ω_d t)."""
    machine, point = dataclasses.replace(smooth, model="A"), OperatingPoint(load_torque=7.0, start_angle=1.01 * math.pi)
    time = np.arange(400) / 1000.0
    omega = math.sqrt(44413.22 / 5.0)
    decay = smooth.output_joint.damping / (2.0 * 5.0)
    damped = math.sqrt(omega**2 - decay**2)
    expected = -7.0 / 5.0 * np.exp(-decay * time) * (np.cos(damped * time) - decay / damped * np.sin(damped * time))
    for step, tolerance in ((0.25e-3, 2e-7), (1e-3, 5e-5)):
        record = simulate(machine, point, Run(samples=400, warmup_turns=0, step=step)).table_acceleration
        np.testing.assert_allclose(record, expected, rtol=0, atol=1.4 * tolerance)


# -------------------------------------------------------------------------------- the step


def test_the_largest_step_follows_the_fastest_mode(smooth):
    fastest = (
        2.0 * math.pi * max(natural_frequencies(smooth, angle).frequency_hz.max() for angle in (DWELL, MID_MOTION))
    )
    assert largest_steps([coefficients(smooth, OperatingPoint())])[0] == pytest.approx(
        LARGEST_PHASE_STEP / fastest, rel=1e-3
    )


def test_the_largest_step_follows_the_fastest_decay(smooth, visible):
    creep = smooth.with_effects(visible("friction.coulomb", torque=50.0, smoothing=1e-4))
    expected = LARGEST_DECAY_STEP / (50.0 / 1e-4 / 5.0)
    assert largest_steps([coefficients(creep, OperatingPoint())])[0] == pytest.approx(expected, rel=1e-12)
    slip = smooth.with_effects(visible("drive.slip", compliance=1e-3))
    assert largest_steps([coefficients(slip, OperatingPoint())])[0] == pytest.approx(1e-3 * 0.01, rel=1e-12)


def test_the_largest_step_is_that_of_the_flank_on_which_friction_adds_to_the_torque(smooth, visible):
    """Loss 0.2: the table drives the motor through an efficiency of 0.75."""
    stiffer = dataclasses.replace(
        smooth.input_joint, stiffness=smooth.input_joint.stiffness / 0.75, damping=smooth.input_joint.damping / 0.75
    )
    expected, found = (
        largest_steps([coefficients(machine, OperatingPoint())])[0]
        for machine in (
            dataclasses.replace(smooth, input_joint=stiffer), smooth.with_effects(visible("drive.mesh_friction"))
        )
    )  # fmt: skip
    assert found == pytest.approx(expected, rel=1e-9)
    assert found < largest_steps([coefficients(smooth, OperatingPoint())])[0]


def test_the_quick_step_is_at_most_the_largest_and_not_much_less(smooth, on_base, visible):
    creep, slip = visible("friction.coulomb", torque=50.0), visible("drive.slip", compliance=1e-3)
    for machine in (
        smooth, dataclasses.replace(smooth, model="A"), on_base, smooth.with_effects(creep), smooth.with_effects(slip),
        smooth.with_effects(visible("drive.mesh_stiffness")), smooth.with_effects(visible("drive.mesh_friction")),
        on_base.with_effects(visible("base.looseness")),
    ):  # fmt: skip
        item = coefficients(machine, OperatingPoint())
        largest, limits = float(largest_steps([item])[0]), (LARGEST_PHASE_STEP, LARGEST_DECAY_STEP)
        quick = quick_steps(item.model, item.features, np.stack([item.row] * 2), item.law.steepest, 0.0, *limits)
        assert (0.6 * largest < quick).all() and (quick <= largest * (1.0 + 1e-9)).all()


def test_the_quick_step_resolves_the_orders_that_the_drive_has(smooth, visible):
    plain, rippling = (
        coefficients(machine, OperatingPoint())
        for machine in (smooth, smooth.with_effects(visible("drive.transmission_error", order=14.0)))
    )
    limits = plain.law.steepest, 150.0, 0.75, 2.0
    rows = np.stack([plain.row, rippling.row])
    without, having = quick_steps(plain.model, plain.features, rows, *limits)
    assert having == pytest.approx(0.75 / (14.0 * 150.0)) and without > 2.0 * having


def test_a_step_that_cannot_resolve_the_machine_is_one_sentence(smooth):
    joint = dataclasses.replace(smooth.output_joint, stiffness=1e8)
    machine, run = dataclasses.replace(smooth, output_joint=joint, name="stiff one"), Run(samples=20, warmup_turns=0)
    with pytest.raises(ParameterError) as caught:
        simulate(machine, run=run)
    found = re.fullmatch(
        r"Run\.step must be <= (\S+) s to resolve the fastest mode of stiff one \(phase per step <= 0\.25 rad\), "
        r"got 0\.00025 s; set step to (\S+)\.",
        str(caught.value),
    )
    assert found is not None, caught.value
    assert float(found[1]) == pytest.approx(largest_steps([coefficients(machine, OperatingPoint())])[0], rel=5e-3)
    remedied = simulate(machine, run=dataclasses.replace(run, step=float(found[2])))
    assert np.isfinite(remedied.table_acceleration).all()
    batch = simulate_batch([smooth, machine], run=run)
    assert batch.rejected == {1: str(caught.value)}


def test_the_step_used_is_the_sampling_interval_over_a_whole_number():
    for sample_rate, step, parts in ((1000.0, 0.25e-3, 4), (1000.0, 0.3e-3, 4), (1000.0, 1.0, 1), (300.0, 1e-3, 4)):
        assert Run(sample_rate=sample_rate, step=step).steps_per_sample(math.nan) == parts
