"""Slip, ripples and mesh show at the motor's orders and in the motor's speed, and nowhere when they are off."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from indexer_env.drive_sensors import DriveSensors
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference import simulate_reference
from indexer_env.simulate import Run, simulate

POINT = OperatingPoint()
SIDES = ("input", "output")
CHANNELS = (
    "cam_angle", "cam_rate", "cam_acceleration", "motor_angle", "motor_rate", "motor_acceleration",
    "table_acceleration", "deflection_1", "deflection_rate_1", "torque_1",
)  # fmt: skip
TURN = 8200
MOTOR_TURNS = 205
"""In one table turn: 25.625 motor turns for each of 8 stations. So order 1 of the motor is line 205 of the table turn,
which is no multiple of 8: a machine that repeats at every station has nothing there."""


@functools.lru_cache(maxsize=64)
def turn_of(machine: Machine, point: OperatingPoint = POINT) -> dict[str, np.ndarray]:
    """One settled table turn at 1 kHz."""
    trajectory = simulate(machine, point, Run(warmup_turns=6, channels=CHANNELS))
    assert trajectory.warmup is not None and trajectory.warmup.settled
    return trajectory.channels


def lines(values: np.ndarray) -> np.ndarray:
    """Amplitudes at 0, 1, 2 … per table turn."""
    return 2.0 * np.abs(np.fft.rfft(values)) / len(values)


def drive_error(machine: Machine, record: dict[str, np.ndarray]) -> np.ndarray:
    """How far the drive side of joint 1 is ahead of τγ [rad], from deflection and cam angle."""
    return record["deflection_1"] + record["cam_angle"] - machine.reduction * record["motor_angle"]


# -------------------------------------------------------------------------------- slip


@pytest.mark.parametrize("load", [400.0, 2.0, -400.0])
def test_slip_takes_speed_in_proportion_to_the_motor_torque(smooth, visible, load):
    """Over a settled turn J_m γ̈ is zero in the mean: ω_s - <γ̇> = c τ <M1>."""
    effect, point = visible("drive.slip"), OperatingPoint(load_torque=load)
    machine = smooth.with_effects(effect)
    run = Run(samples=9000, warmup_turns=14, channels=("motor_rate", "torque_1", "cam_angle"))
    trajectory = simulate(machine, point, run)
    assert trajectory.warmup is not None and trajectory.warmup.settled
    cam = trajectory.channels["cam_angle"]
    whole_turn = cam - cam[0] < 2.0 * math.pi * machine.stations
    record = {name: values[whole_turn] for name, values in trajectory.channels.items()}
    assert not whole_turn.all()
    lost = point.motor_speed - record["motor_rate"].mean()
    expected = effect.compliance * machine.reduction * record["torque_1"].mean()
    assert lost == pytest.approx(expected, rel=1e-3, abs=1e-6)
    if abs(load) > 100.0:
        # the table's load, through the index: <M1> = T_L h/2π, and joint losses
        assert lost == pytest.approx(effect.compliance * machine.reduction * load / 8.0, rel=0.05)
        assert lost * load > 0.0


def test_a_slipping_motor_obeys_its_own_equation(smooth, visible):
    effect = visible("drive.slip")
    machine = smooth.with_effects(effect)
    r = turn_of(machine)
    net = (POINT.motor_speed - r["motor_rate"]) / effect.compliance - machine.reduction * r["torque_1"]
    np.testing.assert_allclose(machine.motor_inertia * r["motor_acceleration"], net, atol=1e-10)
    assert np.ptp(r["motor_rate"]) > 0.1


RIPPLING = {
    "drive.transmission_error": {"amplitude": 5e-3, "order": 3.0, "phase": 0.4},
    "drive.speed_ripple": {"depth": 0.05, "phase": -0.3},
}


@pytest.mark.parametrize("names", [list(RIPPLING)[:1], list(RIPPLING)[1:], list(RIPPLING)])
def test_a_machine_that_nothing_drives_or_damps_keeps_its_energy(smooth, visible, names):
    """A motor that a compliance of 1e9 lets go: what ripples on the drive takes from the motor what it gives the cam.
    Up to 5 % of the energy came from nowhere."""
    undamped = {f"{side}_joint": dataclasses.replace(getattr(smooth, f"{side}_joint"), damping=0.0) for side in SIDES}
    free = dataclasses.replace(smooth, motor_inertia=5.0, **undamped).with_effects(
        visible("drive.slip", compliance=1e9), *(visible(name, **RIPPLING[name]) for name in names)
    )
    channels = ("cam_rate", "table_rate", "motor_rate", "deflection_1", "deflection_2", "deflection_rate_2")
    run = Run(samples=1500, warmup_turns=0, step=0.25e-3, channels=channels)
    r = simulate(free, OperatingPoint(load_torque=0.0), run).channels
    follower = r["table_rate"] - r["deflection_rate_2"]
    inertias = free.cam_inertia, free.follower_inertia, free.table_inertia, free.motor_inertia
    rates = r["cam_rate"], follower, r["table_rate"], r["motor_rate"]
    energy = sum(0.5 * inertia * rate**2 for inertia, rate in zip(inertias, rates, strict=True))
    energy += 0.5 * free.input_joint.stiffness * r["deflection_1"] ** 2
    energy += 0.5 * free.output_joint.stiffness * r["deflection_2"] ** 2
    exchanged = np.ptp(0.5 * free.motor_inertia * r["motor_rate"] ** 2)
    assert np.abs(energy - energy[0]).max() < 2e-6 * exchanged


@pytest.mark.parametrize("name", list(RIPPLING))
def test_a_slipping_motor_that_ripples_is_the_references(smooth, visible, name):
    machine = smooth.with_effects(visible("drive.slip"), visible(name, **RIPPLING[name]))
    expected = simulate_reference(machine, POINT, samples=300, channels=("motor_rate",)).channels["motor_rate"]
    found = simulate(machine, POINT, Run(samples=300, warmup_turns=0, channels=("motor_rate",)))
    assert np.abs(found.channels["motor_rate"] - expected).max() < 1e-6 * np.ptp(expected)


def test_the_motors_torque_is_read_with_what_ripples_on_the_drive(smooth, visible):
    """The torque on the shaft is what the slip lets through: (ω_s - γ̇)/c."""
    sensors = DriveSensors(signals=("motor_torque",))
    slip, waves = visible("drive.slip"), (visible(name, **RIPPLING[name]) for name in RIPPLING)
    machine = smooth.with_effects(slip, *waves)
    run = Run(samples=600, warmup_turns=0, channels=(*sensors.channels, "motor_rate"))
    r = simulate(machine, POINT, run).channels
    drawn = (POINT.motor_speed - r["motor_rate"]) / slip.compliance
    np.testing.assert_allclose(sensors.read(machine, r, 1000.0)["motor_torque"], drawn, rtol=1e-4, atol=1e-4)


def test_without_slip_the_motor_keeps_its_speed(smooth):
    record = turn_of(smooth, OperatingPoint(load_torque=400.0))
    assert np.ptp(record["motor_rate"]) == 0.0 and record["motor_rate"][0] == POINT.motor_speed
    assert (record["motor_acceleration"] == 0.0).all()


# -------------------------------------------------------------------------------- displacement of the drive side


@pytest.mark.parametrize(("order", "phase"), [(1.0, 0.0), (2.0, 0.6), (0.4, -1.0)])
def test_speed_ripple_is_the_kinematics_of_its_shaft(smooth, visible, order, phase):
    """Angle ahead: τ (depth/order) sin(order γ + phase)."""
    machine = smooth.with_effects(visible("drive.speed_ripple", depth=0.05, order=order, phase=phase))
    record = turn_of(machine)
    expected = machine.reduction * 0.05 / order * np.sin(order * record["motor_angle"] + phase)
    np.testing.assert_allclose(drive_error(machine, record), expected, rtol=0, atol=1e-11)
    plain = turn_of(smooth)
    assert np.abs(drive_error(smooth, plain)).max() < 1e-11


@pytest.mark.parametrize(("order", "phase"), [(2.0, 0.0), (7.0, 0.6)])
def test_transmission_error_is_a_displacement_at_its_order(smooth, visible, order, phase):
    machine = smooth.with_effects(visible("drive.transmission_error", amplitude=1e-3, order=order, phase=phase))
    record = turn_of(machine)
    expected = 1e-3 * np.sin(order * record["motor_angle"] + phase)
    np.testing.assert_allclose(drive_error(machine, record), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", ["drive.speed_ripple", "drive.transmission_error", "drive.mesh_stiffness"])
@pytest.mark.parametrize("order", [1.0, 2.0])
def test_lines_stand_at_the_motor_order_and_its_cam_sidebands_alone(smooth, visible, name, order):
    """f = order · motor speed, ± multiples of the cam's speed: the machine it goes through repeats so."""
    spectrum = lines(turn_of(smooth.with_effects(visible(name, order=order)))["cam_acceleration"])[:1000]
    place = np.arange(len(spectrum))
    line = round(order * MOTOR_TURNS)
    at_order = (place - line) % 8 == 0
    mirrored = (place + line) % 8 == 0
    others = (place % 8 != 0) & ~at_order & ~mirrored
    lowest = spectrum[at_order & (place > 8)].max()
    assert lowest > 1.0
    # Twice the order and its sidebands are of second order in the amplitude.
    doubled = ((place - 2 * line) % 8 == 0) | ((place + 2 * line) % 8 == 0)
    assert spectrum[others & ~doubled].max() < 0.02 * lowest
    plain = lines(turn_of(smooth)["cam_acceleration"])[:1000]
    assert plain[place % 8 != 0].max() < 1e-4


@pytest.mark.parametrize("name", ["drive.speed_ripple", "drive.transmission_error"])
def test_the_strongest_line_is_the_motor_order_itself(smooth, visible, name):
    record = turn_of(smooth.with_effects(visible(name, order=2.0)))
    deflection = lines(record["deflection_1"] - turn_of(smooth)["deflection_1"])
    assert deflection.argmax() == 2 * MOTOR_TURNS


@pytest.mark.parametrize("name", ["drive.speed_ripple", "drive.transmission_error"])
@pytest.mark.parametrize("order", [0.5, 1.0, 3.0])
def test_in_the_dwell_the_cam_answers_as_one_degree_of_freedom(smooth, visible, name, order):
    """|α/u| = |k + iωr| / |k - J_C ω² + iωr| for a drive side that moves by u."""
    joint = dataclasses.replace(smooth.input_joint, damping=60.0)
    effect = visible(name, order=order)
    machine = dataclasses.replace(smooth, input_joint=joint).with_effects(effect)
    point = OperatingPoint(start_angle=1.01 * math.pi)
    record = simulate(machine, point, Run(samples=500, warmup_turns=0, channels=("cam_acceleration",))).channels
    omega = order * point.motor_speed
    moved = effect.amplitude if name.endswith("error") else 0.05 / order * machine.reduction
    stiffness = joint.stiffness + 1j * omega * joint.damping
    expected = moved * omega**2 * abs(stiffness / (stiffness - machine.cam_inertia * omega**2))
    time = np.arange(500)[250:] / 1000.0
    basis = np.column_stack([np.cos(omega * time), np.sin(omega * time)])
    (a, b), *_ = np.linalg.lstsq(basis, record["cam_acceleration"][250:], rcond=None)
    assert math.hypot(a, b) == pytest.approx(expected, rel=1e-3)


# -------------------------------------------------------------------------------- mesh stiffness


@pytest.mark.parametrize(("order", "phase"), [(2.0, 0.0), (1.0, 0.6)])
def test_mesh_stiffness_is_a_factor_on_joint_1(smooth, visible, order, phase):
    def factor(machine: Machine) -> tuple[np.ndarray, np.ndarray]:
        r = turn_of(machine)
        plain = 8000.0 * r["deflection_1"] + smooth.input_joint.damping * r["deflection_rate_1"]
        loaded = np.abs(plain) > 1.0
        return (r["torque_1"] / plain)[loaded], r["motor_angle"][loaded]

    ratio, angle = factor(smooth.with_effects(visible("drive.mesh_stiffness", order=order, phase=phase)))
    np.testing.assert_allclose(ratio, 1.0 + 0.3 * np.cos(order * angle + phase), rtol=0, atol=1e-9)
    np.testing.assert_allclose(factor(smooth)[0], 1.0, rtol=0, atol=1e-11)


def test_mesh_stiffness_needs_torque_to_show(smooth, visible):
    """Parametric, not forced: without load the machine in its dwell stays at rest, unlike with a transmission error."""
    point = OperatingPoint(load_torque=0.0, start_angle=1.01 * math.pi)
    run = Run(samples=400, warmup_turns=0, channels=("cam_acceleration",))
    meshing, wavering = (
        simulate(smooth.with_effects(visible(name)), point, run).channels["cam_acceleration"]
        for name in ("drive.mesh_stiffness", "drive.transmission_error")
    )
    assert np.abs(meshing).max() < 1e-6
    assert np.abs(wavering).max() > 1.0


# -------------------------------------------------------------------------------- mesh friction


def test_mesh_friction_takes_its_share_of_the_torque_whichever_side_drives(smooth, visible):
    """Loss 0.2: the cam gets 80 % of what the motor gives, and the motor 2 - 1/0.8 = 75 % of what the cam gives."""
    r = turn_of(smooth.with_effects(visible("drive.mesh_friction")))
    joint = smooth.input_joint
    at_motor = joint.stiffness * r["deflection_1"] + joint.damping * r["deflection_rate_1"]
    driven, driving = r["deflection_1"] > 0.0, r["deflection_1"] < 0.0
    assert driven.any() and driving.any()
    np.testing.assert_allclose(r["torque_1"][driven], 0.8 * at_motor[driven], rtol=1e-12)
    np.testing.assert_allclose(at_motor[driving], 0.75 * r["torque_1"][driving], rtol=1e-12)


@pytest.mark.parametrize("backlash", [0.0, 2e-3])
def test_a_slipping_motor_feels_the_torque_before_the_mesh(smooth, visible, backlash):
    """Slip and mesh friction together, with and without play: the reference solver."""
    joint = dataclasses.replace(smooth.input_joint, backlash=backlash)
    both = visible("drive.slip"), visible("drive.mesh_friction")
    machine = dataclasses.replace(smooth, input_joint=joint).with_effects(*both)
    point = OperatingPoint()
    expected = simulate_reference(machine, point, samples=400, channels=("motor_rate",)).channels["motor_rate"]
    found = simulate(machine, point, Run(samples=400, warmup_turns=0, channels=("motor_rate",)))
    assert np.abs(found.channels["motor_rate"] - expected).max() < 1e-6 * np.ptp(expected)


@pytest.mark.parametrize(("law", "backlash"), [("clipped", 0.0), ("clipped", 2e-3), ("damped_play", 2e-3)])
def test_the_motors_torque_is_read_before_the_mesh(smooth, visible, law, backlash):
    joint = dataclasses.replace(smooth.input_joint, backlash=backlash)
    plain = dataclasses.replace(smooth, input_joint=joint, contact_law=law)
    sensors = DriveSensors(signals=("motor_torque",))
    run = Run(samples=900, warmup_turns=0, channels=(*sensors.channels, "deflection_1", "deflection_rate_1"))
    machine = plain.with_effects(visible("drive.mesh_friction"))
    r = simulate(machine, POINT, run).channels
    side = r["region_1"]
    carried = joint.stiffness * (r["deflection_1"] - 0.5 * side * backlash)
    torque = np.where(side == 0.0, 0.0, carried) + joint.damping * r["deflection_rate_1"]
    if law == "clipped":
        torque[side == 0.0] = 0.0
    assert set(np.unique(side)) >= {-1.0, 1.0}
    read = sensors.read(machine, r, 1000.0)["motor_torque"]
    np.testing.assert_allclose(read, smooth.reduction * torque, rtol=1e-5, atol=1e-6)
