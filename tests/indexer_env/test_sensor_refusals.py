"""The sensor refuses what it cannot do with one sentence: what, rule with unit, value, remedy."""

import math
import re

import numpy as np
import pytest

from indexer_env.errors import ParameterError, SignalError
from indexer_env.sensors import Sensor

RATE = 1000.0
TRUTH = np.sin(2.0 * np.pi * 15.0 * np.arange(4000) / RATE)

OFF = "leave it out (null) to switch it off"
REFUSED_AT_ONCE = {
    "radius": ({"radius": 0.0}, f"Sensor.radius must be a finite number > 0 m, got 0.0; {OFF}."),
    "gain zero": (
        {"gain": 0.0},
        "Sensor.gain must be other than 0, got 0.0; use -1 for a reversed mounting.",
    ),
    "gain text": ({"gain": "2"}, "Sensor.gain must be a finite number, got '2'; use 1 for a true reading."),
    "bracket_hz": (
        {"bracket_hz": -1.0},
        f"Sensor.bracket_hz must be a finite number > 0 Hz, got -1.0; {OFF}.",
    ),
    "bracket_damping": (
        {"bracket_damping": 0.5},
        "Sensor.bracket_damping must be a finite number > 0 and <= 0.3, got 0.5; brackets have about 0.005 to 0.1.",
    ),
    "lowpass_hz": (
        {"lowpass_hz": math.nan},
        f"Sensor.lowpass_hz must be a finite number > 0 Hz, got nan; {OFF}.",
    ),
    "lowpass_order": (
        {"lowpass_order": 4.0},
        "Sensor.lowpass_order must be a whole number >= 1 and <= 12, got 4.0.",
    ),
    "lowpass above half": (
        {"lowpass_hz": 125.0, "sample_rate": 250.0},
        f"Sensor.lowpass_hz must be below 125 Hz (half the record's rate of 250 Hz), got 125.0; {OFF}.",
    ),
    "sample_rate": ({"sample_rate": 0}, f"Sensor.sample_rate must be a finite number > 0 Hz, got 0; {OFF}."),
    "offset": ({"offset": math.inf}, "Sensor.offset must be a finite number rad/s^2, got inf."),
    "offset_drift": (
        {"offset_drift": None, "radius": 1.0},
        "Sensor.offset_drift must be a finite number m/s^2/s, got None.",
    ),
    "hum_amplitude": (
        {"hum_amplitude": -1},
        "Sensor.hum_amplitude must be a finite number >= 0 rad/s^2, got -1.",
    ),
    "hum_hz": ({"hum_hz": 0.0}, "Sensor.hum_hz must be a finite number > 0 Hz, got 0.0."),
    "hum_phase": ({"hum_phase": True}, "Sensor.hum_phase must be a finite number rad, got True."),
    "hum_third": ({"hum_third": -0.1}, "Sensor.hum_third must be a finite number >= 0, got -0.1."),
    "noise_snr_db": ({"noise_snr_db": math.inf}, "Sensor.noise_snr_db must be a finite number >= -300 dB, got inf."),
    "noise beyond all numbers": (
        {"noise_snr_db": -1e300},
        "Sensor.noise_snr_db must be a finite number >= -300 dB, got -1e+300.",
    ),
    "noise_density": (
        {"noise_density": -0.1, "radius": 0.4},
        "Sensor.noise_density must be a finite number >= 0 m/s^2/sqrt(Hz), got -0.1.",
    ),
    "two noises": (
        {"noise_snr_db": 30.0, "noise_density": 0.1},
        "Sensor.noise_density must be 0 where noise_snr_db is set, got 0.1; keep one of the two.",
    ),
    "full_scale": (
        {"full_scale": -5.0, "radius": 0.4},
        f"Sensor.full_scale must be a finite number > 0 m/s^2, got -5.0; {OFF}.",
    ),
    "bits": ({"bits": 1, "full_scale": 1.0}, "Sensor.bits must be a whole number >= 2 and <= 32, got 1."),
    "bits alone": (
        {"bits": 16},
        "Sensor.full_scale must be a finite number > 0 rad/s^2 where bits is set, got None; "
        "state the range that the bits divide.",
    ),
}
RNG_RULE = "one numpy.random.Generator per record, because the sensor has noise"
REFUSED_ON_READING = {
    "bracket too near half the rate": (
        {"bracket_hz": 450.0},
        "Sensor.bracket_hz must be below 450 Hz (0.45 of the 1000 Hz that it reads at), got 450.0; "
        "lower it or simulate at a higher rate.",
    ),
    "bracket lower than rounding": (
        {"bracket_hz": 1e-300},
        "Sensor.bracket_hz must be >= 0.001 Hz (1e-06 of the 1000 Hz that it reads at), got 1e-300; "
        "raise it or leave it out (null) to switch it off.",
    ),
    "lowpass lower than rounding": (
        {"lowpass_hz": 1e-300},
        "Sensor.lowpass_hz must be >= 0.001 Hz (1e-06 of the 1000 Hz that it reads at), got 1e-300; "
        "raise it or leave it out (null) to switch it off.",
    ),
    "bracket above half the rate": (
        {"bracket_hz": 600.0},
        "Sensor.bracket_hz must be below 450 Hz (0.45 of the 1000 Hz that it reads at), got 600.0; "
        "lower it or simulate at a higher rate.",
    ),
    "lowpass": (
        {"lowpass_hz": 500.0},
        f"Sensor.lowpass_hz must be below 500 Hz (half the record's rate of 1000 Hz), got 500.0; {OFF}.",
    ),
    "hum": (
        {"hum_amplitude": 1.0, "hum_hz": 500.0},
        "Sensor.hum_hz must be below 500 Hz (half the record's rate of 1000 Hz), got 500.0; "
        "set hum_amplitude to 0 to switch it off.",
    ),
    "third harmonic": (
        {"hum_amplitude": 1.0, "hum_hz": 200.0, "hum_third": 0.1},
        "Sensor.hum_third must be 0 where its line at 600 Hz is not below 500 Hz "
        "(half the record's rate of 1000 Hz), got 0.1.",
    ),
    "rate that does not divide": (
        {"sample_rate": 300.0, "lowpass_hz": 100.0},
        "Sensor.sample_rate must be the input's rate of 1000 Hz divided by a whole number, got 300.0; "
        "simulate at a whole multiple of it.",
    ),
    "rate above the input's": (
        {"sample_rate": 2000.0},
        "Sensor.sample_rate must be the input's rate of 1000 Hz divided by a whole number, got 2000.0; "
        "simulate at a whole multiple of it.",
    ),
    "lower rate without a filter": (
        {"sample_rate": 250.0},
        "Sensor.lowpass_hz must be set where 1 of 4 samples is kept, got None; choose a cut-off below 125 Hz.",
    ),
    "noise without a generator": (
        {"noise_density": 0.1},
        f"Sensor.read.rng must be {RNG_RULE}, got None; pass numpy.random.default_rng(seed).",
    ),
}


@pytest.mark.parametrize(("change", "sentence"), REFUSED_AT_ONCE.values(), ids=REFUSED_AT_ONCE.keys())
def test_refusal_at_construction_is_one_sentence(change, sentence):
    with pytest.raises(ParameterError, match=f"^{re.escape(sentence)}$"):
        Sensor(**change)


@pytest.mark.parametrize(("change", "sentence"), REFUSED_ON_READING.values(), ids=REFUSED_ON_READING.keys())
def test_refusal_on_reading_is_one_sentence(change, sentence):
    sensor = Sensor(**change)
    with pytest.raises(ParameterError, match=f"^{re.escape(sentence)}$"):
        sensor.read(TRUTH, RATE)
    with pytest.raises(ParameterError, match=f"^{re.escape(sentence)}$"):
        sensor.read_batch(TRUTH[np.newaxis], RATE)


def test_generators_must_be_generators_and_one_per_record():
    sensor, truths = Sensor(noise_density=0.1), np.zeros((3, 100))
    with pytest.raises(ParameterError, match=re.escape(f"{RNG_RULE}, got 7; pass numpy.random.default_rng(seed).")):
        sensor.read(truths[0], RATE, 7)
    with pytest.raises(ParameterError, match=re.escape(f"{RNG_RULE} (3), got 2; pass")):
        sensor.read_batch(truths, RATE, [np.random.default_rng(0)] * 2)


def test_a_constant_record_has_no_signal_to_noise_ratio():
    truths = np.array([TRUTH[:100], np.ones(100)])
    sentence = "Sensor.noise_snr_db needs row 1 of the record to vary, got a constant; set noise_density instead."
    with pytest.raises(SignalError, match=f"^{re.escape(sentence)}$"):
        Sensor(noise_snr_db=30.0).read_batch(truths, RATE, [np.random.default_rng(i) for i in range(2)])


def test_a_record_too_short_after_keeping_every_mth_sample_is_refused():
    sentence = "A sensor's record must hold at least 16 samples at 100 Hz, got 15; simulate for longer."
    with pytest.raises(SignalError, match=f"^{re.escape(sentence)}$"):
        Sensor(lowpass_hz=40.0, sample_rate=100.0).read(np.zeros(150), RATE)


def test_a_bad_acceleration_is_named_by_row_sample_and_time():
    truths = np.zeros((3, 100))
    truths[2, 50] = np.nan
    with pytest.raises(SignalError, match=r"^Sensor\.read_batch\.values .* nan at row 2, sample 50 \(t = 0\.05 s\)"):
        Sensor().read_batch(truths, RATE)
    with pytest.raises(SignalError, match=r"^Sensor\.read\.values .* nan at sample 50 \(t = 0\.05 s\)"):
        Sensor().read(truths[2], RATE)
