"""Scaled coordinates, bounds and refusals of parameters."""

import math

import pytest

from discrepancy.model import Parameter
from indexer_env.errors import ParameterError


def test_coordinate_is_the_inverse_of_value() -> None:
    for parameter in (
        Parameter("torque", "N m", 5.0, 2.0),
        Parameter("stiffness", "N m/rad", 8000.0, 0.12, logarithmic=True),
    ):
        for z in (-1.5, 0.0, 2.0):
            assert parameter.coordinate(parameter.value(z)) == pytest.approx(z)


def test_a_value_keeps_within_its_bounds() -> None:
    parameter = Parameter("severity", "-", 0.0, 0.1, low=0.0, high=0.9)
    assert parameter.value(-3.0) == 0.0
    assert parameter.value(30.0) == 0.9
    assert parameter.bounds == pytest.approx((0.0, 9.0))


def test_one_unit_of_a_logarithmic_parameter_is_its_relative_uncertainty() -> None:
    parameter = Parameter("stiffness", "N m/rad", 8000.0, 0.12, logarithmic=True)
    assert parameter.value(1.0) == pytest.approx(8000.0 * math.exp(0.12))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"nominal": 1.0, "scale": 0.0}, r"Parameter x\.scale must be .* > 0"),
        ({"nominal": 0.0, "scale": 1.0, "logarithmic": True}, r"Parameter x\.nominal must be .* > 0 kg"),
        ({"nominal": 3.0, "scale": 1.0, "high": 2.0}, r"Parameter x\.nominal must be within \[-inf, 2\] kg, got 3\.0"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused(arguments: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Parameter("x", "kg", **arguments)
