"""A measurement is a simulated turn read by the sensor; money and names are booked as the page says."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import Faults, OperatingPoint, Run, load_machine, load_sensor, simulate
from indexer_env.diagnosis import BAND_HZ, BANDS, LEVELS, WARMUP, Case, band_levels, draw_case, measure
from indexer_env.diagnosis_env import IndexerDiagnosisEnv
from indexer_env.diagnosis_task import Setting
from indexer_env.engine import advance

TASK = IndexerDiagnosisEnv().task


def cases_and_rngs(count: int) -> tuple[list, list[np.random.Generator]]:
    rngs = [np.random.default_rng(seed) for seed in range(count)]
    return [draw_case(TASK, load_machine("reference"), rng) for rng in rngs], rngs


def test_a_batch_gives_the_bits_of_its_items():
    """Records and spectra; one of the machines needs a finer step than the others."""
    settings = [Setting(1.3, 0.0), Setting(1.0, 200.0), Setting(1.3, 200.0), Setting(1.3, 0.0)]
    sensor, point = load_sensor("bench"), OperatingPoint()
    cases, rngs = cases_and_rngs(4)
    cases[3] = loose(0.05)
    together = measure(cases, settings, point, sensor, rngs)
    cases, rngs = cases_and_rngs(4)
    cases[3] = loose(0.05)
    for i in range(4):
        (alone,) = measure([cases[i]], [settings[i]], point, sensor, [rngs[i]])
        assert alone.record == together[i].record
        np.testing.assert_array_equal(alone.levels, together[i].levels)


def loose(looseness: float) -> Case:
    faults = Faults(screw_looseness=looseness)
    return Case(0, faults, faults.applied_to(load_machine("reference")))


def test_a_record_is_a_turn_of_simulate():
    (case,), (rng,) = cases_and_rngs(1)
    (found,) = measure([case], [Setting(1.3, 200.0)], OperatingPoint(), load_sensor("bench"), [rng])
    twin = np.random.default_rng(0)
    draw_case(TASK, load_machine("reference"), twin)
    nominal = OperatingPoint()
    point = OperatingPoint(1.3 * nominal.motor_speed, nominal.load_torque + 200.0, 16.0 * math.pi * twin.random())
    length = round(8200 / 1.3)
    run = Run(samples=length + round(WARMUP * length), warmup_turns=0, step=1e-3)
    truth = simulate(case.machine, point, run).table_acceleration[-length:]
    np.testing.assert_array_equal(found.record.values, load_sensor("bench").read(truth, 1000.0, twin).values)
    np.testing.assert_array_equal(found.levels, band_levels(found.record.values[np.newaxis], 1000.0)[0])


def test_the_step_is_the_longest_that_resolves_the_machine(monkeypatch):
    """The housing stands at 55 Hz with a looseness of 0.05 and at 95 Hz with 0.016; 40 Hz and 80 Hz are the bounds."""
    steps = []

    def watched(*arguments, **others):
        steps.append(arguments[2][0])
        return advance(*arguments, **others)

    monkeypatch.setattr("indexer_env.diagnosis.advance", watched)
    for looseness in (0.3, 0.05, 0.016):
        measure(
            [loose(looseness)], [TASK.settings[6]], OperatingPoint(), load_sensor("bench"), [np.random.default_rng(0)]
        )
    assert steps == pytest.approx([1e-3, 1e-3 / 2, 1e-3 / 3])


def test_a_coarser_step_and_a_shorter_start_show_the_same_spectrum():
    """Without play, where a record can be compared at all: to a tenth of a decibel wherever a band stands out of the
    noise."""
    machine = load_machine("smooth")
    quiet = dataclasses.replace(load_sensor("bench"), noise_density=0.0, bits=None)
    rng = np.random.default_rng(4)
    (found,) = measure([Case(0, Faults(), machine)], [Setting(1.3, 0.0)], OperatingPoint(), quiet, [rng])
    point = OperatingPoint(
        1.3 * OperatingPoint().motor_speed, start_angle=16.0 * math.pi * np.random.default_rng(4).random()
    )
    point = dataclasses.replace(point, start_angle=point.start_angle + WARMUP * 16.0 * math.pi)
    fine = simulate(machine, point, Run(samples=len(found.record.values), step=0.1e-3, warmup_turns=2))
    expected = band_levels(quiet.read(fine.table_acceleration, 1000.0).values[np.newaxis], 1000.0)[0]
    np.testing.assert_allclose(found.levels, expected, atol=0.1 * 2.0 / (LEVELS[1] - LEVELS[0]))


def test_a_turn_of_a_sine_shows_in_its_band_alone():
    time = np.arange(4000) / 1000.0
    levels = band_levels(np.sin(2.0 * math.pi * 30.5 * time)[np.newaxis], 1000.0)[0]
    assert levels.shape == (BANDS,) and levels.argmax() == (30 - 1) // BAND_HZ
    decibels = 0.5 * (levels.max() * (LEVELS[1] - LEVELS[0]) + LEVELS[0] + LEVELS[1])
    assert decibels == pytest.approx(10.0 * math.log10(0.5 / BAND_HZ), abs=0.1)  # power ½ in a band of 4 Hz
    assert levels[15:].max() == -1.0


def test_costs_are_their_formula():
    env = IndexerDiagnosisEnv(time_price=0.01, brake_price=0.1, speeds=[0.5, 1.0], brakes=[0.0, 100.0])
    two_turns, work = 2 * 8.2, 2 * 2.0 * math.pi * 100.0 / 1000.0
    expected = [0.02 * two_turns, 0.02 * two_turns + 0.1 * work, 0.01 * two_turns, 0.01 * two_turns + 0.1 * work]
    np.testing.assert_allclose(env.costs, expected, rtol=1e-12)
    env = IndexerDiagnosisEnv(speeds=[1.0], brakes=[0.0, 200.0])
    env.reset(seed=0)
    assert env.step(1)[1] == -env.costs[1]


def test_names_pay_and_end_the_episode():
    env = IndexerDiagnosisEnv(right=2.0, wrong=3.0)
    for place, name in enumerate(env.names):
        for named in (place, (place + 1) % len(env.names)):
            env.reset(seed=1, options={"hypothesis": name})
            _, reward, terminated, truncated, _ = env.step(len(env.settings) + named)
            assert (reward, terminated, truncated) == (2.0 if named == place else -3.0, True, False)


def test_a_measurement_beyond_the_budget_ends_the_episode_as_no_name():
    env = IndexerDiagnosisEnv(speeds=[1.0, 1.3], brakes=[0.0], budget=0.1)
    _, info = env.reset(seed=0)
    assert info["action_mask"].tolist() == [1] * 10
    observation, _, terminated, _, info = env.step(0)
    assert not terminated and info["action_mask"].tolist() == [0, 0] + [1] * 8
    assert observation[-1] == pytest.approx((0.1 - env.costs[0]) / 0.1)
    after, reward, terminated, _, info = env.step(1)
    assert (reward, terminated) == (-1.0, True) and "record" not in info
    np.testing.assert_array_equal(after, observation)


def test_the_observation_says_what_was_measured():
    env = IndexerDiagnosisEnv()
    start, _ = env.reset(seed=3)
    np.testing.assert_array_equal(start, [-1.0] * BANDS + [0.0] * 8 + [1.0])
    observation, _, _, _, info = env.step(7)
    np.testing.assert_array_equal(
        observation[:BANDS], band_levels(info["record"].values[np.newaxis], 1000.0)[0].astype(np.float32)
    )
    assert observation[BANDS:-1].tolist() == [0.0] * 7 + [1.0]


def test_every_name_is_as_likely_and_has_its_faults():
    env = IndexerDiagnosisEnv(reveal=True)
    env.reset(seed=0)
    truths = [env.reset()[1]["truth"] for _ in range(800)]
    counts = np.bincount([truth["hypothesis"] for truth in truths], minlength=8)
    assert counts.min() >= 70 and counts.max() <= 130  # 100 expected, binomial σ 9.4
    for truth in truths:
        name = env.names[truth["hypothesis"]]
        degrees = math.degrees(truth["backlash"])
        assert (truth["roller_crack"] > 0.0) == ("crack" in name) == (truth["cracked_station"] >= 0)
        assert (truth["screw_looseness"] > 0.0) == ("screws" in name)
        assert (2.0 <= degrees <= 15.0) if "play" in name else (0.0 <= degrees <= 1.0)


def test_machines_differ_from_episode_to_episode_by_their_spread():
    machine, rng = load_machine("reference"), np.random.default_rng(0)
    shares = [
        draw_case(TASK, machine, rng, 0).machine.output_joint.stiffness / machine.output_joint.stiffness
        for _ in range(300)
    ]
    assert 0.9 <= min(shares) < 0.91 and 1.09 < max(shares) < 1.1


def test_a_budget_of_three_turns_pays_three():
    """Setting 3 costs 0.119 a turn; three times that less twice that is less than it by a last bit."""
    cost = float(IndexerDiagnosisEnv().costs[3])
    assert 3.0 * cost - cost - cost < cost
    env = IndexerDiagnosisEnv(budget=3.0 * cost)
    env.reset(seed=0)
    for turn in range(3):
        observation, reward, terminated, _, info = env.step(3)
        assert (reward, terminated) == (-cost, False) and "record" in info
        assert info["action_mask"][3] == (turn < 2)
    assert observation[-1] == 0.0
