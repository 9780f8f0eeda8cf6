"""Laws of chance: each formula at known u, one draw a value, and one sentence for what is none."""

import math

import numpy as np
import pytest
import yaml
from scipy import stats

from indexer_env.errors import ParameterError
from indexer_env.law_reader import is_law, law_of_field, make_law
from indexer_env.laws import LAWS, Fixed

FORMS = {
    "uniform": {"uniform": [2, 6]},
    "log_uniform": {"log_uniform": [1, 100]},
    "normal": {"normal": [5, 2]},
    "choice": {"choice": [1, 2, 3]},
    "around": {"around": 0.1},
    "sobol": {"sobol": [2, 6]},
}
EXPECTED = {
    "uniform": stats.uniform(2, 4),
    "log_uniform": stats.loguniform(1, 100),
    "normal": stats.norm(5, 2),
    "around": stats.uniform(9, 2),
    "sobol": stats.uniform(2, 4),
}


def law(given):
    return make_law("owner", "name", given)


def test_every_law_is_tried():
    assert FORMS.keys() == LAWS.keys()


@pytest.mark.parametrize("name", EXPECTED)
def test_a_law_is_the_quantile_function_of_its_distribution(name):
    for u in (0.0, 0.25, 0.5, 0.9):
        at = law(FORMS[name]).at(u, 10.0)
        assert at == pytest.approx(EXPECTED[name].ppf(u)) or (u == 0.0 and name == "normal" and math.isfinite(at))


@pytest.mark.parametrize("name", EXPECTED)
def test_draws_pass_a_kolmogorov_smirnov_test(name):
    rng = np.random.default_rng(0)
    drawn = [law(FORMS[name]).draw(rng, 10.0) for _ in range(2000)]
    assert stats.kstest(drawn, EXPECTED[name].cdf).pvalue > 0.01


@pytest.mark.parametrize("name", FORMS)
def test_a_law_takes_one_draw_whatever_it_is(name):
    used, plain = np.random.default_rng(1), np.random.default_rng(1)
    law(FORMS[name]).draw(used, 10.0)
    plain.random()
    assert used.random() == plain.random()


def test_a_plain_value_takes_no_draw():
    rng = np.random.default_rng(1)
    assert law(0.3).draw(rng) == 0.3 and law("B") == Fixed("B") and law(None).draw(rng) is None
    assert rng.random() == np.random.default_rng(1).random()


def test_a_choice_may_hold_a_law_and_still_takes_one_draw():
    mixed = law({"choice": [0, {"uniform": [5, 20]}]})
    assert (mixed.at(0.0), mixed.at(0.49999), mixed.at(0.5), mixed.at(0.75)) == (0, 0, 5.0, 12.5)
    drawn = np.array([mixed.draw(rng) for rng in [np.random.default_rng(2)] for _ in range(4000)])
    assert np.mean(drawn == 0) == pytest.approx(0.5, abs=0.03)
    assert stats.kstest(drawn[drawn > 0], stats.uniform(5, 15).cdf).pvalue > 0.01
    assert mixed.extremes == (0, 5.0, 20.0) and not mixed.lists and law({"choice": [0, 1]}).lists


@pytest.mark.parametrize("name", FORMS)
def test_values_stay_between_the_extremes(name):
    given = {"around": [10.0, 0.1]} if name == "around" else FORMS[name]
    values = [law(given).at(u) for u in (0.0, 0.3, 1.0 - 2.0**-53)]
    assert min(law(given).extremes) <= min(values) and max(values) <= max(law(given).extremes)
    assert min(law(given).extremes) <= law(given).centre <= max(law(given).extremes)


@pytest.mark.parametrize("name", FORMS)
def test_degrees_become_radians(name):
    field, scaled = law_of_field("owner", "angle_deg", FORMS[name], ("angle",))
    nominal, nominal_deg = (1.0, math.degrees(1.0)) if name == "around" else (None, None)
    assert field == "angle"
    assert scaled.at(0.3, nominal) == pytest.approx(math.radians(law(FORMS[name]).at(0.3, nominal_deg)))


def test_around_keeps_the_nominal_value_at_share_0():
    assert law({"around": 0.0}).draw(np.random.default_rng(0), 44400.0) == 44400.0
    assert law({"around": 0.1}).needs_nominal and not law({"around": [2.0, 0.1]}).needs_nominal
    assert law({"choice": [0, {"around": 0.1}]}).needs_nominal
    assert law({"around": [2.0, 0.1]}).at(0.0) == pytest.approx(1.8)


@pytest.mark.parametrize("given", [*FORMS.values(), 0.3, "B", {"choice": [0, {"around": [2.0, 0.1]}]}])
def test_a_law_reads_as_in_yaml(given):
    assert law(yaml.safe_load(repr(law(given)))) == law(given)


def test_what_is_a_law():
    assert is_law({"uniform": [0, 1]}) and not is_law({"torque": 3}) and not is_law([0, 1])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"unifrom": [0, 1]}, "did you mean 'uniform'."),
        ({"uniform": [0, 1], "choice": [1]}, "owner.name must be a value or one of {uniform: [low, high]}"),
        ({}, "owner.name must be a value or one of"),
        ({"uniform": [1, 0]}, "owner.name must be {uniform: [low, high]} with low <= high, got"),
        ({"uniform": [0, 1, 2]}, "owner.name must be {uniform: [low, high]} with low <= high, got"),
        ({"uniform": 3}, "owner.name must be {uniform: [low, high]}, got"),
        ({"uniform": ["a", 1]}, "owner.name must be a finite number, got 'a'."),
        ({"log_uniform": [0, 1]}, "owner.name must be {log_uniform: [low, high]} with 0 < low <= high, got"),
        ({"normal": [0, -1]}, "owner.name must be {normal: [mean, sd]} with sd >= 0, got"),
        ({"normal": [0, math.nan]}, "owner.name must be a finite number, got nan."),
        ({"choice": []}, "owner.name must be {choice: [value, ...]}, got"),
        ({"choice": [1, {"sobol": [0, 1]}]}, "owner.name must be a choice of values and laws other than sobol"),
        ({"around": -0.1}, "owner.name must be a finite number >= 0, got -0.1; {around: 0.1} stands for"),
        ({"around": [1, -0.1]}, "owner.name must be {around: share} with [nominal, share >= 0], got"),
    ],
)
def test_what_is_none_is_one_sentence(given, said):
    with pytest.raises(ParameterError) as caught:
        law(given)
    assert said in str(caught.value) and str(caught.value).endswith(".") and "\n" not in str(caught.value)
