"""A sensor read block by block gives the record that it gives as a whole."""

import dataclasses

import numpy as np
import pytest

from indexer_env import ParameterError, Sensor, load_sensor
from indexer_env.sensor_stream import SensorStream

RATE = 1000.0
NO_RNGS: list[np.random.Generator] = []


def record(rows: int = 3, samples: int = 120) -> np.ndarray:
    return 10.0 * np.random.default_rng(7).standard_normal((rows, samples))


@pytest.fixture(scope="module")
def quiet() -> Sensor:
    """Every stage but the noise."""
    return dataclasses.replace(load_sensor("bench"), noise_density=0.0)


@pytest.mark.parametrize("length", [1, 7, 40, 120])
def test_blocks_of_any_length_make_the_whole_record(quiet, length):
    values = record()
    stream = SensorStream(quiet, RATE, 3)
    stream.start(np.arange(3), values[:, 0])
    blocks = [stream.read(None, values[:, k : k + length], NO_RNGS) for k in range(0, 120, length)]
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), quiet.read_batch(values, RATE))


def test_an_ac_coupled_chain_starts_at_rest(quiet):
    coupled, values = dataclasses.replace(quiet, highpass_hz=2.0, offset=0.0), 20.0 + record()
    stream = SensorStream(coupled, RATE, 3)
    stream.start(np.arange(3), values[:, 0])
    blocks = [stream.read(None, values[:, k : k + 40], NO_RNGS) for k in range(0, 120, 40)]
    np.testing.assert_allclose(np.concatenate(blocks, axis=1), coupled.read_batch(values, RATE), atol=2e-3)


def test_rows_start_apart_and_do_not_touch_each_other(quiet):
    values = record()
    stream = SensorStream(quiet, RATE, 3)
    stream.start(np.arange(3), values[:, 0])
    first = stream.read(None, values[:, :50], NO_RNGS)
    stream.start(np.array([1]), values[1, 70:71])
    ends = stream.read(np.array([0, 2]), values[[0, 2], 50:], NO_RNGS)
    again = stream.read(np.array([1]), values[1:2, 70:], NO_RNGS)
    whole = quiet.read_batch(values, RATE)
    np.testing.assert_array_equal(np.concatenate([first[[0, 2]], ends], axis=1), whole[[0, 2]])
    np.testing.assert_array_equal(again, quiet.read_batch(values[1:2, 70:], RATE))


def test_noise_has_its_density_and_its_own_generator():
    sensor = dataclasses.replace(load_sensor("ideal"), noise_density=0.1)
    stream = SensorStream(sensor, RATE, 2)
    rngs = [np.random.default_rng(1), np.random.default_rng(2)]
    noise = np.concatenate([stream.read(None, np.zeros((2, 100)), rngs) for _ in range(200)], axis=1)
    assert np.std(noise, axis=1) == pytest.approx(0.1 * np.sqrt(500.0), rel=0.02)
    np.testing.assert_array_equal(noise[1], 0.1 * np.sqrt(500.0) * np.random.default_rng(2).standard_normal(20_000))


def test_what_only_a_whole_record_has_is_refused():
    with pytest.raises(ParameterError, match=r"Sensor\.noise_snr_db must be null where a record is read as it grows"):
        SensorStream(Sensor(noise_snr_db=20.0), RATE, 1)
    with pytest.raises(ParameterError, match=r"Sensor\.sample_rate must be null or the simulation's 1000 Hz"):
        SensorStream(Sensor(sample_rate=500.0, lowpass_hz=100.0), RATE, 1)
