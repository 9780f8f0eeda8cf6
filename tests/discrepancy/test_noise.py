"""The size and the colour of noise, in records of a machine that moves."""

import numpy as np
import pytest
from scipy.signal import lfilter

from discrepancy.indexer.windows import Experiment
from discrepancy.noise import autoregression, limited_noise, noise_of, shared_noise, white_noise
from indexer_env import OperatingPoint, Signal
from indexer_records.resample import CUTOFF, resampled

RATE = 1000.0


def record(colour: float, seconds: float = 20.0, rate: float = RATE) -> np.ndarray:
    """Seed 1: noise of 0.1 with this correlation from sample to sample, on a motion of 3 that rings at 15 Hz and rests
    for half of each second."""
    rng, count = np.random.default_rng(1), round(seconds * rate)
    white = rng.standard_normal(count)
    white[1:] *= np.sqrt(1.0 - colour**2)
    time = np.arange(count) / rate
    since = time % 1.0
    motion = 3.0 * np.exp(-6.0 * since) * np.sin(2.0 * np.pi * 15.0 * since) * np.minimum(since / 0.05, 1.0)
    return motion + 0.1 * np.asarray(lfilter([1.0], [1.0, -colour], white))


@pytest.mark.parametrize(("rate", "within"), [(500.0, 0.4), (1000.0, 0.15), (5000.0, 0.15)])
@pytest.mark.parametrize("colour", [0.0, 0.5, 0.8])
def test_the_size_of_coloured_noise_is_read_beside_the_motion(colour: float, rate: float, within: float) -> None:
    """Fourth differences would make it 0.02 with 0.8; slow sampling shows little above the motion."""
    size, found = noise_of(record(colour, rate=rate), rate)
    assert size == pytest.approx(0.1, rel=within)
    assert found == pytest.approx(colour, abs=0.5 * within)


def test_fourth_differences_take_coloured_noise_for_less() -> None:
    """Why they are but for records that are too short for a spectrum."""
    assert white_noise(record(0.8)) < 0.05
    short = record(0.0, 0.3)
    assert autoregression([short], RATE) is None
    assert noise_of(short, RATE) == (white_noise(short), 0.0)


def test_white_noise_is_told_from_vibration() -> None:
    """Seed 1: noise of 0.1 on a vibration of 10 at 30 Hz, within 5 %."""
    time = np.arange(8000) / RATE
    values = 10.0 * np.sin(2.0 * np.pi * 30.0 * time) + 0.1 * np.random.default_rng(1).standard_normal(8000)
    assert white_noise(values) == pytest.approx(0.1, rel=0.05)
    assert noise_of(values, RATE)[0] == pytest.approx(0.1, rel=0.1)


def test_an_experiment_without_a_stated_noise_has_that_of_its_record() -> None:
    signal = Signal(record(0.5), RATE, unit="rad/s^2")
    experiment = Experiment(signal, OperatingPoint())
    assert (experiment.noise_level, experiment.colour) == noise_of(signal.values, RATE)
    assert Experiment(signal, OperatingPoint(), noise=0.3).noise_level == 0.3


def test_a_drift_is_no_noise() -> None:
    values = record(0.5)
    drifting = values + 30.0 * np.arange(len(values)) / RATE
    assert noise_of(drifting, RATE) == pytest.approx(noise_of(values, RATE))


def test_noise_is_read_where_the_machine_rests() -> None:
    """Seed 2: for two fifths of each second contacts rattle, twenty times the noise. Three fifths of all pieces hold
    some of it, so that a quarter of all is more than a quarter of the others; a median would say 0.33."""
    values = record(0.5)
    rattles = np.arange(len(values)) / RATE % 1.0 < 0.4
    values = values + 2.0 * rattles * np.random.default_rng(2).standard_normal(len(values))
    assert 0.1 < noise_of(values, RATE)[0] < 0.2


def test_a_record_that_rattles_throughout_does_not_make_the_sensor_noisier() -> None:
    """Seed 2; of three records one rattles, the noise of the two others is that of all."""
    quiet = [record(0.5), record(0.5, 4.0)]
    rattles = record(0.5) + np.random.default_rng(2).standard_normal(20000)
    assert noise_of(rattles, RATE)[0] > 0.5
    assert shared_noise([rattles, *quiet], RATE)[0] == pytest.approx(0.1, rel=0.1)
    assert shared_noise([rattles], RATE) == noise_of(rattles, RATE)


def test_noise_is_no_more_than_what_is_read_where_the_machine_rests() -> None:
    """Friction stops the table with a jerk, and holds it: the jerks' spectrum says little of low frequencies."""
    time = np.arange(10000) / 500.0
    moves = 3.0 * np.sin(2.0 * np.pi * 15.2 * time) * (time % 1.0 < 0.4)
    noise = record(0.94, rate=500.0) - record(1.0, rate=500.0)
    found = autoregression([moves + noise], 500.0)
    assert found is not None and np.sqrt(found[1] / (1.0 - found[0] ** 2)) > 0.14
    assert noise_of(moves + noise, 500.0)[0] == pytest.approx(0.1, rel=0.25)


@pytest.mark.parametrize("colour", [0.0, 0.6, 0.9])
def test_noise_of_a_resampled_record_is_told_before(colour: float) -> None:
    """Standard deviation and correlation of noise that a filter has taken the upper band of."""
    rng, fast = np.random.default_rng(3), 4.0 * RATE
    noise = lfilter([1.0], [1.0, -colour], np.sqrt(1.0 - colour**2) * rng.standard_normal(200_000))
    slow = resampled(np.asarray(noise), fast, RATE, np.zeros(1), np.array([1.0 / RATE]), 50_000)[0]
    size, found = limited_noise(1.0, colour, fast, CUTOFF * RATE, RATE)
    assert size == pytest.approx(slow.std(), rel=0.02)
    assert found == pytest.approx(float(slow[1:] @ slow[:-1]) / float(slow @ slow), abs=0.03)


def test_a_record_without_noise_counts_as_known_to_a_thousandth() -> None:
    """What no sensor has taken would have noise of 1e-7 of its motion, and each fit of it would leave too much to be
    told from any other."""
    slow = np.sin(2.0 * np.pi * 0.5 * np.arange(4000) / 250.0)
    assert noise_of(slow, 250.0)[0] == pytest.approx(1e-3 * slow.std(), rel=0.01)
    short = np.sin(2.0 * np.pi * 5.0 * np.arange(60) / 250.0)
    assert noise_of(short, 250.0)[0] > 0.9e-3 * short.std(), "too short for a spectrum"
