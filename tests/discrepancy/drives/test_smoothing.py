"""Differentiation is exact on polynomials and sines; noise is carried along as it comes out."""

import math

import numpy as np
import pytest

from discrepancy.drives.readings import lagged
from discrepancy.drives.smoothing import density, deviation, holding, kernel, margin, passed_noise, smoothed


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_sine_keeps_its_phase_and_loses_what_the_kernel_says(order: int) -> None:
    rate, f, cutoff = 1000.0, 20.0, 60.0
    t = np.arange(2000) / rate
    passed = math.exp(-0.5 * (2.0 * math.pi * f * deviation(cutoff)) ** 2)
    truth = passed * (2.0 * math.pi * f) ** order * np.sin(2.0 * math.pi * f * t + order * math.pi / 2.0)
    inside = slice(margin(cutoff, rate), -margin(cutoff, rate))
    found = smoothed(np.sin(2.0 * math.pi * f * t), cutoff, rate, order)
    assert np.abs(found - truth)[inside].max() < 2e-6 * np.abs(truth).max()


def test_the_cut_off_is_where_3_dB_are_lost() -> None:
    assert math.exp(-0.5 * (2.0 * math.pi * 60.0 * deviation(60.0)) ** 2) == pytest.approx(math.sqrt(0.5))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_kernel_is_exact_on_its_polynomial(order: int) -> None:
    weights = kernel(150.0, 1000.0, order)
    t = np.arange(len(weights)) - len(weights) // 2
    assert weights[::-1] @ (t * 1e-3) ** order == pytest.approx(math.factorial(order), rel=1e-9)
    assert order == 0 or weights.sum() == pytest.approx(0.0, abs=1e-6 * np.abs(weights).max())


@pytest.mark.parametrize(("order", "cutoff"), [(0, 20.0), (1, 60.0), (2, 100.0)])
def test_noise_comes_out_as_it_is_said(order: int, cutoff: float) -> None:
    """Seed 1, 200 000 samples."""
    row = np.random.default_rng(1).standard_normal(200_000)
    found = density(row, 1000.0, 100.0)
    assert found == pytest.approx(2.0 / 1000.0, rel=0.05)
    out = smoothed(row, cutoff, 1000.0, order)[100:-100]
    assert passed_noise(2.0 / 1000.0, cutoff, order) == pytest.approx(float(out.std()), rel=0.03)


def test_a_large_slow_motion_does_not_hide_the_noise() -> None:
    """Seed 2: the motion is a million times the noise."""
    t = np.arange(20_000) / 1000.0
    row = 1e6 * np.sin(2.0 * t) + np.random.default_rng(2).standard_normal(len(t))
    assert density(row, 1000.0, 10.0) == pytest.approx(2.0 / 1000.0, rel=0.1)


def test_what_holds_the_force_leaves_white_noise_out() -> None:
    """Seed 4: a line at 7 Hz in noise of half its rms."""
    t = np.arange(10_000) / 1000.0
    row = np.sin(2.0 * math.pi * 7.0 * t) + 0.35 * np.random.default_rng(4).standard_normal(len(t))
    assert 6.5 < holding(row, 1000.0, 0.95) < 8.0


@pytest.mark.parametrize("samples", [400, 1000, 4000])
def test_noise_is_estimated_without_a_bias(samples: int) -> None:
    """Seed 0, 200 rows: the least of four medians lies below the truth, by a quarter at 400 samples."""
    rng = np.random.default_rng(0)
    found = [density(rng.standard_normal(samples), 1000.0, 100.0) for _ in range(200)]
    assert float(np.mean(found)) == pytest.approx(2.0 / 1000.0, rel=0.05)


def test_what_holds_the_speed_leaves_the_noise_of_the_position_out() -> None:
    """Seed 5: differences make of white noise one that grows up to a quarter of the rate."""
    t = np.arange(10_000) / 1000.0
    row = np.sin(2.0 * math.pi * 3.0 * t) + 3e-3 * np.random.default_rng(5).standard_normal(len(t))
    assert holding(row, 1000.0, 0.99, 1) < 4.0 < holding(np.gradient(row), 1000.0, 0.99)


@pytest.mark.parametrize(("time", "step"), [(0.02, 0.012), (0.02, 0.001), (0.005, 0.006)])
def test_a_lag_is_as_late_as_its_law_says(time: float, step: float) -> None:
    """1 Hz, at up to more than a time constant a sample: a first-order lag is atan(ω τ)/ω late."""
    t, w = np.arange(0.0, 8.0, step), 2.0 * math.pi
    got = lagged(np.sin(w * t), time, step)
    s, c = np.linalg.lstsq(np.stack([np.sin(w * t), np.cos(w * t)], axis=1)[t > 4.0], got[t > 4.0], rcond=None)[0]
    assert math.atan2(-c, s) / w == pytest.approx(math.atan(w * time) / w, rel=0.01)
    assert lagged(np.full(9, 2.0), time, step) == pytest.approx(2.0)
