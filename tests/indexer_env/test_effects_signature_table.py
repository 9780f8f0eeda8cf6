"""Friction and loads of the table show where theory says they must, and nowhere when they are off."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate

POINT = OperatingPoint()
CHANNELS = (
    "cam_angle", "table_angle", "table_rate", "table_acceleration", "motor_rate", "torque_1", "torque_2", "torque_3",
    "deflection_rate_1", "deflection_rate_2", "deflection_rate_3",
)  # fmt: skip
TURN = 8200
STATION = TURN // 8


@functools.lru_cache(maxsize=64)
def turn_of(machine: Machine, point: OperatingPoint = POINT) -> dict[str, np.ndarray]:
    """One settled table turn at 1 kHz."""
    trajectory = simulate(machine, point, Run(warmup_turns=4, channels=CHANNELS))
    assert trajectory.warmup is not None and trajectory.warmup.settled
    return trajectory.channels


def load_on_table(machine: Machine, record: dict[str, np.ndarray], point: OperatingPoint = POINT) -> np.ndarray:
    """What opposes the table beside T_L and joint 2, from Newton's law alone: -J_t φ̈ - M2 - T_L [N m]."""
    return -machine.table_inertia * record["table_acceleration"] - record["torque_2"] - point.load_torque


def pulse(turns: np.ndarray, centre: float, half_width: float) -> np.ndarray:
    y = ((turns - centre + 0.5) % 1.0 - 0.5) / half_width
    return np.where(np.abs(y) < 1.0, (1.0 - y**2) ** 4, 0.0)


EQUATIONS = {
    "friction.coulomb": lambda r: 20.0 * (r["table_rate"] / 0.005) / np.hypot(1.0, r["table_rate"] / 0.005),
    "friction.viscous": lambda r: 15.0 * r["table_rate"],
    "friction.stribeck": lambda r: (
        20.0 / (1.0 + (r["table_rate"] / 0.1) ** 2) * (r["table_rate"] / 0.005) / np.hypot(1.0, r["table_rate"] / 0.005)
    ),
    "load.imbalance": lambda r: 30.0 * np.sin(r["table_angle"] + 0.4),
    "load.process": lambda r: 50.0 * pulse(r["cam_angle"] / (2.0 * math.pi), 0.75, 0.1),
}


@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
@pytest.mark.parametrize("name", EQUATIONS)
def test_the_load_on_the_table_is_that_of_the_equation(smooth, visible, name, model):
    base = dataclasses.replace(smooth.base_joint, stiffness=1e6, damping=1000.0)
    plain = dataclasses.replace(smooth, model=model, base_joint=base)
    machine = plain.with_effects(visible(name))
    record = turn_of(machine)
    expected = EQUATIONS[name](record)
    np.testing.assert_allclose(load_on_table(machine, record), expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert np.abs(load_on_table(plain, turn_of(plain))).max() < 1e-10


def test_loads_add_up(smooth, visible):
    machine = smooth.with_effects(*(visible(name) for name in EQUATIONS))
    record = turn_of(machine)
    expected = sum(equation(record) for equation in EQUATIONS.values())
    np.testing.assert_allclose(load_on_table(machine, record), expected, rtol=0, atol=1e-7)


# -------------------------------------------------------------------------------- friction


def work_of_drive(machine: Machine, speed: float) -> float:
    """Work that goes in through joint 1 in one settled turn: ∫ M1 τγ̇ dt [J]."""
    point = OperatingPoint(motor_speed=speed)
    trajectory = simulate(machine, point, Run(sample_rate=500.0, warmup_turns=4, channels=("torque_1",)))
    return float(trajectory.channels["torque_1"].mean()) * 2.0 * math.pi * machine.stations


def test_friction_work_tells_coulomb_from_viscous(smooth, visible):
    """Per turn Coulomb takes T_c 2π at any speed, viscous c ∫φ̇² dt: in proportion to the speed."""
    slow, fast = 25.0 * math.pi, 50.0 * math.pi
    extra = {
        name: [work_of_drive(smooth.with_effects(visible(name)), s) - work_of_drive(smooth, s) for s in (slow, fast)]
        for name in ("friction.coulomb", "friction.viscous")
    }
    coulomb, viscous = extra["friction.coulomb"], extra["friction.viscous"]
    assert coulomb[0] == pytest.approx(20.0 * 2.0 * math.pi, rel=0.05)
    assert coulomb[1] == pytest.approx(coulomb[0], rel=0.1)
    # ∫φ̇² dt of modified sine over a turn: 8 (h²/T) ∫ v² = 8 h² 1.3636/T, T half of the cam turn
    motion_time = 0.5 * 8.2 / 8.0
    assert viscous[1] == pytest.approx(15.0 * 8.0 * (math.pi / 4.0) ** 2 * 1.3636 / motion_time, rel=0.05)
    assert viscous[0] == pytest.approx(0.5 * viscous[1], rel=0.05)


def test_viscous_drag_winds_joint_2_up_in_proportion_to_the_speed(smooth, visible):
    """So slow that inertia counts for little: mid-motion δ2 changes by -c φ̇/k2."""
    point = OperatingPoint(motor_speed=5.0 * math.pi)
    run = Run(sample_rate=100.0, samples=600, warmup_turns=0, channels=("deflection_2", "table_rate"))
    drag = visible("friction.viscous")
    plain, dragged = (simulate(m, point, run).channels for m in (smooth, smooth.with_effects(drag)))
    middle = slice(230, 285)  # cam phase 0.25 is at 2.5625 s
    expected = -drag.coefficient * dragged["table_rate"][middle] / smooth.output_joint.stiffness
    np.testing.assert_allclose((dragged["deflection_2"] - plain["deflection_2"])[middle], expected, rtol=0.05)


def test_dry_friction_stops_the_ringing_early_in_the_dwell(smooth, visible):
    """Viscous damping leaves a share of the ringing, dry friction none once it is small."""
    late = slice(int(0.8 * STATION), int(0.97 * STATION))
    ringing = {
        name: np.abs(turn_of(machine)["table_rate"][late]).max()
        for name, machine in (("off", smooth), ("on", smooth.with_effects(visible("friction.coulomb"))))
    }
    assert ringing["on"] < 0.05 * ringing["off"]


def test_stribeck_friction_fades_with_speed(smooth, visible):
    machine = smooth.with_effects(visible("friction.stribeck"))
    record = turn_of(machine)
    friction, rate = load_on_table(machine, record), record["table_rate"]
    assert np.abs(friction[rate > 1.0]).max() < 0.01 * 20.0 * 1.01
    near = np.abs(rate - 0.1) < 0.02
    assert near.sum() > 10
    assert friction[near].mean() == pytest.approx(10.0, rel=0.1)


# -------------------------------------------------------------------------------- loads


def test_imbalance_turns_with_the_table(smooth, visible):
    """In the dwells joint 2 holds T_L + T sin(φ + phase): one harmonic per table turn, and no other."""
    effect = visible("load.imbalance")
    dwell = slice(int(0.75 * STATION), STATION)
    held = {}
    for machine in (smooth, smooth.with_effects(effect)):
        torque = turn_of(machine)["torque_2"].reshape(8, STATION)[:, dwell].mean(axis=1)
        held[machine] = np.fft.fft(torque) / 8.0
    plain, harmonics = held.values()
    assert np.abs(plain[1:]).max() < 1e-6
    assert 2.0 * abs(harmonics[1]) == pytest.approx(effect.torque, rel=5e-3)
    # φ = (n + 1) h in dwell n: -T sin(h n + h + phase) has the phase h + phase + π/2 at n = 0
    angle = np.angle(harmonics[1] * np.exp(-1j * (math.pi / 4.0 + effect.phase + math.pi / 2.0)))
    assert abs(angle) < 5e-3
    assert np.abs(harmonics[2:7]).max() < 2e-3 * effect.torque


def test_process_torque_is_held_by_joint_2_in_every_dwell(smooth, visible):
    effect = visible("load.process", centre=0.75, half_width=0.1)
    plain, pressed = turn_of(smooth), turn_of(smooth.with_effects(effect))
    added = (pressed["torque_2"] - plain["torque_2"]).reshape(8, STATION)
    # ∫(1-y²)⁴ dy over ±1 is 256/315; over a settled turn the mean of φ̈ is zero, so joint 2 takes all of it
    np.testing.assert_allclose(added.mean(axis=1), -effect.torque * 0.1 * 256.0 / 315.0, rtol=0.01)
    np.testing.assert_allclose(added, np.broadcast_to(added[0], added.shape), rtol=0, atol=1e-4)
    assert abs(np.abs(added[0]).argmax() / STATION - 0.75) < 0.1


def test_slow_process_torque_is_followed_statically(smooth, visible):
    point = OperatingPoint(motor_speed=5.0 * math.pi)
    effect = visible("load.process", half_width=0.2)
    machine = smooth.with_effects(effect)
    run = Run(sample_rate=100.0, samples=1025, warmup_turns=0, channels=("torque_2", "cam_angle"))
    record = simulate(machine, point, run).channels
    pressed = slice(600, 950)
    expected = -2.0 - effect.torque * pulse(record["cam_angle"][pressed] / (2.0 * math.pi), 0.75, 0.2)
    np.testing.assert_allclose(record["torque_2"][pressed], expected, rtol=0, atol=0.02 * effect.torque)


# -------------------------------------------------------------------------------- energy


@pytest.mark.parametrize(
    "name",
    [
        None, "friction.coulomb", "friction.viscous", "friction.stribeck", "load.imbalance", "load.process",
        "drive.slip", "cam.station_spacing", "roller.crack", "roller.crack_single", "output.cubic_stiffness",
        "base.looseness",
    ],
)  # fmt: skip
def test_over_a_settled_turn_the_drive_pays_for_losses_and_loads(smooth, visible, name):
    """∮ M1 τγ̇ dt = ∮ (Σ M_j δ̇_j + (T_L + friction and loads) φ̇) dt: kinetic energy returns to where it was."""
    machine = smooth if name is None else smooth.with_effects(visible(name))
    r = turn_of(machine)
    put_in = r["torque_1"] * r["motor_rate"] * machine.reduction
    lost = sum(r[f"torque_{n}"] * r[f"deflection_rate_{n}"] for n in (1, 2, 3))
    load = (load_on_table(machine, r) + POINT.load_torque) * r["table_rate"]
    assert lost.mean() > 0.0
    assert put_in.mean() == pytest.approx((lost + load).mean(), rel=2e-3)
