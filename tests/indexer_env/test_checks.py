"""The sentences of `errors` and `checks`, word by word."""

import math
import pickle

import numpy as np
import pytest
import yaml

from indexer_env.checks import check_choice, check_integer, check_number, did_you_mean
from indexer_env.errors import IndexerError, ParameterError, SignalError, SimulationError, refuse


def sentence(check, *arguments, **options) -> str:
    with pytest.raises(ParameterError) as caught:
        check(*arguments, **options)
    return str(caught.value)


# -------------------------------------------------------------------------------- errors


def test_refuse_builds_one_sentence_and_raises_nothing():
    error = refuse("Joint", "damping", "a finite number >= 0 N m s/rad", "1", "leave the quotes out")
    assert isinstance(error, ParameterError)
    assert str(error) == ("Joint.damping must be a finite number >= 0 N m s/rad, got '1'; leave the quotes out.")
    assert str(refuse("Joint", "damping", "given", None)) == "Joint.damping must be given, got None."


@pytest.mark.parametrize(
    ("kind", "builtin"),
    [(ParameterError, ValueError), (SignalError, ValueError), (SimulationError, ArithmeticError)],
)
def test_errors_are_of_one_family_and_travel_between_processes(kind, builtin):
    error = kind("Joint.damping must be given, got None.")
    assert isinstance(error, IndexerError) and isinstance(error, builtin)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind and str(again) == str(error)


# -------------------------------------------------------------------------------- numbers


@pytest.mark.parametrize("value", [0, 1, -2.5, np.float64(3.0), np.float32(0.5), np.int64(4)])
def test_real_finite_numbers_pass(value):
    check_number("A", "b", value)


@pytest.mark.parametrize(
    "value", [True, np.bool_(True), "1", None, 1j, math.nan, math.inf, -math.inf, [1.0], np.ones(1)]
)
def test_what_is_not_a_real_finite_number_is_refused(value):
    assert sentence(check_number, "A", "b", value) == f"A.b must be a finite number, got {value!r}."


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("8e3", "; write 8000.0 or 8.0e+3."), ("-2.5E1", "; write -25.0 or -2.5e+1."), ("1e-7", "; write 1.0e-7."),
        ("8000", "got '8000'."), ("1e999", "got '1e999'."), ("one", "got 'one'."),
    ],
)  # fmt: skip
def test_an_exponent_that_yaml_takes_for_a_text_is_told_with_its_remedy(text, remedy):
    assert sentence(check_number, "Joint", "stiffness", text, low=0.0).endswith(remedy)
    if "write" in remedy:
        assert yaml.safe_load(remedy.rpartition(" ")[2].rstrip(".")) == float(text) != yaml.safe_load(text)


@pytest.mark.parametrize(
    ("bounds", "inside", "outside", "rule"),
    [
        ({"low": 0.0}, 0.0, -1e-300, ">= 0"),
        ({"low": 0.0, "low_open": True}, 1e-300, 0.0, "> 0"),
        ({"high": 1.0}, 1.0, 1.0000001, "<= 1"),
        ({"high": 1.0, "high_open": True}, 0.9999999, 1.0, "< 1"),
        ({"low": 0.0, "low_open": True, "high": 1.0}, 1.0, 0.0, "> 0 and <= 1"),
        ({"low": 0.0, "high": 1.0}, 0.5, 1.5, ">= 0 and <= 1"),
    ],
)
def test_bounds_are_kept_and_said(bounds, inside, outside, rule):
    check_number("A", "b", inside, unit="kg", **bounds)
    said = sentence(check_number, "A", "b", outside, unit="kg", remedy="try more", **bounds)
    assert said == f"A.b must be a finite number {rule} kg, got {outside!r}; try more."


def test_a_dash_for_no_unit_is_not_printed():
    assert sentence(check_number, "A", "b", 2.0, high=1.0, unit="-") == ("A.b must be a finite number <= 1, got 2.0.")


# -------------------------------------------------------------------------------- whole numbers


@pytest.mark.parametrize("value", [3, np.int64(3), np.uint8(3)])
def test_whole_numbers_pass(value):
    check_integer("A", "b", value, low=3, high=3)


@pytest.mark.parametrize("value", [True, 3.0, np.float64(3.0), "3", None, math.nan])
def test_what_is_not_a_whole_number_is_refused(value):
    assert sentence(check_integer, "A", "b", value, low=1) == f"A.b must be a whole number >= 1, got {value!r}."


@pytest.mark.parametrize("value", [0, 11])
def test_whole_numbers_have_bounds(value):
    said = sentence(check_integer, "A", "b", value, low=1, high=10, unit="turns", remedy="try 5")
    assert said == f"A.b must be a whole number >= 1 and <= 10 turns, got {value}; try 5."


# -------------------------------------------------------------------------------- choices


def test_a_choice_is_one_of_the_names():
    check_choice("A", "b", "round", ("round", "square"))
    assert sentence(check_choice, "A", "b", "squire", ("round", "square")) == (
        "A.b must be one of round, square, got 'squire'; did you mean 'square'."
    )
    assert sentence(check_choice, "A", "b", "zzz", ("round", "square")) == (
        "A.b must be one of round, square, got 'zzz'."
    )
    assert sentence(check_choice, "A", "b", "mlp,log", ("mlp", "mlp, log")).startswith(
        "A.b must be one of mlp, 'mlp, log', got 'mlp,log'; did you mean"
    )


@pytest.mark.parametrize("value", [None, 1, True, ["round"], ("round",)])
def test_a_choice_is_text(value):
    assert sentence(check_choice, "A", "b", value, ("round",)).startswith("A.b must be one of round, got ")


def test_choices_may_be_an_iterator():
    check_choice("A", "b", "square", iter(["round", "square"]))


def test_did_you_mean_says_nothing_about_strangers():
    assert did_you_mean("stifness", ["stiffness", "damping"]) == "did you mean 'stiffness'"
    assert did_you_mean("qqq", ["stiffness", "damping"]) == ""
    assert did_you_mean("stiffness", []) == ""
