import numpy as np
import pytest

from classifier.study.verdicts import Interval, Outcome, Statement, Verdict, by_seed, geometric, overall


def test_interval_is_student_s():
    """Mean 3, sample standard deviation sqrt(2.5), t(0.975, 4) = 2.776445: the tables' value."""
    interval = Interval.of([1, 2, 3, 4, 5])
    half = 2.776445 * np.sqrt(2.5) / np.sqrt(5)
    assert (interval.mean, interval.low, interval.high) == pytest.approx((3, 3 - half, 3 + half), rel=1e-6)


def test_one_data_set_says_nothing():
    interval = Interval.of([1.0])
    assert (interval.low, interval.high) == (-np.inf, np.inf)


def test_a_ratio_does_not_depend_on_the_level_of_a_data_set():
    above, below = np.array([2.0, 20.0, 0.2]), np.array([1.0, 10.0, 0.1])
    ratio = Interval.of_ratio(above, below)
    assert (ratio.mean, ratio.low, ratio.high) == pytest.approx((2, 2, 2))
    wide = Interval.of_ratio([2.0, 1.0], [1.0, 2.0])
    assert wide.mean == pytest.approx(1.0) and wide.low < 0.01 and wide.high > 100


@pytest.mark.parametrize(
    ("held", "verdict"),
    [((True, True), Verdict.HOLDS), ((True, False), Verdict.IN_PART), ((False, False), Verdict.FAILS)],
)
def test_verdict_of_statements(held, verdict):
    assert Outcome("paper", tuple(Statement("s", "r", "f", one) for one in held)).verdict is verdict


def test_settings_that_disagree_make_a_claim_hold_in_part():
    assert overall([Verdict.HOLDS, Verdict.HOLDS]) is Verdict.HOLDS
    assert overall([Verdict.FAILS, Verdict.FAILS]) is Verdict.FAILS
    assert overall([Verdict.HOLDS, Verdict.FAILS]) is Verdict.IN_PART


def test_values_are_reduced_over_networks_by_data_set_in_order():
    rows = [
        {"variant": variant, "data_seed": seed, "value": float(10 * seed + network)}
        for variant in "ab" for seed in (11, 2) for network in range(3)
    ]  # fmt: skip
    means = by_seed(rows, "value")
    assert list(means) == ["a", "b"] and means["a"].tolist() == [21.0, 111.0]
    assert by_seed(rows, "value", np.min)["b"].tolist() == [20.0, 110.0]
    assert geometric([np.array([1.0, 4.0]), np.array([4.0, 9.0])]) == pytest.approx([2.0, 6.0])
