"""Under the constant command 1 the environment is the simulator, sample by sample and bit by bit."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest

from indexer_env import Faults, Joint, Machine, OperatingPoint, Run, load_sensor, make_effect, simulate
from indexer_env.control import ControlTask
from indexer_env.env import IndexerEnv

ONE = np.ones(1, dtype=np.float32)
PERIOD = 0.01
"""s; short, so that a few steps compare much."""


def readings(env: gymnasium.Env, steps: int, angle: float = 0.3, action: np.ndarray = ONE) -> np.ndarray:
    """Readings from the start of an episode on, the one at t = 0 included."""
    _, info = env.reset(seed=1, options={"start_angle": angle})
    record = [info["acceleration"][-1:]]
    for _ in range(steps):
        *_, info = env.step(action)
        record.append(info["acceleration"])
    return np.concatenate(record)


def simulated(machine: Machine, samples: int, angle: float = 0.3, **run: float) -> np.ndarray:
    point = OperatingPoint(start_angle=angle)
    return simulate(
        machine, point, Run(samples=samples, warmup_turns=0, **{"step": ControlTask.step, **run})
    ).table_acceleration


def variants(smooth: Machine, reference: Machine) -> dict[str, Machine]:
    effects = ("drive.slip", {"compliance": 2.0}), ("cam.profile_error", {"height": 1e-3})
    return {
        "smooth": smooth,
        "reference": reference,
        "model A": dataclasses.replace(smooth, model="A"),
        "loose": Faults(screw_looseness=1.0).applied_to(reference),
        "play and crack": Faults(backlash=math.radians(20), roller_crack=0.4, cracked_station=1).applied_to(reference),
        "thin play": dataclasses.replace(smooth, output_joint=dataclasses.replace(smooth.output_joint, backlash=1e-5)),
        "effects": reference.with_effects(*(make_effect(name, values) for name, values in effects)),
    }


@pytest.mark.parametrize("name", ["smooth", "reference", "model A", "loose", "play and crack", "thin play", "effects"])
def test_constant_nominal_speed_is_simulate(name, smooth, reference):
    machine = variants(smooth, reference)[name]
    record = readings(IndexerEnv(period=PERIOD, machine=machine), 220)
    np.testing.assert_array_equal(record, simulated(machine, 2201))


@pytest.mark.parametrize("samples", [1, 3, 25])
def test_the_length_of_the_period_changes_no_bit(reference, samples):
    env = IndexerEnv(machine=reference, period=samples / 1000.0)
    steps = 300 // samples
    np.testing.assert_array_equal(readings(env, steps), simulated(reference, steps * samples + 1))


def test_another_rate_and_step(reference):
    env = IndexerEnv(machine=reference, period=0.01, sample_rate=500.0, step=0.5e-3)
    np.testing.assert_array_equal(readings(env, 60), simulated(reference, 301, sample_rate=500.0, step=0.5e-3))


def test_readings_of_a_noiseless_chain_are_those_of_the_whole_record(reference):
    sensor = dataclasses.replace(load_sensor("bench"), noise_density=0.0)
    record = readings(IndexerEnv(period=PERIOD, machine=reference, sensor=sensor), 120)
    whole = sensor.read(simulated(reference, 1201), 1000.0).values
    np.testing.assert_array_equal(record, whole)


def test_a_brake_is_a_load_torque(reference):
    env = IndexerEnv(period=PERIOD, machine=reference, brake_torque=100.0)
    record = readings(env, 60, action=np.array([1.0, 0.0], dtype=np.float32))
    point = OperatingPoint(start_angle=0.3, load_torque=2.0 + 50.0)
    braked = simulate(reference, point, Run(step=ControlTask.step, samples=601, warmup_turns=0)).table_acceleration
    # the table is put on its law before the brake is applied, so only the first reading is without it
    np.testing.assert_allclose(record[1:], braked[1:], rtol=0.0, atol=1e-9)
    assert record[0] != braked[0]


def test_a_ramp_takes_the_time_it_must(smooth):
    """From 1 to 0.5 at 5 per second in 0.1 s, then constant; the way is the integral of the command."""
    env = IndexerEnv(period=PERIOD, machine=smooth, ramp=5.0)
    env.reset(seed=0, options={"start_angle": math.pi})
    speeds = [float(env.step(np.zeros(1))[0][6]) * env.limits.motor_speed for _ in range(20)]
    np.testing.assert_allclose(speeds[:10], 1.0 - 0.05 * np.arange(1, 11), atol=1e-6)
    np.testing.assert_allclose(speeds[10:], 0.5, atol=1e-6)


def test_throughput_is_that_of_the_command(smooth):
    env = IndexerEnv(period=PERIOD, machine=smooth, vibration_weight=0.0, ramp=5.0)
    env.reset(seed=0)
    rewards = [env.step(np.zeros(1))[1] for _ in range(300)]
    assert np.mean(rewards[100:]) == pytest.approx(0.5, abs=1e-3)


def test_the_reward_is_its_formula(reference):
    """Of a whole period in the dwell, from the simulator's channels."""
    env = IndexerEnv(period=PERIOD, machine=reference, vibration_weight=0.7)
    env.reset(seed=0, options={"start_angle": math.pi + 0.1})
    reward = env.step(ONE)[1]
    run = Run(step=ControlTask.step, samples=11, warmup_turns=0, channels=("table_acceleration", "cam_angle"))
    truth = simulate(reference, OperatingPoint(start_angle=math.pi + 0.1), run)
    nominal = reference.reduction * OperatingPoint().motor_speed * 0.01
    throughput = (truth.channels["cam_angle"][10] - truth.channels["cam_angle"][0]) / nominal
    vibration = np.sqrt(np.mean(truth.table_acceleration[1:] ** 2)) / env.limits.vibration
    assert vibration > 0.0
    assert reward == pytest.approx(throughput - 0.7 * vibration, rel=1e-12)


def test_the_observation_is_what_its_limits_say(reference):
    env = IndexerEnv(period=PERIOD, machine=reference)
    env.reset(seed=0, options={"start_angle": 0.3})
    observation = env.step(ONE)[0]
    names = ("table_acceleration", "table_angle", "table_rate", "cam_angle", "motor_rate")
    truth = simulate(
        reference,
        OperatingPoint(start_angle=0.3),
        Run(step=ControlTask.step, samples=11, warmup_turns=0, channels=names),
    )
    acceleration, table, rate, cam, motor = (truth.channels[name][10] for name in names)
    limits = env.limits
    expected = [
        acceleration / limits.acceleration, math.cos(8 * table), math.sin(8 * table), rate / limits.table_rate,
        math.cos(cam), math.sin(cam), motor / OperatingPoint().motor_speed / limits.motor_speed,
    ]  # fmt: skip
    np.testing.assert_array_equal(observation, np.array(expected).astype(np.float32))


def test_a_reading_beyond_the_range_is_clipped(reference):
    sensor = dataclasses.replace(load_sensor("environment"), full_scale=1.0)
    env = IndexerEnv(period=PERIOD, machine=reference, sensor=sensor)
    record = readings(env, 80)
    assert np.abs(record).max() == 1.0
    assert np.abs(simulated(reference, 801)).max() > 10.0


def test_a_joint_without_edges_beside_one_with_edges_keeps_its_bits(smooth, reference):
    """Hardening contact has a cube: an edge at infinity must not turn it into a NaN (kernels/joints.py)."""
    hard = smooth.with_effects(make_effect("output.cubic_stiffness", stiffness=1e9))
    assert isinstance(hard.input_joint, Joint)
    alone = readings(IndexerEnv(period=PERIOD, machine=hard), 60)
    np.testing.assert_array_equal(alone, simulated(hard, 601))
