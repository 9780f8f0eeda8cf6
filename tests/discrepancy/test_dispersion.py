"""What a residual tells, by how far it bent what was known, on parameters of which each is measured by itself."""

import numpy as np
import pytest

from discrepancy.dispersion import Dispersions, dispersion_of, dispersions
from discrepancy.model import NONE, Hypothesis
from discrepancy.problem import Problem
from tests.discrepancy.toy import SAMPLES, WINDOWS, Chord

MANY = 300


def found(rng: np.random.Generator, true: float, told: float = 100.0, count: int = MANY) -> Dispersions:
    """Parameters drawn from what is known of them, N(0, 1), and measured with information `told` and dispersion `true`;
    a last one of which nothing is known."""
    z = rng.standard_normal(count) + np.sqrt(true / told) * rng.standard_normal(count)
    z = np.append(z, 50.0)
    precision = np.append(np.ones(count), 0.0)
    return dispersions(told * np.eye(count + 1), np.zeros(count + 1), precision, z, 1.0, 1e5)


@pytest.mark.parametrize("true", [300.0, 3000.0])
def test_many_parameters_tell_the_dispersion(true: float) -> None:
    assert found(np.random.default_rng(1), true).typical == pytest.approx(true, rel=0.4)


def test_it_is_the_least_where_nothing_is_bent() -> None:
    assert found(np.random.default_rng(2), 0.0, count=20).typical < 2.5


def test_few_parameters_leave_it_open() -> None:
    """Seed 3: the standard deviation of ln D falls as the parameters become more."""
    spreads = []
    for count in (4, 16, 64):
        one = found(np.random.default_rng(3), 1000.0, count=count)
        logs = np.log(one.values)
        spreads.append(float(np.sqrt(one.shares @ logs**2 - (one.shares @ logs) ** 2)))
    assert spreads[0] > spreads[1] > spreads[2] > 0.05


def test_where_nothing_was_known_nothing_shows_it() -> None:
    one = dispersions(np.eye(2), np.ones(2), np.zeros(2), np.full(2, 9.0), 3.0, 1e5)
    assert (one.values.tolist(), one.shares.tolist(), one.typical) == ([3.0], [1.0], pytest.approx(3.0))


def test_what_the_free_ones_explain_is_no_evidence() -> None:
    """A known parameter that the records tell only together with a free one is as it was known."""
    information = 1e4 * np.ones((2, 2))
    one = dispersions(information, np.zeros(2), np.array([1.0, 0.0]), np.array([5.0, -5.0]), 1.0, 1e5)
    assert one.typical == pytest.approx(dispersions(
        np.zeros((2, 2)), np.zeros(2), np.array([1.0, 0.0]), np.zeros(2), 1.0, 1e5
    ).typical)  # fmt: skip


def test_a_direction_that_the_records_do_not_tell_is_no_evidence() -> None:
    """Its slope is what the derivatives are off by; over so little information it would be a huge distance."""
    told, slope, z = np.diag([100.0, 1e-5]), np.array([0.0, 100.0]), np.array([0.5, 0.0])
    assert dispersions(told, slope, np.ones(2), z, 1.0, 1e5).typical < 3.0


class Starting(Chord):
    """A chord whose windows might have begun elsewhere."""

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1


@pytest.mark.parametrize("made", [Starting, Chord])
def test_one_window_in_which_something_knocks_says_little_of_how_what_is_left_is_correlated(made: type[Chord]) -> None:
    """Seed 5: white noise in all windows but one, where a slow wave is ten times the noise. Windows without start
    states of their own have plain squares, and each its whole say."""
    model = made({}, 5)
    model.y[3] += 10.0 * np.sin(np.linspace(0.0, 12.0, SAMPLES))
    place = Problem(model, NONE).point(np.zeros(1), np.zeros((WINDOWS, model.local_count(NONE))))
    assert (dispersion_of(model, place) < 2.0) == (made is Starting)
