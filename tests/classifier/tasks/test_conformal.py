"""Conformal quantiles keep their promise, and say when they cannot."""

import numpy as np
import pytest

from classifier.tasks.conformal import conformal_quantile, least_records
from indexer_env.errors import ParameterError


def test_ranks_by_hand():
    scores = np.arange(1.0, 20.0)  # 19 scores: ⌈20 · 0.9⌉ = 18th, ⌈20 · 0.95⌉ = 19th
    assert conformal_quantile(scores, 0.9) == 18.0
    assert conformal_quantile(scores[::-1], 0.95) == 19.0


@pytest.mark.parametrize(("coverage", "least"), [(0.9, 9), (0.95, 19), (0.5, 1)])
def test_the_least_number_of_records_is_enough_and_one_less_is_refused(coverage, least):
    assert least_records(coverage) == least
    assert conformal_quantile(np.arange(float(least)), coverage) == least - 1
    with pytest.raises(ParameterError, match=f"at least {least} held-out records"):
        conformal_quantile(np.arange(float(least - 1)), coverage)


def test_new_records_are_covered_as_promised_whatever_the_law():
    rng = np.random.default_rng(0)  # 2000 repetitions of 30 + 1 records: standard error 0.7 %
    for draw in (rng.standard_normal, rng.standard_cauchy):
        inside = [draw() <= conformal_quantile(draw(30), 0.9) for _ in range(2000)]
        assert 0.9 - 0.02 < np.mean(inside) < 0.9 + 1 / 31 + 0.02


@pytest.mark.parametrize("coverage", [0.0, 1.0, float("nan")])
def test_no_coverage_of_all_or_nothing(coverage):
    with pytest.raises(ParameterError, match="coverage"):
        conformal_quantile(np.arange(100.0), coverage)


def test_each_unit_counts_as_one():
    """Nine units of a score each, 1 … 9, and one of ninety, 10 … 99: 5.5 units lie below the sixth score."""
    scores, units = np.arange(1.0, 100.0), np.r_[np.arange(9), np.full(90, 9)]
    assert conformal_quantile(scores, 0.5, units) == 6.0
    assert conformal_quantile(scores, 0.5, np.arange(99)) == conformal_quantile(scores, 0.5) == 50.0
    with pytest.raises(ParameterError, match="at least 9 held-out records or units"):
        conformal_quantile(np.arange(800.0), 0.9, np.arange(800) % 8)
