"""A record begins, and the sensor has long been running."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from indexer_env import OperatingPoint, Sensor, make_effect
from indexer_env.units import RPM
from indexer_experiments.challenge.draw import Order, draw, nominal_machine
from indexer_experiments.challenge.messy.case import Judge
from indexer_experiments.challenge.messy.leftover import Fit
from indexer_experiments.challenge.messy.pieces import RATE, coarse_run
from indexer_experiments.challenge.messy.records import true_record
from indexer_experiments.challenge.messy.sizes import Hidden, read_of, with_effects
from indexer_experiments.challenge.records import CONDITIONS, write_records
from indexer_experiments.challenge.running import read_running
from indexer_experiments.challenge.truth import run, turn_samples
from tests.indexer_experiments.challenge.messy.test_case import small

NOISE = 0.015
"""Over the spread of a record, as in the challenge."""

MACHINE = nominal_machine("healthy")
POINT = OperatingPoint(CONDITIONS[0][0] * RPM, CONDITIONS[0][1], 1.0)
"""Begins in a motion, far from rest."""


def highpass(corner: float) -> Sensor:
    return Sensor(highpass_hz=corner / math.tau)


def longer(machine, point: OperatingPoint, samples: int, rate: float, sensor: Sensor, turns: int = 7) -> np.ndarray:
    """The tail of a reading that begins some turns earlier, after nothing."""
    before = turns * turn_samples(machine, point, rate)
    motion = run(machine, point, before + samples, rate)[0]
    return sensor.read(np.concatenate([[0.0], motion]), rate).values[1 + before :]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_the_turn_before_a_record_changes_no_bit_of_it() -> None:
    lead = turn_samples(MACHINE, POINT, 500.0)
    alone, whole = run(MACHINE, POINT, 300, 500.0), run(MACHINE, POINT, 300, 500.0, lead=lead)
    assert whole.shape[1] == lead + 300 and np.array_equal(whole[:, lead:], alone)
    assert whole[1, 0] == POINT.start_angle


@pytest.mark.parametrize("corner", [0.03, 0.1, 1.0])
def test_a_reading_is_the_tail_of_a_longer_one(corner: float) -> None:
    """Within a tenth of the noise; a sensor that begins with the record is off by several times what it does."""
    lead = turn_samples(MACHINE, POINT, 1000.0)
    motion = run(MACHINE, POINT, 3000, 1000.0, lead=lead)[0]
    sensor, record = highpass(corner), motion[lead:]
    expected, noise = longer(MACHINE, POINT, 3000, 1000.0, sensor), NOISE * record.std()
    assert rms(read_running(sensor, record, motion[:lead], 1000.0) - expected) < 0.1 * noise
    assert rms(sensor.read(record, 1000.0).values - expected) > 3.0 * rms(record - expected)


def test_time_begins_with_the_record() -> None:
    """Hum, offset and drift are those of a sensor without a high-pass."""
    background = Sensor(offset=0.3, offset_drift=0.2, hum_amplitude=0.5, hum_phase=1.0)
    sensor = dataclasses.replace(background, highpass_hz=0.01)
    read = read_running(sensor, np.zeros(400), np.zeros(100), 1000.0)
    assert read == pytest.approx(background.read(np.zeros(400), 1000.0).values)


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(gain=1.1, offset_drift=0.1, hum_amplitude=0.2, hum_phase=2.0),
        Sensor(lowpass_hz=40.0, lowpass_order=2),
        Sensor(bracket_hz=60.0),
    ],
)
def test_without_a_high_pass_no_bit_is_another(sensor: Sensor) -> None:
    """Seed 1."""
    lead, record = np.random.default_rng(1).standard_normal((2, 500))
    assert np.array_equal(read_running(sensor, record, lead, 1000.0), sensor.read(record, 1000.0).values)


def test_the_records_of_a_case_are_those_of_a_running_sensor(tmp_path: Path) -> None:
    """Seed 5: with a high-pass less without it, the first record of a case differs by what a longer reading does."""
    effect = make_effect("sensor.highpass", corner=0.1)
    values, order = [], Order(1, 5, "none", turns=0.7)
    for hidden in ((), (effect,)):
        folder = tmp_path / str(len(hidden))
        folder.mkdir()
        write_records(dataclasses.replace(draw(order, 0), hidden=hidden), order.turns, folder)
        values.append(np.loadtxt(folder / "record_0.csv", delimiter=",", skiprows=1)[:, 1])
    drawn = draw(order, 0)
    point = dataclasses.replace(POINT, start_angle=drawn.rng.uniform(0.0, 2.0 * math.pi))
    plain, samples = values[0], len(values[0])
    expected = longer(drawn.truth, point, samples, 1000.0, highpass(0.1)) - run(drawn.truth, point, samples, 1000.0)[0]
    assert rms(values[1] - plain - expected) < 0.1 * NOISE * plain.std()


def test_the_records_of_a_messy_case_are_those_of_a_running_sensor() -> None:
    """By a clock that is right and at a steady speed, so that a longer run goes through the same angles."""
    case = small()
    record = dataclasses.replace(case.drawn.records[0], drift=0.0, point=OperatingPoint(1500 * RPM, 5.0, 0.4))
    drawn = dataclasses.replace(case.drawn, clock=0.0)
    case = dataclasses.replace(case, drawn=drawn, hidden=(Hidden(make_effect("sensor.highpass", corner=0.1), 5.0),))
    clean, _ = true_record(case, record)
    expected = longer(case.machine, record.point, len(clean), drawn.rate, highpass(0.1), 14)
    assert rms(clean - expected) < 0.1 * NOISE * clean.std()


def led(machine) -> tuple[np.ndarray, np.ndarray]:
    """A run as sizes need it, and the turn before it."""
    lead = turn_samples(machine, POINT, RATE)
    whole = coarse_run(machine, POINT, 4500, lead=lead)
    return whole[:, lead:], whole[:, :lead]


def test_what_a_high_pass_leaves_has_no_transient() -> None:
    """Through one of 0.1 rad/s a machine leaves nothing of itself; the high-pass leaves 0.64 times the noise, of which
    the transient alone would leave tens."""
    motion, before = led(MACHINE)
    reading = read_of(motion, (), highpass(0.1), before=before)
    for sensor, most in ((highpass(0.1), 1e-6), (Sensor(), 0.8)):
        fit = Fit(MACHINE, [POINT], [motion], NOISE * float(motion[0].std()), sensor)
        assert fit.left([reading], [motion], MACHINE, before=[before]) <= most


def test_what_an_effect_leaves_beside_a_high_pass() -> None:
    """A loose base leaves as much as without, as a cam turn is short for 0.1 rad/s."""
    moved, before = led(with_effects(MACHINE, [make_effect("base.looseness", {"compliance": 3e-6})])[0])
    motion, _ = led(MACHINE)
    left = []
    for sensor in (Sensor(), highpass(0.1)):
        fit = Fit(MACHINE, [POINT], [motion], 0.05, sensor)
        reading = read_of(moved, (), sensor, before=before)
        left.append(fit.left([reading], [moved], MACHINE, before=[before]))
    assert left[1] == pytest.approx(left[0], rel=0.02)


def test_a_machine_is_judged_through_a_running_sensor() -> None:
    """The true machine leaves nothing of its record through its own high-pass, and something without it."""
    case = dataclasses.replace(small(), hidden=(Hidden(make_effect("sensor.highpass", corner=0.5), 5.0),))
    judge = Judge(case, case.drawn.judging)
    assert judge.gap(case.machine, case.sensor) < 0.05
    assert judge.gap(case.machine, Sensor()) > 0.5
