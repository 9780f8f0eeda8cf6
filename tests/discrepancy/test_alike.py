"""When two effects that explain the records are told apart, and when they are not."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.candidates import Candidate
from discrepancy.model import NONE
from discrepancy.naming import alike
from discrepancy.problem import Point

SAMPLES = 1000.0
GAIN = 50_000.0


def candidate(levels: list[float], name: str = "effect") -> Candidate:
    """A candidate that leaves windows of 1000 samples at these levels (rms over noise)."""
    squares = np.array(levels) ** 2
    losses = SAMPLES * np.log1p(squares)
    place = Point(NONE, np.zeros(0), np.zeros((len(levels), 0)), SAMPLES * squares, float(losses.sum()))
    level, typical = math.sqrt(squares.mean()), math.sqrt(float(np.median(squares)))
    return Candidate(name, place, place.cost, level, level, True, typical, losses)


AT_NOISE = [1.0] * 18


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        (AT_NOISE, True),  # as good
        ([1.02] * 18, False),  # a little worse in every window
        ([1.0] * 17 + [1.6], True),  # one window missed
    ],
)
def test_an_effect_at_the_noise_is_told_from_what_is_behind_in_most_windows(levels: list, expected: bool) -> None:
    assert alike(candidate(AT_NOISE), candidate(levels), GAIN) is expected


def test_an_effect_at_the_noise_is_told_from_one_that_is_not() -> None:
    best = candidate(AT_NOISE)
    behind = dataclasses.replace(best, score=best.score + 100.0)
    assert alike(best, behind, GAIN)
    assert not alike(best, dataclasses.replace(behind, typical=1.1), GAIN)


def test_far_from_the_noise_a_share_of_the_gain_is_needed() -> None:
    best, other = candidate([1.5] * 18), candidate([1.55] * 18)
    assert 0.0 < other.score - best.score < 0.05 * GAIN
    assert alike(best, other, GAIN)
    assert not alike(best, candidate([1.9] * 18), GAIN)


def test_a_lead_is_that_of_the_typical_window() -> None:
    best = candidate(AT_NOISE)
    assert best.lead(candidate([1.0] * 17 + [5.0])) == 0.0
    assert best.lead(candidate([1.2] * 18)) == pytest.approx(18 * SAMPLES * math.log((1.0 + 1.44) / 2.0))
