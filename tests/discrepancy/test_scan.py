"""Starts far from each other in the library's lists."""

import numpy as np
import pytest

from discrepancy.candidates import further
from discrepancy.model import Hypothesis, Parameter
from discrepancy.problem import Point
from discrepancy.scan import Start, apart, beside

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
