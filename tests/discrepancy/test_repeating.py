"""Filters of windows that repeat each other, against filters that ran through all repetitions. Seed 3."""

import numpy as np
import pytest
import scipy.signal

from discrepancy.indexer.repeating import repeating
from indexer_env.filters import bracket_sections, lowpass_sections

SECTIONS = [bracket_sections(22.0, 0.02, 1000.0), lowpass_sections(8.0, 3, 1000.0), lowpass_sections(5.0, 1, 1000.0)]


def from_rest(sections: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return np.asarray(scipy.signal.sosfilt(sections, rows, axis=-1))


@pytest.mark.parametrize("sections", SECTIONS)
def test_a_whole_period_repeats_exactly(sections: np.ndarray) -> None:
    rows = np.random.default_rng(3).standard_normal((2, 400))
    expected = from_rest(sections, np.tile(rows, 30))[:, -400:]
    assert repeating(sections, rows, 400.0) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("sections", SECTIONS)
def test_a_period_between_samples(sections: np.ndarray) -> None:
    period, turns = 400.37, 25
    at = np.arange(int(period * turns) + 1000)
    knocks = np.exp(-0.5 * ((np.mod(at, period) - 150.0) / 15.0) ** 2)
    begin = int(np.ceil(period * turns))
    expected = from_rest(sections, knocks)[begin : begin + 401]
    # what lies beyond the period plays no part in how a window begins
    window = np.append(knocks[begin : begin + 401], 1e3)
    found = repeating(sections, window[None], period)[0, :401]
    assert found == pytest.approx(expected, abs=2e-5 * np.abs(expected).max())
    at_rest = from_rest(sections, window)[:401]
    assert np.abs(found - expected).max() < 0.02 * np.abs(at_rest - expected).max()


def test_a_window_that_was_cut_short_stays_at_nought() -> None:
    sections, rows = SECTIONS[0], np.zeros((1, 400))
    rows[0, 50:200] = np.random.default_rng(3).standard_normal(150)
    assert repeating(sections, rows[:, :300], 400.0) == pytest.approx(repeating(sections, rows, 400.0)[:, :300])
