"""Residuals that do not depend on what the sensor's filters remember, nor on the phase of hum. Seed 3."""

import numpy as np
import pytest
import scipy.signal

from discrepancy.indexer.nuisance import free_responses, without_nuisance
from indexer_env.filters import bracket_sections, lowpass_sections

BRACKET, LOWPASS = bracket_sections(22.0, 0.02, 1000.0), lowpass_sections(8.0, 3, 1000.0)
ONE_POLE = lowpass_sections(5.0, 1, 1000.0)


def read(filters: list[np.ndarray], rows: np.ndarray) -> np.ndarray:
    for sections in filters:
        rows = np.asarray(scipy.signal.sosfilt(sections, rows, axis=-1))
    return rows


@pytest.mark.parametrize("filters", [[BRACKET], [LOWPASS], [ONE_POLE], [BRACKET, LOWPASS]])
def test_what_came_before_a_window_plays_no_part(filters: list[np.ndarray]) -> None:
    rows = np.random.default_rng(3).standard_normal((3, 900))
    began_earlier, began_at_rest = read(filters, rows)[:, 400:], read(filters, rows[:, 400:])
    before = np.abs(began_earlier - began_at_rest).max()
    assert before > 0.05
    left = without_nuisance(began_earlier - began_at_rest, filters, 0.0, 0.05)
    assert left == pytest.approx(0.0, abs=1e-9 * before)


@pytest.mark.parametrize(
    ("filters", "states"), [([BRACKET], 2), ([LOWPASS], 3), ([ONE_POLE], 2), ([BRACKET, LOWPASS], 5)]
)
def test_no_more_is_taken_out_than_the_filters_have_states(filters: list[np.ndarray], states: int) -> None:
    basis = free_responses(filters, 500)
    assert basis.shape == (states, 500)
    assert basis @ basis.T == pytest.approx(np.eye(states), abs=1e-9)


@pytest.mark.parametrize("filters", [[], [BRACKET], [LOWPASS, BRACKET]])
def test_white_noise_stays_as_large(filters: list[np.ndarray]) -> None:
    noise = np.random.default_rng(3).standard_normal((2000, 100))
    left = without_nuisance(noise, filters, 0.0, 0.05)
    assert (left**2).mean() == pytest.approx((noise**2).mean(), abs=4.0 * np.sqrt(2.0 / noise.size))


@pytest.mark.parametrize("filters", [[], [BRACKET]])
def test_hum_of_any_phase_is_taken_out_beside_what_filters_remember(filters: list[np.ndarray]) -> None:
    phases, at = np.linspace(0.0, 6.0, 7)[:, None], np.arange(800)
    hum = 0.7 * np.cos(2.0 * np.pi * 0.05 * at + phases)
    memory = free_responses(filters, 800)[0] if filters else np.zeros(800)
    left = without_nuisance(-hum + 5.0 * memory, filters, 0.7, 0.05)
    assert left == pytest.approx(0.0, abs=1e-9)
    assert np.abs(without_nuisance(-hum, filters, 0.4, 0.05)).max() == pytest.approx(0.3, abs=0.05)
    third = 0.7 * 0.3 * np.sin(3.0 * (2.0 * np.pi * 0.05 * at + phases + 0.5 * np.pi))
    left = without_nuisance(-hum - third + 5.0 * memory, filters, 0.7, 0.05, 0.3)
    assert left == pytest.approx(0.0, abs=2e-2)
