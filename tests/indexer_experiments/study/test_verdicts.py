import math

import numpy as np
import pytest

from indexer_experiments.study.verdicts import (
    Interval,
    Line,
    Verdict,
    by_seed,
    conjunction,
    data_sets,
    deciding,
    geometric,
)


def line(low, high, *, above=-math.inf, below=math.inf, percent=False):
    return Line("what", "paper", Interval((low + high) / 2, low, high), "Why.", above, below, percent)


def test_interval_is_student_s():
    """Mean 3, sample standard deviation sqrt(2.5), t(0.975, 4) = 2.776445: the tables' value."""
    interval = Interval.of([1, 2, 3, 4, 5])
    half = 2.776445 * np.sqrt(2.5) / np.sqrt(5)
    assert (interval.mean, interval.low, interval.high) == pytest.approx((3, 3 - half, 3 + half), rel=1e-6)


def test_one_data_set_says_nothing():
    interval = Interval.of([1.0])
    assert (interval.low, interval.high) == (-np.inf, np.inf)
    assert line(interval.low, interval.high, below=5.0).verdict is Verdict.UNDECIDED


def test_a_ratio_does_not_depend_on_the_level_of_a_data_set():
    above, below = np.array([2.0, 20.0, 0.2]), np.array([1.0, 10.0, 0.1])
    ratio = Interval.of_ratio(above, below)
    assert (ratio.mean, ratio.low, ratio.high) == pytest.approx((2, 2, 2))
    wide = Interval.of_ratio([2.0, 1.0], [1.0, 2.0])
    assert wide.mean == pytest.approx(1.0) and wide.low < 0.01 and wide.high > 100


@pytest.mark.parametrize(("above", "below"), [([0.0, 1.0], [1.0, 1.0]), ([1.0, 1.0], [1.0, math.nan])])
def test_a_ratio_of_what_has_no_logarithm_is_refused(above, below):
    with pytest.raises(ValueError, match="a ratio must be of positive values, got"):
        Interval.of_ratio(above, below)


def test_a_share_of_data_sets_has_the_exact_interval():
    """All of n: the lower end is 0.025^(1/n); 4 of 10: 0.1216 to 0.7376 in the tables."""
    every = Interval.of_yes([True] * 8)
    assert (every.mean, every.low, every.high) == pytest.approx((1.0, 0.025 ** (1 / 8), 1.0))
    some = Interval.of_yes([True] * 4 + [False] * 6)
    assert (some.mean, some.low, some.high) == pytest.approx((0.4, 0.1216, 0.7376), abs=1e-4)


@pytest.mark.parametrize(
    ("low", "high", "above", "below", "verdict"),
    [
        (0.2, 0.9, -math.inf, 1.0, Verdict.REPRODUCED),
        (1.1, 2.0, -math.inf, 1.0, Verdict.NOT_REPRODUCED),
        (0.9, 1.1, -math.inf, 1.0, Verdict.UNDECIDED),
        (0.9, 1.0, -math.inf, 1.0, Verdict.UNDECIDED),
        (1.0, 1.1, -math.inf, 1.0, Verdict.UNDECIDED),
        (0.6, 1.0, 0.5, math.inf, Verdict.REPRODUCED),
        (0.1, 0.4, 0.5, math.inf, Verdict.NOT_REPRODUCED),
        (0.4, 0.6, 0.5, math.inf, Verdict.UNDECIDED),
        (90.0, 300.0, 85.0, 340.0, Verdict.REPRODUCED),
        (80.0, 300.0, 85.0, 340.0, Verdict.UNDECIDED),
        (10.0, 400.0, 85.0, 340.0, Verdict.UNDECIDED),
        (400.0, 500.0, 85.0, 340.0, Verdict.NOT_REPRODUCED),
        (10.0, 20.0, 85.0, 340.0, Verdict.NOT_REPRODUCED),
        (math.nan, math.nan, 0.5, 1.0, Verdict.UNDECIDED),
    ],
)
def test_a_line_s_verdict_goes_by_its_interval(low, high, above, below, verdict):
    assert line(low, high, above=above, below=below).verdict is verdict


YES, MAYBE, NO = line(0.1, 0.2, below=1.0), line(0.1, 2.0, below=1.0), line(1.1, 2.0, below=1.0)


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        ((YES,), Verdict.REPRODUCED),
        ((YES, YES), Verdict.REPRODUCED),
        ((YES, MAYBE), Verdict.UNDECIDED),
        ((MAYBE, NO, YES), Verdict.NOT_REPRODUCED),
        ((YES, NO), Verdict.NOT_REPRODUCED),
    ],
)
def test_a_claim_has_the_verdict_of_its_worst_line_and_shows_that_one(lines, verdict):
    assert conjunction(lines) is verdict
    assert deciding(lines) is next(one for one in lines if one.verdict is verdict)


def test_a_line_says_its_range_and_its_number():
    assert line(0.25, 0.35, below=1.0).rule == "below 1"
    assert line(0.25, 0.35, above=0.8, percent=True).rule == "above 80 %"
    assert line(0.25, 0.35, above=85, below=340).rule == "85 to 340"
    assert line(0.25, 0.35).found == "0.3 [0.25, 0.35]"
    assert line(0.25, 0.35, percent=True).found == "30 [25, 35] %"


def test_values_are_reduced_over_networks_by_data_set_in_order():
    rows = [
        {"variant": variant, "data_seed": seed, "value": float(10 * seed + network)}
        for variant in "ab" for seed in (11, 2) for network in range(3)
    ]  # fmt: skip
    means = by_seed(rows, "value")
    assert list(means) == ["a", "b"] and means["a"].tolist() == [21.0, 111.0]
    assert by_seed(rows, "value", np.min)["b"].tolist() == [20.0, 110.0]
    assert [[row["value"] for row in own] for own in data_sets(rows)] == [
        2 * [20.0, 21.0, 22.0],
        2 * [110.0, 111.0, 112.0],
    ]
    assert geometric([np.array([1.0, 4.0]), np.array([4.0, 9.0])]) == pytest.approx([2.0, 6.0])
