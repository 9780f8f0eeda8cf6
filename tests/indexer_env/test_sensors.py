"""The sensor chain: each stage shows the signature that theory gives it, and none at its null value."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import yaml

from indexer_env.build import from_mapping
from indexer_env.sensors import Sensor

RATE = 1000.0
CONF = Path(__file__).parents[2] / "conf" / "sensor"

# One value for each stage that is not its null value, as `dataclasses.replace` takes them.
STAGES = {
    "radius": {"radius": 0.4},
    "gain": {"gain": -1.02},
    "bracket": {"bracket_hz": 120.0, "bracket_damping": 0.05},
    "lowpass": {"lowpass_hz": 100.0, "lowpass_order": 4},
    "offset": {"offset": 0.3},
    "offset_drift": {"offset_drift": 0.02},
    "hum": {"hum_amplitude": 0.1, "hum_third": 0.2},
    "noise_snr_db": {"noise_snr_db": 30.0},
    "noise_density": {"noise_density": 0.01},
    "full_scale": {"full_scale": 1.0},
    "bits": {"full_scale": 20.0, "bits": 8},
}
EVERYTHING = Sensor(
    radius=0.4, gain=-1.02, bracket_hz=300.0, lowpass_hz=180.0, offset=0.1, offset_drift=0.02,
    hum_amplitude=0.1, hum_third=0.2, noise_snr_db=30.0, full_scale=2.0, bits=10, sample_rate=500.0,
)  # fmt: skip


def vibration(n: int = 4000, seed: int = 1) -> np.ndarray:
    """A smooth, table-like acceleration [rad/s²] with a negative zero among its samples."""
    t = np.arange(n) / RATE
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, 3)
    values = sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in zip((3, 2, 1), (1.5, 15, 33), phases, strict=True))
    values[7] = -0.0
    return values


# -------------------------------------------------------------------------------- off


def test_the_default_sensor_hands_on_the_very_bits():
    truth = vibration()
    record = Sensor().read(truth, RATE)
    assert record.values.tobytes() == truth.tobytes()
    assert (record.sample_rate, record.quantity, record.unit) == (RATE, "table_acceleration", "rad/s^2")


def test_idle_parameters_change_no_bit():
    idle = Sensor(bracket_damping=0.2, lowpass_order=7, hum_hz=60.0, hum_phase=1.0, hum_third=0.5, sample_rate=RATE)
    truth = vibration()
    assert idle.read(truth, RATE).values.tobytes() == truth.tobytes()


@pytest.mark.parametrize("stage", STAGES)
def test_each_stage_shows_when_on_and_leaves_nothing_behind_when_off(stage):
    truth, defaults = vibration(), Sensor()
    on = dataclasses.replace(defaults, **STAGES[stage])
    off = dataclasses.replace(on, **{name: getattr(defaults, name) for name in STAGES[stage]})
    assert not np.array_equal(on.read(truth, RATE, np.random.default_rng(0)).values, truth)
    assert off.read(truth, RATE).values.tobytes() == truth.tobytes()


def test_without_noise_no_random_number_is_drawn():
    rng = np.random.default_rng(5)
    Sensor(radius=0.4).read(vibration(), RATE, rng)
    assert rng.standard_normal() == np.random.default_rng(5).standard_normal()


# -------------------------------------------------------------------------------- gain, radius


def test_radius_and_gain_scale_and_set_the_unit():
    truth = vibration()
    record = Sensor(radius=0.4, gain=-1.1).read(truth, RATE)
    assert record.unit == "m/s^2"
    np.testing.assert_allclose(record.values, -0.44 * truth, rtol=1e-15)
    assert Sensor(gain=-1.1).read(truth, RATE).unit == "rad/s^2"


# -------------------------------------------------------------------------------- background


def test_offset_and_drift_are_a_straight_line():
    t = np.arange(4000) / RATE
    added = Sensor(offset=0.3, offset_drift=-0.02).read(vibration(), RATE).values - vibration()
    np.testing.assert_allclose(added, 0.3 - 0.02 * t, atol=1e-14)


def test_hum_is_a_line_at_its_frequency_and_its_third_harmonic_only():
    truth, amplitude = vibration(), 0.25
    sensor = Sensor(hum_amplitude=amplitude, hum_hz=60.0, hum_phase=0.7, hum_third=0.1)
    lines = np.fft.rfft(sensor.read(truth, RATE).values - truth) / (truth.size / 2)
    frequencies = np.fft.rfftfreq(truth.size, 1 / RATE)
    at = {f: int(np.flatnonzero(frequencies == f)[0]) for f in (60.0, 180.0)}
    assert abs(lines[at[60.0]]) == pytest.approx(amplitude, rel=1e-12)
    assert abs(lines[at[180.0]]) == pytest.approx(0.1 * amplitude, rel=1e-12)
    assert np.angle(lines[at[60.0]]) == pytest.approx(0.7 - math.pi / 2, abs=1e-12)
    assert np.abs(np.delete(lines, list(at.values()))).max() < 1e-13


# -------------------------------------------------------------------------------- noise


@pytest.mark.parametrize("snr_db", [10.0, 36.5])
def test_signal_to_noise_ratio_is_met_whatever_the_background(snr_db):
    truth = vibration(200_000)
    base = Sensor(radius=0.4, gain=3.0, lowpass_hz=50.0, offset=5.0, offset_drift=0.1, hum_amplitude=2.0)
    noisy = dataclasses.replace(base, noise_snr_db=snr_db).read(truth, RATE, np.random.default_rng(3)).values
    signal = Sensor(radius=0.4, gain=3.0, lowpass_hz=50.0).read(truth, RATE).values
    noise = noisy - base.read(truth, RATE).values
    # Relative deviation of a sample variance: √(2 / 200 000) = 0.3 %, 0.014 dB.
    assert 10 * math.log10(np.var(signal) / np.var(noise)) == pytest.approx(snr_db, abs=0.1)


@pytest.mark.parametrize("rate", [1000.0, 250.0])
def test_noise_density_fills_the_band_of_the_record_evenly(rate):
    sensor = Sensor(noise_density=0.02, lowpass_hz=100.0, sample_rate=rate)
    record = sensor.read(np.zeros(400_000), RATE, np.random.default_rng(4))
    assert np.std(record.values) == pytest.approx(0.02 * math.sqrt(rate / 2), rel=0.01)
    frequencies, psd = scipy.signal.welch(record.values, rate, nperseg=256)
    thirds = np.array_split(psd[2:-2], 3)
    # 400 or more averages of 40 or more lines: the mean of a third is known to about 1 %.
    np.testing.assert_allclose([np.mean(third) for third in thirds], 0.02**2, rtol=0.04)
    assert frequencies[-1] == rate / 2


def test_noise_is_normal_and_white():
    noise = Sensor(noise_density=1.0).read(np.zeros(100_000), RATE, np.random.default_rng(6)).values
    z = noise / noise.std()
    assert abs(z.mean()) < 0.013 and abs(np.mean(z**3)) < 0.032 and np.mean(z**4) == pytest.approx(3.0, abs=0.07)
    lags = [np.mean(z[lag:] * z[:-lag]) for lag in (1, 2, 5, 20)]
    assert np.abs(lags).max() < 0.013


def test_a_seed_fixes_the_noise_and_another_seed_changes_it():
    sensor, truth = Sensor(noise_snr_db=20.0), vibration()
    first = sensor.read(truth, RATE, np.random.default_rng(1))
    assert first == sensor.read(truth, RATE, np.random.default_rng(1))
    assert first != sensor.read(truth, RATE, np.random.default_rng(2))


# -------------------------------------------------------------------------------- range, bits


def test_clipping_is_symmetric_and_leaves_the_inside_alone():
    truth = vibration()
    record = Sensor(full_scale=2.5).read(truth, RATE).values
    inside = np.abs(truth) <= 2.5
    assert 0.1 < inside.mean() < 0.9
    np.testing.assert_array_equal(record[inside], truth[inside])
    np.testing.assert_array_equal(record[~inside], 2.5 * np.sign(truth[~inside]))


def test_readings_are_multiples_of_the_step_and_nearest():
    truth, step = vibration(), 2 * 8.0 / 2**6
    record = Sensor(full_scale=8.0, bits=6).read(truth, RATE).values
    codes = record / step
    np.testing.assert_array_equal(codes, np.rint(codes))
    assert np.abs(record - truth).max() <= step / 2
    assert len(np.unique(codes)) > 20


def test_the_quantiser_has_two_to_the_bits_readings():
    record = Sensor(full_scale=4.0, bits=4).read(np.linspace(-5.0, 5.0, 10_001), RATE).values
    np.testing.assert_array_equal(np.unique(record), np.arange(-8, 8) * 0.5)


def test_quantisation_error_has_the_variance_of_a_uniform_one():
    truth, step = vibration(100_000), 20.0 / 2**12
    error = Sensor(full_scale=10.0, bits=12).read(truth, RATE).values - truth
    assert np.var(error) == pytest.approx(step**2 / 12, rel=0.03)


# -------------------------------------------------------------------------------- order, batch


def test_the_chain_is_its_line_of_arithmetic():
    truth, s = vibration(), EVERYTHING
    filters = Sensor(bracket_hz=s.bracket_hz, lowpass_hz=s.lowpass_hz, sample_rate=s.sample_rate)
    y = filters.read(s.gain * s.radius * truth, RATE).values
    t = np.arange(y.size) / s.sample_rate
    sigma = np.std(y) * 10 ** (-s.noise_snr_db / 20)
    angle = 2 * np.pi * s.hum_hz * t + s.hum_phase
    y = y + s.offset + s.offset_drift * t + s.hum_amplitude * (np.sin(angle) + s.hum_third * np.sin(3 * angle))
    y = y + sigma * np.random.default_rng(8).standard_normal(y.size)
    step = 2 * s.full_scale / 2**s.bits
    y = np.clip(np.rint(np.clip(y, -s.full_scale, s.full_scale) / step) * step, -s.full_scale, s.full_scale - step)
    record = s.read(truth, RATE, np.random.default_rng(8)).values
    # A rounding in the last bit may move a reading on the edge between two codes; none lies that near here.
    np.testing.assert_allclose(record, y, rtol=0, atol=1e-12)
    assert (record == s.full_scale - step).any() and (record == -s.full_scale).any()


@pytest.mark.parametrize(
    "sensor",
    [EVERYTHING, Sensor(noise_density=0.1), Sensor(), *(Sensor(**stage) for stage in STAGES.values())],
)
def test_a_row_of_a_batch_has_the_bits_of_a_reading_alone(sensor):
    truths = np.array([vibration(seed=seed) for seed in range(5)])
    batch = sensor.read_batch(truths, RATE, [np.random.default_rng(seed) for seed in range(5)])
    for seed, (row, truth) in enumerate(zip(batch, truths, strict=True)):
        assert row.tobytes() == sensor.read(truth, RATE, np.random.default_rng(seed)).values.tobytes()
    assert not np.shares_memory(batch, truths)


def test_reading_leaves_the_truth_alone():
    truths = np.array([vibration(), vibration(seed=2)])
    before = truths.tobytes()
    EVERYTHING.read_batch(truths, RATE, [np.random.default_rng(0), np.random.default_rng(1)])
    EVERYTHING.read(truths[0], RATE, np.random.default_rng(0))
    assert truths.tobytes() == before


# -------------------------------------------------------------------------------- presets


@pytest.mark.parametrize("path", sorted(CONF.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_preset_names_every_field_and_reads(path):
    mapping = yaml.safe_load(path.read_text(encoding="utf-8"))
    fields = {field.name for field in dataclasses.fields(Sensor)}
    assert {name.removesuffix("_deg") for name in mapping} == fields
    sensor = from_mapping(Sensor, mapping)
    assert sensor.read(vibration(), RATE, np.random.default_rng(0)).unit == sensor.unit
    for line in path.read_text(encoding="utf-8").splitlines():
        assert line.startswith("#") or re.search(r"  # (-|m|Hz|dB|degrees|(m|rad)/s\^2)\b|  # -;", line), line


def test_ideal_is_the_default_sensor_and_bench_is_not():
    ideal = from_mapping(Sensor, yaml.safe_load((CONF / "ideal.yaml").read_text(encoding="utf-8")))
    bench = from_mapping(Sensor, yaml.safe_load((CONF / "bench.yaml").read_text(encoding="utf-8")))
    assert ideal == Sensor()
    assert bench.noisy and bench.unit == "m/s^2"
