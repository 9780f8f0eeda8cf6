"""Intervals and weak directions, on a model whose answer is known in closed form."""

import numpy as np
import pytest
from scipy.stats import t

from discrepancy.estimates import estimates_of
from discrepancy.fit import fit
from discrepancy.model import NONE, Hypothesis, Jobs, Model, Parameter
from discrepancy.problem import Problem
from tests.discrepancy.toy import Stateless


class Line(Stateless):
    """y = a x + b x in 4 windows of 25 samples with noise 1: only a + b is determined, a is known to 0.1."""

    def __init__(self, a: float, rng: np.random.Generator) -> None:
        self.parameters = (
            Parameter("a", "m", 0.0, 0.1, known=True),
            Parameter("b", "m", 0.0, 1.0, low=-0.5, known=True),
        )
        self.counts, self.groups = np.full(4, 25), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 1.0, 100).reshape(4, 25)
        self.y = a * self.x + rng.standard_normal((4, 25))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        slope = np.array(
            [sum(p.value(z) for p, z in zip(self.parameters, point, strict=True)) for point in jobs.points]
        )
        return slope[jobs.point][:, None] * self.x[jobs.window] - self.y[jobs.window]


def fitted(model: Model):
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(2), np.zeros((len(model.counts), 0))), steps=20).place
    return estimates_of(model, place)


def test_intervals_are_those_of_least_squares_with_priors() -> None:
    """Seed 8: the covariance is (Jᵀ J + P)⁻¹ in closed form, within the 5 % that random weights of windows make."""
    model = Line(0.05, np.random.default_rng(8))
    by_z = np.stack([0.1 * model.x.ravel(), model.x.ravel()])
    spread = np.sqrt(np.diag(np.linalg.inv(by_z @ by_z.T + np.eye(2)))) * [0.1, 1.0]
    for estimate, expected in zip(fitted(model).estimates, spread, strict=True):
        half = t.ppf(0.975, 3) * expected
        assert (estimate.high - estimate.low) / 2.0 == pytest.approx(half, rel=0.1)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Seed 9, 200 sets of data, truth drawn from the priors: 95 % or more, within 4 standard deviations of such a
    count; four windows widen the intervals though only the curvature is at work."""
    rng = np.random.default_rng(9)
    held = 0
    for _ in range(200):
        a, b = 0.1 * rng.standard_normal(), rng.standard_normal()
        if b < -0.4:
            a, b = -a, -b
        low, high = (e := fitted(Line(a + b, rng)).estimates[1]).low, e.high
        held += low <= b <= high
    assert 0.89 <= held / 200 <= 1.0


def test_windows_that_disagree_widen_what_they_disagree_about() -> None:
    """Seed 10: the slope of each of 40 windows is drawn anew, 0.5 about 1; the interval is that of their mean."""
    rng = np.random.default_rng(10)
    model = Line(0.0, rng)
    model.counts, model.groups = np.full(40, 25), np.zeros(40, dtype=np.int64)
    model.x = np.tile(np.linspace(0.5, 1.0, 25), (40, 1))
    slopes = 1.0 + 0.5 * rng.standard_normal((40, 1))
    model.y = slopes * model.x + 0.1 * rng.standard_normal((40, 25))
    estimate = fitted(model).estimates[1]
    told = (estimate.high - estimate.low) / (2.0 * t.ppf(0.975, 39))
    # no less than the spread of the mean tells; what is left is correlated within a window, which is taken for less
    spread = np.hypot(slopes.std(ddof=1) / np.sqrt(40.0), 0.1)
    assert 0.9 * spread < told < 1.8 * spread


def test_what_the_records_cannot_tell_is_named() -> None:
    told = fitted(Line(0.05, np.random.default_rng(8))).calibration(2)
    assert told.undetermined == ("a +1.00",)
    assert [e.moved is not None for e in told.estimates] == [True, True]


def test_a_bound_that_was_hit_is_told() -> None:
    told = fitted(Line(-3.0, np.random.default_rng(8))).calibration(2)
    assert told.bounds_hit == ("b",)


@pytest.mark.parametrize("low", [-0.5, -9.0])
def test_a_bound_is_no_knowledge(low: float) -> None:
    """Only a + b is determined: a is as uncertain where b is at its bound as where it is not, by what is known of b."""
    model = Line(0.0, np.random.default_rng(8))
    model.parameters = (model.parameters[0], Parameter("b", "m", 0.0, 0.1, low=low * 0.1, known=True))
    model.x = 20.0 * model.x
    model.y = model.y - 0.15 * model.x
    a, b = fitted(model).estimates
    assert (b.value == pytest.approx(-0.05)) == (low == -0.5)
    assert (a.high - a.low) / (2.0 * t.ppf(0.975, 3)) == pytest.approx(0.1 / 2.0**0.5, rel=0.1)


@pytest.mark.parametrize(("slope", "raised"), [(-0.1, False), (-0.5, True)])
def test_a_machine_that_is_bent_beyond_belief_tells_less(slope: float, raised: bool) -> None:
    """Seed 8: a and b are known to 0.1 each, their sum is measured to 0.005; of a sum of 0.5 the records are not
    believed, as the machine then were 2.5 standard deviations off in both."""
    model = Line(0.0, np.random.default_rng(8))
    model.parameters = (model.parameters[0], Parameter("b", "m", 0.0, 0.1, known=True))
    model.x = 20.0 * model.x
    model.y = model.y + slope * model.x
    told = fitted(model)
    a, b = told.estimates
    assert (a.value + b.value > 0.9 * slope) == raised
    assert (told.dispersion > 10.0) == raised
