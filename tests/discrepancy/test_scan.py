"""Starts far from each other in the library's lists, and those with the other sign. Seed 4."""

import numpy as np
import pytest

from discrepancy.fit import fit
from discrepancy.model import NONE, Hypothesis, Jobs, Parameter
from discrepancy.problem import Point, Problem
from discrepancy.scan import Scanner, Start, apart, beside
from discrepancy.starts import further
from tests.discrepancy.toy import Stateless

PARAMETERS = (Parameter("wave.size", "m", 0.0, 0.1), Parameter("wave.place", "rad", 0.0, 0.5))
STARTS = tuple((size, place) for size in (1.0, 3.0, 9.0) for place in (0.0, 0.1, 0.2, 0.3))


def start(size: float, place: float, promised: float, station: int = 0) -> Start:
    hypothesis = Hypothesis("wave", PARAMETERS, {"station": station}, STARTS)
    # the base model's own parameters stand first
    z = np.concatenate([[0.7, -0.3], hypothesis.coordinates((size, place))])
    return Start(hypothesis, Point(hypothesis, z, np.zeros((1, 0)), np.zeros(1), promised), promised)


def test_a_start_knows_its_values() -> None:
    assert start(3.0, 0.2, 0.0).values == pytest.approx((3.0, 0.2))


def test_no_two_stand_side_by_side() -> None:
    best, next_size, diagonal, far, elsewhere = (
        start(3.0, 0.1, 1.0), start(9.0, 0.1, 2.0), start(1.0, 0.2, 3.0), start(3.0, 0.3, 4.0), start(3.0, 0.1, 5.0, 2)
    )  # fmt: skip
    assert apart([best, next_size, diagonal, far, elsewhere], 6) == [best, far, elsewhere]
    assert apart([best, next_size, diagonal, far, elsewhere], 2) == [best, far]


def test_a_start_of_any_size_lies_beside_another_by_its_shape() -> None:
    low, high = start(1.0, 0.1, 1.0), start(-9.0, 0.2, 2.0)
    assert beside(low, high, 1, first=1)
    assert not beside(low, start(9.0, 0.1, 2.0), 1)
    assert not beside(low, start(1.0, 0.3, 2.0), 1, first=1)
    assert not beside(low, start(1.0, 0.1, 2.0, station=2), 1)


def test_the_other_sign_is_tried_nearby_on_either_side() -> None:
    signed = tuple(
        (sign * size, place) for sign in (1.0, -1.0) for size in (1.0, 3.0) for place in np.arange(0.0, 0.8, 0.1)
    )

    def of(size: float, place: float, promised: float) -> Start:
        hypothesis = Hypothesis("wave", PARAMETERS, {}, signed)
        z = hypothesis.coordinates((size, place))
        return Start(hypothesis, Point(hypothesis, z, np.zeros((1, 0)), np.zeros(1), promised), promised)

    best, same, far, left, beside_left, right = (
        of(3.0, 0.3, 1.0), of(1.0, 0.3, 2.0), of(-3.0, 0.7, 3.0),
        of(-3.0, 0.2, 4.0), of(-1.0, 0.1, 5.0), of(-3.0, 0.5, 6.0),
    )  # fmt: skip
    assert further([best, same, far, left, beside_left, right]) == [left, right]
    assert further([best, same]) == [same]
    assert further([best]) == []


class Ringing(Stateless):
    """y = size sin(6 (x - centre)) / (1 + (x - centre)²) in 4 windows of 50 samples, noise 1: half a period beside its
    centre the other sign looks alike."""

    def __init__(self, size: float, centre: float) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1, known=True),)
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 8.0, 200).reshape(4, 50)
        self.y = self.shape(size, centre) + np.random.default_rng(4).standard_normal((4, 50))

    def shape(self, size: float, centre: float) -> np.ndarray:
        return size * np.sin(6.0 * (self.x - centre)) / (1.0 + (self.x - centre) ** 2)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        offset = 0.1 * jobs.points[jobs.point, :1] - self.y[jobs.window]
        if not hypothesis.parameters:
            return offset
        values = [[p.value(w) for p, w in zip(hypothesis.parameters, z[1:], strict=True)] for z in jobs.points]
        return offset + np.array([self.shape(*pair) for pair in values])[jobs.point, jobs.window]


@pytest.mark.parametrize("lowest", [-30.0, 3.0])
def test_the_other_sign_is_tried_beside_a_place_that_is_stuck(lowest: float) -> None:
    parameters = Parameter("ring.size", "-", 0.0, 1.0, -50.0, 50.0), Parameter("ring.centre", "m", 0.0, 0.1, 0.0, 8.0)
    starts = tuple((size, centre) for size in (lowest, 30.0) for centre in (3.0, 4.0, 5.0))
    ring, model = Hypothesis("ring", parameters, {}, starts), Ringing(20.0, 4.6)
    problem = Problem(model, ring)
    stuck = fit(
        problem, problem.point(np.array([0.0, *ring.coordinates((-20.0, 4.1))]), np.zeros((4, 0))), steps=20
    ).place
    assert stuck.level(model) > 2.0
    scanner = Scanner(model, Problem(model, NONE).point(np.zeros(1), np.zeros((4, 0))), 1.0)
    turned = scanner.turned(stuck)
    if lowest > 0.0:
        assert turned == []
        return
    free = fit(problem, turned[0].place, steps=20).place
    assert free.level(model) < 1.1
    assert [p.value(z) for p, z in zip(parameters, free.z[1:], strict=True)] == pytest.approx([20.0, 4.6], rel=0.02)
