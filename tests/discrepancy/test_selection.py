"""The score of a set that was fitted, on a linear model whose best place is known under any dispersion."""

import dataclasses

import numpy as np
import pytest

from discrepancy.fit import fit
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Parameter
from discrepancy.problem import Problem
from discrepancy.selection import fitted_set, scores
from tests.discrepancy.toy import Stateless


class Bent(Stateless):
    """y = a x + b x' in 4 windows of 100 samples with noise 1; a and b are known to 0.1, and 0.3 off; seed 3."""

    def __init__(self, high: float = np.inf) -> None:
        rng = np.random.default_rng(3)
        self.parameters = tuple(Parameter(name, "m", 0.0, 0.1, high=high, known=True) for name in "ab")
        self.counts, self.groups = np.full(4, 100), np.zeros(4, dtype=np.int64)
        self.x = rng.standard_normal((2, 4, 100))
        self.y = np.tensordot([0.3, -0.3], self.x, 1) + rng.standard_normal((4, 100))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        values = [[p.value(z) for p, z in zip(self.parameters, point, strict=True)] for point in jobs.points]
        return np.einsum("jk,kjn->jn", np.array(values)[jobs.point], self.x[:, jobs.window]) - self.y[jobs.window]

    def best(self, dispersion: float) -> float:
        """The least of Σ r²/D + Σ z², in closed form."""
        by_z, y = 0.1 * self.x.reshape(2, -1), self.y.ravel()
        z = np.linalg.solve(by_z @ by_z.T / dispersion + np.eye(2), by_z @ y / dispersion)
        return float(((z @ by_z - y) ** 2).sum() / dispersion + z @ z)


@pytest.mark.parametrize("dispersion", [1.0, 10.0, 100.0])
def test_a_set_is_scored_where_it_is_best_under_the_dispersion(dispersion: float) -> None:
    """The fit weighs priors by the mean square alone; at its place the score is too high by up to 18."""
    model = Bent()
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=20).place
    one = dataclasses.replace(fitted_set(model, place, True, 7.0), dispersion=dispersion)
    assert scores((one,), model)[0] == pytest.approx(model.best(dispersion) + 7.0, abs=0.1)
    there = problem.deviance(place, dispersion)
    assert (there - model.best(dispersion) > 2.0) == (dispersion > 1.0)


def test_sets_are_compared_under_the_dispersion_of_the_one_that_leaves_least() -> None:
    model = Bent()
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=20).place
    best = dataclasses.replace(fitted_set(model, place, True, 0.0), dispersion=5.0)
    worse = fitted_set(model, problem.point(np.array([-2.0, 1.0]), np.zeros((4, 0))), True, 0.0, optimum=False)
    worse = dataclasses.replace(worse, dispersion=50.0)
    expected = [scores((best,), model)[0], problem.deviance(worse.place, 5.0)]
    assert scores((best, worse), model) == pytest.approx(expected)
    assert scores((worse, best), model) == pytest.approx(expected[::-1])


def test_what_a_bound_holds_stays_there() -> None:
    model = Bent(high=0.1)
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=20).place
    one = fitted_set(model, place, True, 0.0)
    assert one.information is not None
    assert (np.diag(one.information) > 0.0).tolist() == [False, True]


def test_a_score_is_never_that_of_a_place_beyond_the_bounds() -> None:
    """Under a hundredth of its mean square the set would move from z = 2.4 to 3; a bound stands at 2.7."""
    found = {}
    for high in (0.27, np.inf):
        model = Bent(high=high)
        problem = Problem(model, NONE)
        place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=20).place
        one = dataclasses.replace(fitted_set(model, place, True, 0.0), dispersion=0.01)
        found[high] = scores((one,), model)[0]
        assert found[high] < problem.deviance(place, 0.01)
    assert found[np.inf] == pytest.approx(Bent().best(0.01), abs=0.1)
    assert found[0.27] > found[np.inf] + 10.0


def test_a_place_that_is_no_optimum_is_scored_as_it_is() -> None:
    model = Bent()
    problem = Problem(model, NONE)
    place = problem.point(np.array([1.0, 0.0]), np.zeros((4, 0)))
    one = fitted_set(model, place, True, 0.0, optimum=False)
    assert scores((one,), model)[0] == pytest.approx(problem.deviance(place, one.dispersion))


def test_linear_theory_promises_lighter_priors_no_more_than_half_of_what_a_set_leaves() -> None:
    """A set without information would win more than it leaves: it would win over one that is at the noise."""
    model = Bent()
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((4, 0))), steps=20).place
    one = fitted_set(model, place, True, 3.0)
    assert one.information is not None
    told = dataclasses.replace(one, dispersion=0.01, information=1e-9 * one.information)
    own = float(place.z @ place.z)
    left = problem.deviance(place, 0.01) - own
    assert scores((told,), model)[0] == pytest.approx(0.5 * left + own + 3.0)
