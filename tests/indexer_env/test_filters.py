"""The sensor's filters against the analytic transfer functions, through the whole reading chain."""

import math

import numpy as np
import pytest
import scipy.signal

from indexer_env.filters import bracket_sections
from indexer_env.sensors import Sensor

RATE = 1000.0


def response(sensor: Sensor, frequencies: np.ndarray, rate: float = RATE) -> np.ndarray:
    """Complex frequency response of the whole chain, from its reading of a unit impulse."""
    impulse = np.zeros(1 << 16)
    impulse[100] = 1.0
    record = sensor.read(impulse, rate)
    k = np.arange(record.values.size) - 100
    return np.array([record.values @ np.exp(-2j * np.pi * f / rate * k) for f in frequencies])


def bracket_theory(frequencies: np.ndarray, natural: float, damping: float) -> np.ndarray:
    r = frequencies / natural
    return (1 + 2j * damping * r) / (1 - r**2 + 2j * damping * r)


@pytest.mark.parametrize("order", [1, 2, 4, 5])
@pytest.mark.parametrize("cutoff", [20.0, 100.0, 400.0])
def test_lowpass_is_the_butterworth_of_its_docstring(order, cutoff):
    frequencies = np.array([1.0, 0.5 * cutoff, 0.9 * cutoff, cutoff, min(2 * cutoff, 450.0)])
    warped = np.tan(np.pi * frequencies / RATE) / np.tan(np.pi * cutoff / RATE)
    prototype = scipy.signal.butter(order, 1.0, analog=True)
    theory = scipy.signal.freqs(*prototype, worN=warped)[1]
    measured = response(Sensor(lowpass_hz=cutoff, lowpass_order=order), frequencies)
    np.testing.assert_allclose(measured, theory, rtol=0, atol=1e-9)
    assert 20 * math.log10(abs(measured[3])) == pytest.approx(-3.0103, abs=1e-4)


def test_lowpass_far_below_the_rate_is_the_analogue_filter():
    frequencies = np.array([5.0, 20.0, 40.0, 80.0])
    theory = scipy.signal.freqs(*scipy.signal.butter(4, 2 * np.pi * 40.0, analog=True), worN=2 * np.pi * frequencies)[1]
    near = np.abs(response(Sensor(lowpass_hz=40.0), frequencies, 1000.0) - theory).max()
    far = np.abs(response(Sensor(lowpass_hz=40.0), frequencies, 4000.0) - theory).max()
    assert near < 0.02
    # The warping of the bilinear transform is of second order in cut-off over rate.
    assert near / far == pytest.approx(16.0, rel=0.05)


@pytest.mark.parametrize(
    ("natural", "damping", "band_error", "low_error"),
    [
        (40.0, 0.02, 5e-4, 1e-3),
        (100.0, 0.02, 1e-3, 7e-4),
        (200.0, 0.02, 0.013, 0.004),
        (350.0, 0.02, 0.25, 0.016),
        (200.0, 0.1, 0.013, 0.013),
    ],
)
def test_bracket_follows_its_transmissibility(natural, damping, band_error, low_error):
    sensor = Sensor(bracket_hz=natural, bracket_damping=damping)
    exact = np.array([natural])
    np.testing.assert_allclose(response(sensor, exact), bracket_theory(exact, natural, damping), rtol=1e-7)
    assert response(sensor, np.array([0.0]))[0] == pytest.approx(1.0, abs=1e-9)
    band = np.linspace(1.0, 1.25 * natural, 60)
    error = np.abs(response(sensor, band)) / np.abs(bracket_theory(band, natural, damping)) - 1.0
    assert np.abs(error).max() < band_error
    low = np.linspace(1.0, min(100.0, natural), 40)
    error = response(sensor, low) / bracket_theory(low, natural, damping) - 1.0
    assert np.abs(error).max() < low_error


def test_bracket_rings_at_its_damped_frequency_and_decays_as_theory_says():
    natural, damping = 90.0, 0.03
    impulse = np.zeros(600)
    impulse[50] = 1.0
    ringing = Sensor(bracket_hz=natural, bracket_damping=damping).read(impulse, RATE).values[60:]
    # A sampled decaying oscillation obeys y[n] = 2 Re(p) y[n-1] - |p|² y[n-2] with p = exp(s / rate).
    past = np.column_stack([ringing[1:-1], ringing[:-2]])
    (first, second), *_ = np.linalg.lstsq(past, ringing[2:], rcond=None)
    pole = np.log(complex(first / 2, math.sqrt(-second - first**2 / 4))) * RATE
    assert abs(pole) / (2 * math.pi) == pytest.approx(natural, rel=1e-9)
    assert -pole.real / abs(pole) == pytest.approx(damping, rel=1e-9)


def test_bracket_beats_the_ready_made_transforms_near_its_peak():
    natural, damping = 320.0, 0.03
    w = 2 * math.pi * natural
    analogue = [2 * damping * w, w * w], [1.0, 2 * damping * w, w * w]
    warped = 2 * RATE * math.tan(w / RATE / 2)
    rivals = {
        "bilinear": scipy.signal.bilinear(
            [2 * damping * warped, warped**2], [1.0, 2 * damping * warped, warped**2], RATE
        ),
        "first-order hold": scipy.signal.cont2discrete(analogue, 1 / RATE, method="foh")[:2],
        "zero-order hold": scipy.signal.cont2discrete(analogue, 1 / RATE, method="zoh")[:2],
    }
    near = np.linspace(1 - damping, 1 + damping, 41) * natural
    theory = bracket_theory(near, natural, damping)
    section = bracket_sections(natural, damping, RATE)[0]
    ours = np.abs(scipy.signal.freqz(section[:3], section[3:], near, fs=RATE)[1] / theory - 1).max()
    assert ours < 0.02
    for name, (numerator, denominator) in rivals.items():
        other = scipy.signal.freqz(np.ravel(numerator), denominator, near, fs=RATE)[1]
        assert np.abs(other / theory - 1).max() > 10 * ours, name


@pytest.mark.parametrize("sensor", [Sensor(bracket_hz=120.0), Sensor(lowpass_hz=100.0)], ids=["bracket", "lowpass"])
def test_filters_start_in_the_steady_state_of_the_first_sample(sensor):
    level = np.full(2000, -4.2)
    np.testing.assert_allclose(sensor.read(level, RATE).values, -4.2, rtol=1e-9)


@pytest.mark.parametrize("sensor", [Sensor(bracket_hz=120.0), Sensor(lowpass_hz=100.0)], ids=["bracket", "lowpass"])
def test_filters_do_not_know_the_future(sensor):
    truth = np.sin(np.arange(4000) / 10.0)
    changed = truth.copy()
    changed[1500:] += 10.0
    before, after = sensor.read(truth, RATE).values, sensor.read(changed, RATE).values
    assert before[:1500].tobytes() == after[:1500].tobytes()
    assert before[1500] != after[1500]


def test_a_lower_rate_keeps_every_mth_sample_of_the_filtered_signal():
    truth = np.sin(np.arange(4001) / 10.0)
    slow = Sensor(lowpass_hz=80.0, sample_rate=250.0).read(truth, RATE)
    assert slow.sample_rate == Sensor(lowpass_hz=80.0, sample_rate=250.0).record_rate(RATE) == 250.0
    np.testing.assert_array_equal(slow.values, Sensor(lowpass_hz=80.0).read(truth, RATE).values[::4])
    assert slow.values.size == Sensor(lowpass_hz=80.0, sample_rate=250.0).record_samples(4001, RATE) == 1001
