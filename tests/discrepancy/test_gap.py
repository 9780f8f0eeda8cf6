"""The gap of made-up residuals is what its definition says, and its intervals cover."""

import numpy as np
import pytest

from discrepancy.gap import gap_of
from discrepancy.model import NONE, Hypothesis
from discrepancy.place import Point
from discrepancy.subjects.base import View
from tests.discrepancy.toy import Chord


def view(windows: int, samples: int) -> View:
    shape = (windows, samples)
    return View(
        ("a",), "N", np.zeros(windows, dtype=int), np.ones(shape, dtype=bool), np.zeros(shape), np.full(shape, 2.0),
        np.array([0.1]), (False,), (), ("", ""),
    )  # fmt: skip


class Made(Chord):
    """A model of whose samples so many of each window tell anything."""

    def __init__(self, windows: int, samples: int, told: float = 1.0) -> None:
        super().__init__({}, 0)
        self.counts, self._told = np.full(windows, samples), told

    def told(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        return self._told * self.counts


def made(windows: int, samples: int, told: float = 1.0) -> tuple[Made, View]:
    return Made(windows, samples, told), view(windows, samples)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def place(squares: np.ndarray) -> Point:
    return Point(NONE, np.zeros(0), np.zeros((len(squares), 0)), squares, 0.0)


def test_shares_are_those_of_the_definition() -> None:
    """Levels of 5 before and 1.4 after at a noise of 5 % of the record: 25 % and 7 %; (25 - 1.96)/(25 - 1) closed."""
    found = gap_of(place(np.full(8, 2500.0)), place(np.full(8, 196.0)), *made(8, 100), 1.0, rng())
    assert found.noise_floor.value == pytest.approx(0.05)
    assert found.before.value == pytest.approx(0.25)
    assert found.after.value == pytest.approx(0.07)
    assert found.closed_share is not None
    assert found.closed_share.value == pytest.approx(23.04 / 24.0)
    assert found.closed_share.low == pytest.approx(found.closed_share.high)


def test_samples_that_tell_nothing_do_not_count() -> None:
    """A quarter of the samples tell anything: a mean square of 4 before, 1 after, which is the noise."""
    before, after = place(np.full(8, 100.0)), place(np.full(8, 25.0))
    found = gap_of(before, after, *made(8, 100, 0.25), 1.0, rng())
    assert found.closed_share is not None and found.closed_share.value == 1.0
    assert found.after.value / found.noise_floor.value == pytest.approx(1.0)
    assert found.before.value / found.noise_floor.value == pytest.approx(2.0)


def test_without_a_gap_no_share_is_closed() -> None:
    found = gap_of(place(np.full(8, 104.0)), place(np.full(8, 101.0)), *made(8, 100), 1.0, rng())
    assert found.closed_share is None


def test_what_does_not_repeat_is_no_gap() -> None:
    """A mean square of 4.3, where 4 differs between windows that see the same."""
    at = place(np.full(8, 430.0))
    assert gap_of(at, at, *made(8, 100), 4.0, rng()).closed_share is None


@pytest.mark.parametrize("windows", [4, 8, 20])
def test_intervals_cover_the_truth(windows: int) -> None:
    """Seed 3; 60 draws of uneven windows of known mean: 95 % intervals of the gap cover it in 52 or more."""
    draws, inside = np.random.default_rng(3), 0
    for _ in range(60):
        squares = 1000.0 * draws.gamma(3.0, 1.0, windows) / 3.0 * 4.0
        at = place(np.full(windows, 1000.0))
        found = gap_of(place(squares), at, *made(windows, 1000), 1.0, draws).before
        inside += found.low <= 0.1 <= found.high
    assert inside >= 52, inside


def test_intervals_end_where_no_value_can_lie() -> None:
    """Two windows that differ much, the first one brought to its noise: no gap is below 0, no more than all closed."""
    before, after = place(np.array([4000.0, 16000.0])), place(np.array([100.0, 3000.0]))
    found = gap_of(before, after, *made(2, 100), 1.0, rng())
    assert found.before.low == 0.0 and found.closed_share is not None and found.closed_share.high == 1.0


def test_one_window_tells_no_interval() -> None:
    found = gap_of(place(np.array([400.0])), place(np.array([100.0])), *made(1, 100), 1.0, rng())
    assert found.before.value > found.after.value and np.isnan([found.before.low, found.after.high]).all()
