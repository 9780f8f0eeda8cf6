"""Effects of the measuring chain show where theory says."""

import math

import numpy as np
import pytest

from indexer_env.sensors import Sensor

RATE = 1000.0
TIME = np.arange(8000) / RATE
TONE_HZ = 37.0


def reading(effect, values: np.ndarray, sensor: Sensor | None = None) -> np.ndarray:
    return effect.extend_sensor(sensor or Sensor()).read(values, RATE).values


def response(effect, frequency: float) -> complex:
    """Reading over truth at a frequency, from the second half of a long tone."""
    tone = np.sin(2.0 * math.pi * frequency * TIME)
    half = slice(len(TIME) // 2, None)
    basis = np.exp(-2j * math.pi * frequency * TIME[half])
    return (reading(effect, tone)[half] * basis).sum() / (tone[half] * basis).sum()


def test_gain_scales_everything_alike(visible):
    truth = np.sin(2.0 * math.pi * TONE_HZ * TIME)
    np.testing.assert_allclose(reading(visible("sensor.gain", error=0.1), truth), 1.1 * truth, rtol=1e-14)
    twice = reading(visible("sensor.gain", error=0.1), truth, Sensor(gain=-2.0))
    np.testing.assert_allclose(twice, -2.2 * truth, rtol=1e-14)


@pytest.mark.parametrize("frequency", [10.0, 80.0, 200.0])
def test_lowpass_is_a_second_order_butterworth(visible, frequency):
    cut_off = 80.0
    effect = visible("sensor.lowpass", time_constant=1.0 / (2.0 * math.pi * cut_off))
    warped = math.tan(math.pi * frequency / RATE) / math.tan(math.pi * cut_off / RATE)
    assert abs(response(effect, frequency)) == pytest.approx(1.0 / math.sqrt(1.0 + warped**4), rel=1e-3)


@pytest.mark.parametrize("frequency", [0.5, 2.0, 20.0])
def test_highpass_is_an_rc_coupling(visible, frequency):
    """What is constant is gone, and what is slow leads: H = j f/(fc + j f)."""
    cut_off = 0.5
    effect = visible("sensor.highpass", corner=2.0 * math.pi * cut_off)
    assert response(effect, frequency) == pytest.approx(1j * frequency / (cut_off + 1j * frequency), rel=5e-3)


def test_bracket_resonates_at_its_frequency_with_its_damping(visible):
    resonance, damping = 120.0, 0.05
    square = 1.0 / (2.0 * math.pi * resonance) ** 2
    effect = visible("sensor.bracket_resonance", inverse_square=square, damping=damping)
    peak = math.sqrt(1.0 + (2.0 * damping) ** 2) / (2.0 * damping)
    assert abs(response(effect, resonance)) == pytest.approx(peak, rel=0.02)
    assert abs(response(effect, 5.0)) == pytest.approx(1.0, abs=3e-3)
    assert abs(response(effect, 0.5 * resonance)) == pytest.approx(4.0 / 3.0, rel=0.02)


def test_mains_hum_is_a_line_at_its_frequency_and_nowhere_else(visible):
    truth = np.sin(2.0 * math.pi * TONE_HZ * TIME)
    effect = visible("sensor.mains_hum", amplitude=0.3, frequency=60.0, phase=0.7)
    lines = np.abs(np.fft.rfft(reading(effect, truth) - truth)) / (len(TIME) / 2.0)
    place = round(60.0 * len(TIME) / RATE)
    assert lines[place] == pytest.approx(0.3, rel=1e-10)
    assert np.delete(lines, place).max() < 1e-12


def test_offset_drift_is_a_straight_line_added_to_the_drift_at_hand(visible):
    truth = np.sin(2.0 * math.pi * TONE_HZ * TIME)
    added = reading(visible("sensor.offset_drift", rate=0.5), truth, Sensor(offset_drift=0.25)) - truth
    np.testing.assert_allclose(added, 0.75 * TIME, atol=1e-13)
