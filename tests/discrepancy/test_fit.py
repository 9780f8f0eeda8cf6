"""A fit comes to rest where the records tell little as well, on models whose answer is known. Seeds 4 and 5."""

import logging

import numpy as np
import pytest

from discrepancy.fit import crossed, fit, rested
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Parameter
from discrepancy.problem import Problem
from discrepancy.stages import FITS
from tests.discrepancy.toy import Stateless

RATIO, SUM = 1e4, 3.0
"""Derivatives of the residuals by a - b and by a + b."""


class Valley(Stateless):
    """4 windows of 50 samples, noise 1 (seed 4): the cost is a long valley along a = b, from 0 to 1.5."""

    def __init__(self) -> None:
        self.parameters = (Parameter("a", "-", 0.0, 1.0), Parameter("b", "-", 0.0, 1.0))
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        rng = np.random.default_rng(4)
        across, along = rng.standard_normal((2, 4, 50)) / np.sqrt(200.0)
        self.slopes = np.array([RATIO * across + SUM * along, -RATIO * across + SUM * along])
        self.measured = np.einsum("gwn,g->wn", self.slopes, [1.5, 1.5]) + rng.standard_normal((4, 50))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return (
            np.einsum("gjn,jg->jn", self.slopes[:, jobs.window], jobs.points[jobs.point]) - self.measured[jobs.window]
        )


@pytest.mark.parametrize(("thorough", "left"), [(True, 0.05), (False, 1.0)])
def test_a_thorough_fit_crosses_what_the_records_tell_little_of(thorough: bool, left: float, caplog) -> None:
    """Least squares says where the floor is; damped steps alone stop on the way there. The fit is told of."""
    caplog.set_level(logging.DEBUG, FITS)
    model = Valley()
    flat = model.slopes.reshape(2, -1)
    floor = np.linalg.solve(flat @ flat.T, flat @ model.measured.ravel())
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=30, thorough=thorough).place
    missing = float(abs(place.z - floor).max())
    assert missing < left if thorough else missing > left
    assert caplog.messages == [f"none at {place.level(model):.2f} times the noise"]


def test_a_place_is_crossed_without_a_search() -> None:
    problem = Problem(Valley(), NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=30).place
    thorough = fit(problem, place, steps=30, thorough=True).place
    assert np.abs(place.z - thorough.z).max() > 1.0
    assert crossed(problem, place).z == pytest.approx(thorough.z, abs=0.05)


class Mirrored(Valley):
    """The same, and a symmetry that leads elsewhere."""

    def kin(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        return point[None] + 1.0


@pytest.mark.parametrize("frozen", [True, False])
def test_where_all_is_held_a_symmetry_is_not_followed(monkeypatch: pytest.MonkeyPatch, frozen: bool) -> None:
    followed = []
    points = Problem.points
    monkeypatch.setattr(Problem, "points", lambda self, z, states: followed.append(z) or points(self, z, states))
    problem = Problem(Mirrored(), NONE, frozen=frozen)
    place = problem.point(np.zeros(2), np.zeros((4, 0)))
    followed.clear()
    rested(problem, place, place)
    assert any(len(z) == 1 and np.abs(z - place.z).min() > 0.5 for z in followed) is not frozen


@pytest.mark.parametrize("fallen", [True, False])
def test_windows_are_searched_again_where_the_cost_has_fallen_since(
    monkeypatch: pytest.MonkeyPatch, fallen: bool
) -> None:
    problem, searched = Problem(Valley(), NONE), []
    monkeypatch.setattr(Problem, "searched", lambda self, place, which=None: searched.append(place) or place)
    place = crossed(problem, problem.point(np.full(2, 1.4), np.zeros((4, 0))))
    before = problem.point(np.full(2, 4.0), np.zeros((4, 0))) if fallen else place
    rested(problem, place, before)
    assert bool(searched) is fallen


class Burrows(Stateless):
    """6 windows of 20 samples, noise 1 (seed 5), each with one start state that tells nothing but within 0.2 of 2.3;
    the grid does not come near."""

    def __init__(self) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1),)
        self.counts, self.groups = np.full(6, 20), np.zeros(6, dtype=np.int64)
        self.noise = np.random.default_rng(5).standard_normal((6, 20))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        missed = 5.0 * (1.0 - np.exp(-(((jobs.states - 2.3) / 0.2) ** 2)))
        return 0.1 * jobs.points[jobs.point] + missed * np.cos(np.arange(20)) - self.noise[jobs.window]

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.array([[-1.0], [0.0], [1.0]])


class Decoys(Burrows):
    """The same with a plateau beyond 9, better than where the way to the burrow begins, at 2.1; and a large grid."""

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        residuals = super().residuals(hypothesis, jobs)
        return np.where(jobs.states > 9.0, residuals - 3.5 * np.cos(np.arange(20)), residuals)

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.concatenate([np.linspace(-90.0, -1.0, 85), [2.1, 10.0, 11.0, 12.0, 13.0]])[:, None]


def test_windows_searched_in_parts_find_the_same(monkeypatch) -> None:
    """Bounded memory changes nothing, also where a window's grid alone is more than the bound."""
    problem = Problem(Decoys(), NONE)
    start = problem.point(np.zeros(1), np.linspace(-3.0, 3.0, 6)[:, None])
    named = np.array([0, 2, 3, 5])
    at_once = problem.searched(start, named)
    for most in (200, 1):
        monkeypatch.setattr("discrepancy.problem._AT_ONCE", most)
        in_parts = problem.searched(start, named)
        assert np.array_equal(in_parts.states, at_once.states)
        assert in_parts.cost == at_once.cost < start.cost


class Far(Stateless):
    """4 windows of 50 samples (seed 4): a parameter that seems to be at `at`, and no more than `high`; the start state
    of each window must go with it."""

    def __init__(self, at: float, high: float) -> None:
        self.parameters = (Parameter("a", "-", 0.0, 1.0, -90.0, high),)
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.at = at
        self.slope, self.stiff = np.random.default_rng(4).standard_normal((2, 4, 50))

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        z = jobs.points[jobs.point]
        return (z - self.at) * self.slope[jobs.window] + 5.0 * (z - jobs.states) * self.stiff[jobs.window]


@pytest.mark.parametrize(
    ("at", "high", "reached"), [(1.2, 90.0, 1.0), (2.2, 90.0, 2.0), (4.0, 90.0, 4.0), (9.0, 90.0, 4.0), (9.0, 2.5, 2.0)]
)
def test_a_step_goes_on_to_twice_and_four_times_its_length_where_that_is_better(
    at: float, high: float, reached: float
) -> None:
    """A single step is no longer than the scale of the parameter."""
    problem = Problem(Far(at, high), NONE)
    place = fit(problem, problem.point(np.zeros(1), np.zeros((4, 1))), steps=1).place
    assert place.z[0] == pytest.approx(reached)


class Wells(Stateless):
    """4 windows of 50 samples, noise 1 (seed 4), of which a known parameter leaves a shape but in two wells: `nominal`
    of it at 0 and `other` at `at`."""

    def __init__(self, at: float, nominal: float, other: float) -> None:
        self.parameters = (Parameter("a", "-", 0.0, 1.0, -9.0, 9.0, known=True),)
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.at, self.nominal, self.other = at, nominal, other
        self.shape, self.noise = np.random.default_rng(4).standard_normal((2, 4, 50))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        z = jobs.points[jobs.point]
        left = 1.0 - (1.0 - self.nominal) * np.exp(-((z / 0.3) ** 2))
        left = left - (1.0 - self.other) * np.exp(-(((z - self.at) / 0.3) ** 2))
        return left * self.shape[jobs.window] - self.noise[jobs.window]


@pytest.mark.parametrize(
    ("at", "nominal", "other", "ends"), [(3.0, 0.0, 0.6, 0.0), (3.0, 0.9, 0.1, 3.0), (1.6, 0.0, 0.6, 1.6)]
)
def test_a_strange_parameter_is_tried_anew_from_nominal_and_stays_where_that_is_no_better(
    at: float, nominal: float, other: float, ends: float
) -> None:
    """Strange is what is farther off than two standard deviations."""
    problem = Problem(Wells(at, nominal, other), NONE)
    start = problem.point(np.array([at]), np.zeros((4, 0)))
    assert fit(problem, start, steps=30).place.z[0] == pytest.approx(at, abs=0.3)
    assert fit(problem, start, steps=30, thorough=True).place.z[0] == pytest.approx(ends, abs=0.3)
