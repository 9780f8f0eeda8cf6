"""Which cases a run has: all groups of the result table, each of them covered evenly wherever the run is stopped."""

from collections import Counter
from typing import Any

import pytest

from indexer_env.errors import ParameterError
from indexer_experiments.challenge.draw import HIDDEN, Order
from indexer_experiments.challenge.plan import FULL, interleaved, orders


def config(**given: Any) -> dict[str, Any]:
    empty = dict.fromkeys(("count", "seed", "kind", "play", "gap", "turns", "half", "limit"))
    return {"cases": "own", **empty, **given}


def test_the_full_run_holds_every_group_of_the_table() -> None:
    cases = Counter()
    for order in orders(config(cases="full", seed=1)):
        cases[order.kind, order.play, order.gap[0] >= 3.0] += order.count
    assert cases["single", "healthy", True] >= 10 * len(HIDDEN) >= 10 * 20
    assert all(cases["single", play, True] >= 4 * len(HIDDEN) for play in ("none", "5", "20"))
    assert cases["none", "healthy", True] >= 200
    assert cases["outside", "healthy", True] >= 60 and cases["two", "healthy", True] >= 60
    assert cases["single", "healthy", False] >= len(HIDDEN)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_run_that_is_stopped_has_had_the_same_share_of_every_group(share: float) -> None:
    asked = orders(config(cases="full", seed=1))
    tasks = interleaved(asked)
    assert len(tasks) == len({(id(task.order), task.number) for task in tasks}) == sum(group[2] for group in FULL)
    done = Counter(id(task.order) for task in tasks[: round(share * len(tasks))])
    for order in asked:
        assert done[id(order)] == pytest.approx(share * order.count, abs=1.5)


def test_own_cases_are_as_they_are_asked_for() -> None:
    assert orders(config(count=3, seed=4)) == (Order(3, 4),)
    asked = config(count=3, seed=4, kind="two", play=5, gap=[2.0, 4.0], turns=0.8)
    assert orders(asked) == (Order(3, 4, "two", "5", (2.0, 4.0), 0.8),)
    assert orders(config(cases="none")) == ()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"cases": "ful"}, r"challenge\.cases must be one of .*did you mean 'full'"),
        ({"cases": "full", "seed": 1, "kind": "two"}, r"challenge\.kind must be left out with cases=full, got 'two'"),
        ({"cases": "none", "seed": 1}, r"challenge\.seed must be left out with cases=none, got 1"),
        ({"cases": "full"}, r"challenge\.seed must be a whole number >= 0, got None"),
        ({"seed": 1}, r"challenge\.count must be a whole number >= 1, got None"),
        ({"count": 1, "seed": 1, "gap": 3.0}, r"challenge\.gap must be two numbers, .* got 3\.0"),
    ],
)
def test_what_has_no_effect_or_is_missing_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        orders(config(**given))
