"""Residuals that do not depend on what the sensor's filters remember of the time before a window. Seed 3."""

import numpy as np
import pytest
import scipy.signal

from discrepancy.indexer.memory import forgetful, free_responses
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
    assert forgetful(began_earlier - began_at_rest, filters) == pytest.approx(0.0, abs=1e-9 * before)


@pytest.mark.parametrize(
    ("filters", "states"), [([BRACKET], 2), ([LOWPASS], 3), ([ONE_POLE], 2), ([BRACKET, LOWPASS], 5)]
)
def test_no_more_is_taken_out_than_the_filters_have_states(filters: list[np.ndarray], states: int) -> None:
    basis = free_responses(filters, 500)
    assert basis.shape == (500, states)
    assert basis.T @ basis == pytest.approx(np.eye(states), abs=1e-9)
    noise = np.random.default_rng(3).standard_normal((2000, 500))
    left = (forgetful(noise, filters) ** 2).sum() / (noise**2).sum()
    assert left == pytest.approx(1.0 - states / 500, abs=3.0 * np.sqrt(2.0 * states / 2000) / 500)
