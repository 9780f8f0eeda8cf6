"""Of many differences none is a better method by chance alone."""

import numpy as np
import pytest
from scipy import stats

from classifier.results import Row
from indexer_experiments.compare.beside import beside, holm


def rows_of(p_values, data="hard"):
    """Errors of methods that lie, seed by seed, below those of `mlp` with these p-values by Student's t of 5 seeds."""
    scatter = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    rows = [Row("toy", data, "mlp", "error [%]", seed, 50.0 + 3.0 * seed) for seed in range(5)]
    for number, p in enumerate(p_values):
        less = stats.t.isf(p / 2.0, 4) * scatter.std(ddof=1) / np.sqrt(5)
        rows += [
            Row("toy", data, f"method {number}", "error [%]", seed, 50.0 + 3.0 * seed - less + scatter[seed])
            for seed in range(5)
        ]
    return rows


def told(rows):
    """p and verdict by data set and method."""
    lines = [line.strip("| ").split(" | ") for line in beside(rows, "error [%]", "mlp").splitlines()[2:] if "|" in line]
    return {(data, method): (p, verdict) for data, method, _, p, verdict in lines}


def test_the_correction_is_holm_s():
    """Holm's steps by hand: 4 × 0.01, 3 × 0.015, 2 × 0.03 and, as it may not fall, that again for 0.04."""
    assert holm([0.04, 0.01, 0.03, 0.015]) == pytest.approx([0.06, 0.04, 0.06, 0.045])
    assert holm([0.5, 0.9]).tolist() == [1.0, 1.0]
    found = holm([0.01, np.nan])
    assert found[0] == pytest.approx(0.02) and np.isnan(found[1])


def test_one_of_twelve_differences_is_no_winner():
    """p = 0.04 alone calls a method better; as the least of twelve it does not."""
    assert told(rows_of([0.04])) == {("hard", "method 0"): ("0.04", "better")}
    twelve = told(rows_of([0.04, *np.linspace(0.3, 0.9, 11)]))
    assert len(twelve) == 12 and {verdict for _, verdict in twelve.values()} == {"–"}
    assert twelve["hard", "method 0"][0] == "0.48"


def test_all_data_sets_are_one_family():
    """Of two rows 0.02 would be better, of four it is not."""
    assert told(rows_of([0.02, 0.5]))["hard", "method 0"] == ("0.04", "better")
    found = told(rows_of([0.02, 0.5]) + rows_of([0.6, 0.8], data="easy"))
    assert found["hard", "method 0"] == ("0.08", "–")


def test_a_method_that_errs_more_is_worse_and_what_does_not_scatter_is_not_judged():
    base = [Row("toy", "hard", "mlp", "error [%]", seed, 50.0) for seed in range(5)]
    worse = [Row("toy", "hard", "poor", "error [%]", seed, 60.0 + 0.1 * seed) for seed in range(5)]
    alike = [Row("toy", "hard", "alike", "error [%]", seed, 40.0) for seed in range(5)]
    found = told([*base, *worse, *alike])
    assert found["hard", "poor"][1] == "worse" and found["hard", "alike"] == ("–", "–")
    assert "Holm's correction over all rows" in beside([*base, *worse], "error [%]", "mlp")


def test_one_seed_says_nothing():
    rows = [row for row in rows_of([0.001]) if row.seed == 0]
    assert told(rows) == {("hard", "method 0"): ("–", "–")}


def test_no_other_method_gives_no_table():
    assert beside(rows_of([]), "error [%]", "mlp") == ""
