"""Means over seeds, their intervals and their tables."""

import numpy as np
import pytest
from scipy import stats

from classifier.results import Row, differences, markdown, mean, means, to_table


def rows(values, metric="error", data="a"):
    return [Row("test", data, "m", metric, seed, value) for seed, value in enumerate(values)]


def test_the_interval_is_that_of_student_s_t():
    values = [1.0, 2.0, 4.0, 3.0]
    found = mean(values)
    low, high = stats.ttest_1samp(values, 0).confidence_interval(0.95)
    assert (found.value, found.low, found.high, found.seeds) == (2.5, pytest.approx(low), pytest.approx(high), 4)


def test_one_seed_has_no_interval_and_none_no_mean():
    assert mean([3.0]).text(1) == "3.0"
    assert np.isnan(mean([float("nan")]).value)


def test_what_is_not_defined_for_a_seed_does_not_count():
    assert mean([1.0, float("nan"), 3.0]) == mean([1.0, 3.0])


def test_a_table_has_a_line_for_what_has_one_of_its_metrics():
    everything = rows([1.0, 2.0]) + rows([5.0], "speed", "b") + rows([7.0], "not shown", "c")
    text = markdown(everything, (("error", 1), ("speed", 0)))
    assert text.splitlines()[2:] == [
        f"| a | m | {means(everything)['a', 'm', 'error'].text(1)} |  |",
        "| b | m |  | 5 |",
    ]


def test_rows_become_columns():
    table = to_table(rows([1.0, 2.0]))
    assert table.column("value").to_pylist() == [1.0, 2.0]
    assert table.column("seed").to_pylist() == [0, 1]


def test_differences_are_taken_seed_by_seed():
    ours = [Row("test", "a", "ours", "error", seed, value) for seed, value in enumerate([1.0, 12.0])]
    theirs = [Row("test", "a", "theirs", "error", seed, value) for seed, value in enumerate([2.0, 14.0])]
    found = differences([*ours, *theirs, *rows([3.0], data="b")], "error", "theirs")
    assert [(row.method, row.metric, row.value) for row in found] == [
        ("ours", "error minus theirs", -1.0),
        ("ours", "error minus theirs", -2.0),
    ]
