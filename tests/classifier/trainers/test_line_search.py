import math

import pytest
import torch

from classifier.trainers.line_search import LineSearch
from classifier.trainers.objective import Point
from indexer_env.errors import ParameterError


class Function:
    """A function of one number for each row, with its derivative; counts the rows evaluated."""

    def __init__(self, value, slope):
        self.value, self.slope, self.rows = value, slope, 0

    def evaluate(self, x):
        self.rows += len(x)
        return Point(x, self.value(x)[:, 0], self.slope(x))


FUNCTIONS = {
    "bowl": (lambda x: (x - 3) ** 2, lambda x: 2 * (x - 3)),
    "quartic": (lambda x: (x - 2) ** 4 - x, lambda x: 4 * (x - 2) ** 3 - 1),
    "wiggly": (lambda x: 0.1 * x - torch.sin(x), lambda x: 0.1 - torch.cos(x)),
    # Moré and Thuente's second test: nearly flat, then steep.
    "Moré": (
        lambda x: (x + 0.004) ** 5 - 2 * (x + 0.004) ** 4,
        lambda x: 5 * (x + 0.004) ** 4 - 8 * (x + 0.004) ** 3,
    ),
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("flatness", [0.9, 0.1, 0.01])
def test_both_conditions_hold_from_first_trials_of_any_length(name, flatness):
    function, search = Function(*FUNCTIONS[name]), LineSearch(flatness=flatness, trials=40)
    first = 10.0 ** torch.arange(-4, 4, dtype=torch.float64)
    at = function.evaluate(torch.zeros(len(first), 1, dtype=torch.float64))
    found = search.search(at, torch.ones_like(at.parameters), first, function)
    slope = at.gradient[:, 0]
    assert (found.length > 0).all()
    assert torch.equal(found.point.parameters[:, 0], found.length)
    assert (found.point.error <= at.error + search.decrease * found.length * slope).all()
    assert (found.slope.abs() <= flatness * slope.abs()).all()
    assert function.rows < 25 * len(first)


def test_a_cubic_is_solved_by_one_interpolation():
    """E = x³/3 − x from 0: the trial at 3 is too far, the cubic through both ends has its minimum at 1."""
    function = Function(lambda x: x**3 / 3 - x, lambda x: x**2 - 1)
    at = function.evaluate(torch.zeros(1, 1, dtype=torch.float64))
    found = LineSearch().search(at, torch.ones(1, 1, dtype=torch.float64), torch.tensor([3.0]).double(), function)
    assert found.length.item() == pytest.approx(1.0, abs=1e-14)
    assert function.rows == 3


def test_where_nothing_is_lower_the_point_is_the_old_one():
    """A direction said to lead downhill that does not: the slope is wrong in its sign."""
    function = Function(lambda x: x, lambda x: -torch.ones_like(x))
    at = function.evaluate(torch.zeros(2, 1, dtype=torch.float64))
    found = LineSearch().search(at, torch.ones(2, 1).double(), torch.ones(2).double(), function)
    assert torch.equal(found.length, torch.zeros(2).double())
    assert torch.equal(found.point.parameters, at.parameters)
    assert function.rows == 2 + 2 * LineSearch().trials


def test_errors_that_are_no_numbers_count_as_too_far():
    function = Function(lambda x: torch.where(x > 1, math.nan, -x), lambda x: torch.where(x > 1, math.nan, -1.0))
    at = function.evaluate(torch.zeros(1, 1, dtype=torch.float64))
    found = LineSearch().search(at, torch.ones(1, 1).double(), torch.tensor([64.0]).double(), function)
    assert 0.5 < found.length.item() <= 1


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"decrease": 0.0}, "Rule.decrease must be .*> 0"),
        ({"flatness": 1.0}, "Rule.flatness must be .*< 1"),
        ({"decrease": 0.3, "flatness": 0.2}, "Rule.flatness must be > decrease = 0.3, got 0.2"),
        ({"trials": 0}, "Rule.trials must be a whole number >= 1"),
    ],
)
def test_bad_numbers_are_refused_in_the_name_of_the_rule(numbers, words):
    with pytest.raises(ParameterError, match=words):
        LineSearch(**numbers).check("Rule")
