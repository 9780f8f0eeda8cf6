"""The anti-alias filter and the spline behind it: flat, dark and exact, in numbers."""

from __future__ import annotations

import numpy as np
import pytest

from indexer_env.errors import SignalError
from indexer_records.resample import ATTENUATION, MOST_UPSAMPLING, PASSBAND, STOPBAND, factors, on_grid, resampled

TARGET = 1000.0
RATES = [1000.0, 1024.0, 2000.0, 2560.0, 4000.0, 8192.0, 25600.0, 44100.0, 51200.0, 12345.678]


def tone(frequency: float, rate: float, seconds: float = 3.0) -> np.ndarray:
    return np.cos(2.0 * np.pi * frequency * np.arange(round(seconds * rate)) / rate)


def one(values: np.ndarray, rate: float, start: float, samples: int, step: float = 1.0 / TARGET) -> np.ndarray:
    return resampled(values, rate, TARGET, np.array([start]), np.array([step]), samples)[0]


@pytest.mark.parametrize("rate", RATES)
def test_the_passband_is_flat_and_in_phase(rate):
    """Up to 0.4 of the lower rate the record is that of the continuous tone, to 3e-5: 0.0003 dB."""
    start = 1.0 + 0.3e-3
    times = start + np.arange(1000) / TARGET
    for frequency in (1.0, 50.0, 200.0, PASSBAND * min(rate, TARGET)):
        found = one(tone(frequency, rate), rate, start, 1000)
        np.testing.assert_allclose(found, np.cos(2.0 * np.pi * frequency * times), rtol=0, atol=3e-5)


@pytest.mark.parametrize("rate", [rate for rate in RATES if rate >= 2000.0])
def test_what_would_fold_down_is_taken_out(rate):
    """From 0.5 of the wanted rate on every tone is 100 dB down at least, wherever it would fold to."""
    for frequency in (STOPBAND * TARGET, 600.0, 0.9 * TARGET, 0.49 * rate):
        found = one(tone(frequency, rate), rate, 1.0003, 1000)
        assert 20.0 * np.log10(np.abs(found).max()) < -ATTENUATION, frequency


def test_without_the_filter_the_same_tone_would_fold_down():
    """The test above can fail: every other sample of a 900 Hz tone at 2 kHz is a tone of 100 Hz."""
    folded = tone(900.0, 2000.0)[::2]
    assert np.abs(folded[:1000] - tone(100.0, TARGET)[:1000]).max() < 1e-9


@pytest.mark.parametrize(("rate", "up", "down"), [(1000.0, 4, 1), (25600.0, 5, 32), (51200.0, 5, 64), (8000.0, 1, 2)])
def test_rational_ratios_are_exact(rate, up, down):
    assert factors(rate, TARGET) == (up, down)


@pytest.mark.parametrize("rate", [997.7, 12345.678])
def test_other_ratios_do_not_drift(rate):
    """After 100 s a ratio that no small numbers express is still in phase to 1e-4 rad at 10 Hz."""
    values = tone(10.0, rate, 102.0)
    times = 100.0 + np.arange(500) / TARGET
    np.testing.assert_allclose(one(values, rate, 100.0, 500), np.cos(2 * np.pi * 10.0 * times), atol=1e-4)


def test_samples_on_the_grid_are_untouched():
    values = np.random.default_rng(0).normal(size=3000)
    starts, steps = np.array([0.0, 0.5, 1.25]), np.full(3, 1e-3)
    found = resampled(values, TARGET, TARGET, starts, steps, 700)
    np.testing.assert_array_equal(found, [values[:700], values[500:1200], values[1250:1950]])


def test_one_stretch_off_the_grid_sends_all_through_the_filter():
    """Records of one file are treated alike, else a class could be told by its filter."""
    values = np.random.default_rng(0).normal(size=3000)
    starts, steps = np.array([0.5, 1.2505]), np.full(2, 1e-3)
    found = resampled(values, TARGET, TARGET, starts, steps, 700)
    assert np.abs(found[0] - values[500:1200]).max() > 0.01


def test_a_stretched_turn_keeps_its_orders():
    """Spread evenly over its own duration, the 20th order is the same record at any speed."""
    rate = 10_000.0
    for duration in (0.98, 1.0, 1.013):
        found = one(tone(20.0 / duration, rate), rate, 0.7 * duration, 1000, duration / 1000)
        np.testing.assert_allclose(found, np.cos(2 * np.pi * 20.0 * (0.7 + np.arange(1000) / 1000)), atol=1e-4)


@pytest.mark.parametrize("durations", [[1.0, 1.2], [1.2, 1.2], [1.2, 0.98, 1.0]])
def test_nothing_folds_down_in_a_turn_that_is_stretched(durations):
    """At a step of 1.2 ms a tone of 430 Hz lies above half the rate, and within the band of a turn of 1 ms."""
    rate, steps = 10_000.0, np.array(durations) / 1000
    found = resampled(tone(430.0, rate, 5.0), rate, TARGET, 0.7 + np.arange(len(steps)), steps, 1000)
    for record, duration in zip(found, durations, strict=True):
        largest = np.abs(record[100:900]).max()
        assert largest < 1e-5 if 430.0 * duration > 500.0 else largest > 0.1


def test_the_same_samples_are_given_after_weeks():
    """The rounding of time by rate grows with both."""
    for turn in range(2 * 10**7, 2 * 10**7 + 200):
        assert on_grid(51200.0, 51200.0, np.array([turn * 1.1]), np.array([1 / 51200.0]), 56320)
    assert not on_grid(1000.0, 1000.0, np.array([8.2 + 1e-8]), np.array([1e-3]), 8200)


@pytest.mark.parametrize("rate", [999.5, 999.999, 1000.001, 1000.9])
def test_a_clock_that_is_a_hair_off_sends_nothing_through_the_filter(rate):
    """Beside files of the very rate, a class could else be told by its filter."""
    values = np.random.default_rng(0).normal(size=3001)
    starts = np.array([0.0, 1.0, 2.0])
    found = resampled(values, rate, TARGET, starts, np.full(3, 1e-3), 1000)
    np.testing.assert_array_equal(found, [values[:1000], *(values[at : at + 1000] for at in found_at(values, found))])
    assert all(abs(at - start * rate) <= 1.0 for at, start in zip(found_at(values, found), starts[1:], strict=True))
    assert not on_grid(1002.0, TARGET, starts, np.full(3, 1e-3), 1000)


def found_at(values: np.ndarray, found: np.ndarray) -> list[int]:
    return [int(np.flatnonzero(values == record[0])[0]) for record in found[1:]]


def test_samples_that_a_file_does_not_have_are_not_made():
    values = tone(10.0, 500.0)
    with pytest.raises(SignalError, match=r"at most 1.1 times the rate of the file, got 1000 Hz for a file of 500 Hz"):
        one(values, 500.0, 0.5, 500)
    assert one(tone(10.0, 910.0), 910.0, 0.5, 500).shape == (500,)
    assert MOST_UPSAMPLING * 909.0 < TARGET
    with pytest.raises(SignalError, match="sample_rate=909"):
        one(tone(10.0, 909.0), 909.0, 0.5, 500)
