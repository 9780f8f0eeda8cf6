"""Which cases a run solves and in what order: those of one order, or of all groups that the result table asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from indexer_env.checks import check_choice
from indexer_env.errors import refuse
from indexer_experiments.challenge.draw import HIDDEN, Order
from indexer_experiments.challenge.messy.draw import MessyOrder

CASES = ("own", "full", "messy", "none")
"""own: `count` cases of one kind, play and gap; full: all groups of the result table; messy: `count` cases of one half
of the messy challenge; none: the table alone."""

_KEYS = ("count", "kind", "play", "gap", "turns", "seed", "half", "limit")
_TAKEN = {
    "own": ("count", "kind", "play", "gap", "turns", "seed"), "full": ("turns", "seed"),
    "messy": ("count", "seed", "half", "limit"), "none": (),
}  # fmt: skip
"""Keys that have an effect with each of CASES."""

_EACH = len(HIDDEN)
_LARGE, _SMALL = (3.0, 10.0), (1.0, 3.0)

FULL = (
    ("single", "healthy", 10 * _EACH, _LARGE), ("single", "healthy", 2 * _EACH, _SMALL),
    ("single", "none", 4 * _EACH, _LARGE), ("single", "5", 4 * _EACH, _LARGE), ("single", "20", 4 * _EACH, _LARGE),
    ("none", "healthy", 200, _LARGE), ("outside", "healthy", 3 * _EACH, _LARGE), ("two", "healthy", 60, _LARGE),
)  # fmt: skip
"""Kind, play, cases and gap of each group. A small case has the machine of the large one of its number."""


@dataclass(frozen=True)
class Task:
    """Case `number` of an order."""

    order: Order | MessyOrder
    number: int


def orders(config: dict[str, Any]) -> tuple[Order | MessyOrder, ...]:
    """The orders of a composed conf/challenge.yaml; none where only the table is asked for.

    Raises
    ------
    ParameterError
        A key that has no effect with these cases, or a value that breaks its rule.
    """
    which = config["cases"]
    check_choice("challenge", "cases", which, CASES)
    given: dict[str, Any] = {key: config[key] for key in _KEYS if config[key] is not None}
    for key in given.keys() - set(_TAKEN[which]):
        takers = " or ".join(f"cases={name}" for name in CASES if key in _TAKEN[name])
        raise refuse("challenge", key, f"left out with cases={which}", given[key], f"take {takers}, or leave it out")
    if which == "none":
        return ()
    if "seed" not in given:
        raise refuse("challenge", "seed", "a whole number >= 0", None, "add seed=1")
    if which == "full":
        return tuple(Order(n, kind=kind, play=play, gap=gap, **given) for kind, play, n, gap in FULL)
    if "count" not in given:
        raise refuse("challenge", "count", "a whole number >= 1", None, f"add count={_EACH}, or cases=full")
    if which == "messy":
        if "half" not in given:
            raise refuse("challenge", "half", "tune or judge", None, "add half=tune; half=judge is for the last look")
        return (MessyOrder(**given),)
    if "gap" in given:
        gap = given["gap"]
        if not isinstance(gap, list):
            raise refuse("challenge", "gap", "two numbers, the lowest and the highest", gap, "write gap=[1,10]")
        given["gap"] = tuple(gap)
    if "play" in given:
        given["play"] = str(given["play"])
    return (Order(**given),)


def interleaved(asked: Sequence[Order | MessyOrder]) -> list[Task]:
    """All cases of all orders, so that a run that is stopped has had the same share of each."""
    tasks = [Task(order, number) for order in asked for number in range(order.count)]
    return sorted(tasks, key=lambda task: (task.number + 0.5) / task.order.count)
