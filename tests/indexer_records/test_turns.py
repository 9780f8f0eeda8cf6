"""Pulses become turns, to a fraction of a sample, and what is no turn is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from indexer_env.errors import SignalError
from indexer_records.conditions import Pulse
from indexer_records.turns import pulse_edges, turns_by_period, turns_by_pulse

RATE = 1000.0


def trapezoid(at: list[float], high: float = 5.0, rise: float = 0.004, width: float = 0.02) -> np.ndarray:
    """Five seconds with pulses whose rising edge is half-way up at the times `at` [s], the falling `width` later."""
    times = np.arange(5000) / RATE

    def edges(shift: float) -> np.ndarray:
        return np.sum([np.clip((times - begin - shift) / rise + 0.5, 0.0, 1.0) for begin in at], axis=0)

    return high * (edges(0.0) - edges(width))


def test_edges_are_found_between_the_samples():
    at = [0.31234, 1.30071, 2.29965]
    np.testing.assert_allclose(pulse_edges(trapezoid(at), RATE, Pulse()), at, atol=1e-9)
    falling = pulse_edges(trapezoid(at), RATE, Pulse(edge="falling"))
    np.testing.assert_allclose(falling, np.array(at) + 0.02, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-300, -3.0, 1.0, 1e300, 1.7e308])
def test_the_unit_of_the_pulse_does_not_matter(scale):
    at = [0.5, 1.5, 2.5]
    edge = "rising" if scale > 0 else "falling"
    np.testing.assert_allclose(pulse_edges(trapezoid(at, high=1.0) * scale, RATE, Pulse(edge=edge)), at, atol=1e-9)


def test_noise_on_an_edge_is_no_second_pulse():
    rng = np.random.default_rng(2)
    at = [0.5, 1.5, 2.5, 3.5]
    pulse = trapezoid(at, rise=0.03, width=0.2) + rng.uniform(-0.4, 0.4, size=5000)
    edges = pulse_edges(pulse, RATE, Pulse())
    assert len(edges) == 4
    np.testing.assert_allclose(edges, at, atol=0.003)


def test_a_file_that_begins_within_a_pulse():
    pulse = trapezoid([0.0, 1.0, 2.0])[10:]
    np.testing.assert_allclose(pulse_edges(pulse, RATE, Pulse()), [0.99, 1.99], atol=1e-9)


def test_a_threshold_of_ones_own():
    at = [0.5, 1.5]
    early = pulse_edges(trapezoid(at), RATE, Pulse(threshold=1.0))
    np.testing.assert_allclose(early, np.array(at) - 0.3 * 0.004, atol=1e-9)
    with pytest.raises(SignalError, match="threshold must lie within the pulse, 0 to 5, got 9"):
        pulse_edges(trapezoid(at), RATE, Pulse(threshold=9.0))


def test_a_dead_or_single_pulse_is_refused():
    with pytest.raises(SignalError, match="must change, got 2 throughout"):
        pulse_edges(np.full(100, 2.0), RATE, Pulse())
    told = r"two rising edges at least, got 1 across 2.5; record more turns, or .* \(pulse.threshold=NUMBER\)"
    with pytest.raises(SignalError, match=told):
        pulse_edges(trapezoid([1.0]), RATE, Pulse())


@pytest.mark.parametrize("glitch", [-6.0, 12.0])
def test_a_glitch_hides_no_pulses(glitch):
    """Half-way between its extremes nothing else crosses."""
    at, rng = [0.5, 1.5, 2.5, 3.5], np.random.default_rng(2)
    pulse = trapezoid(at) + 0.05 * rng.standard_normal(5000)
    pulse[2000] = glitch
    edges = pulse_edges(pulse, RATE, Pulse())
    assert len(edges) == (5 if glitch > 0.0 else 4)
    np.testing.assert_allclose([edge for edge in edges if abs(edge - 2.0) > 0.1], at, atol=2e-4)


@pytest.mark.parametrize("extra", [np.zeros(5000), 2.0 * trapezoid([2.0]) / 5.0])
def test_one_pulse_is_no_glitch_on_noise_or_on_its_bounce(extra):
    pulse = trapezoid([1.0]) + extra + 0.2 * np.random.default_rng(2).standard_normal(5000)
    assert pulse_edges(pulse, RATE, Pulse(), least=1) == pytest.approx([1.0], abs=1e-3)


@pytest.mark.parametrize("offset", [0.0, 0.3])
@pytest.mark.parametrize("edge", ["rising", "falling"])
@pytest.mark.parametrize("polarity", [-1.0, 1.0])
def test_an_inductive_pulse_is_timed_by_itself_and_not_by_the_noise_of_its_baseline(polarity, edge, offset):
    at = np.array([0.5, 1.5, 2.5, 3.5])
    times = (np.arange(5000) / RATE - at[:, None]) / 0.004
    pulse = offset + polarity * np.sum(5.0 * times * np.exp(0.5 - 0.5 * times**2), axis=0)
    edges = pulse_edges(pulse + 0.05 * np.random.default_rng(0).standard_normal(5000), RATE, Pulse(edge=edge))
    assert len(edges) == 4
    np.testing.assert_allclose(np.diff(edges), 1.0, atol=3e-4)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=2, max_size=60))
def test_any_channel_gives_ascending_edges_within_it_or_a_sentence(values):
    try:
        edges = pulse_edges(np.array(values), 1.0, Pulse())
    except SignalError as error:
        assert "\n" not in str(error)
    else:
        assert (np.diff(edges) > 0.0).all() and edges[0] >= 0.0 and edges[-1] <= len(values) - 1


def test_turns_between_pulses_and_the_words_for_those_that_are_none():
    edges = np.array([0.4, 1.41, 2.4, 4.4, 4.7, 5.7, 6.8])
    turns, partial = turns_by_pulse(edges, 1.0, 0.02)
    assert partial == 2
    assert [turn.start for turn in turns] == edges[:-1].tolist()
    words = ["", "", "1 pulse was missed", "a pulse too many", "", "another speed"]
    for turn, word in zip(turns, words, strict=True):
        assert word in turn.problem and bool(word) == bool(turn.problem)


def test_turns_by_the_period():
    turns, partial = turns_by_period(25.0, 8.2)
    assert [turn.start for turn in turns] == pytest.approx([0.0, 8.2, 16.4]) and partial == 1
    assert turns_by_period(24.6, 8.2)[1] == 0
    assert len(turns_by_period(24.6, 8.2)[0]) == 3
    assert turns_by_period(8.1, 8.2) == ([], 1)
