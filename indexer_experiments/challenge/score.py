"""Shares of a challenge's answers with their intervals, by kind, size and effect, as text."""

from __future__ import annotations

import itertools
import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from indexer_experiments.challenge.case import OUTCOMES
from indexer_experiments.challenge.criteria import LARGE, criteria
from indexer_experiments.challenge.draw import PLAYS
from indexer_experiments.tables import table, wilson

Case = dict[str, Any]

_SIZES = (1.0, 1.5, LARGE, 6.0, math.inf)
"""Edges of the gap (base model's level over the noise) by which cases are counted."""


def summary(cases: Sequence[Case]) -> str:
    """The tables of a challenge in Markdown."""
    parts = [criteria(cases), _outcomes(cases), _numbers(cases)]
    if any(case["kind"] == "single" for case in cases):
        parts.append(_by_effect([case for case in cases if case["kind"] == "single"]))
    return "\n\n".join(part for part in parts if part) + "\n"


def confusion(cases: Iterable[Case]) -> Counter[tuple[str, str]]:
    """How often (hidden, answered) came up; the answer is the names, or the verdict where there is none."""
    counted: Counter[tuple[str, str]] = Counter()
    for case in cases:
        hidden = " + ".join(sorted(effect["name"] for effect in case["hidden"])) or "none"
        named = case["verdict"] == "named"
        counted[hidden, " + ".join(sorted(case["names"])) if named else case["verdict"]] += 1
    return counted


def _outcomes(cases: Sequence[Case]) -> str:
    rows = []
    for kind, play in sorted({(case["kind"], case["play"]) for case in cases}):
        mine = [case for case in cases if (case["kind"], case["play"]) == (kind, play)]
        spans = [*itertools.pairwise(_SIZES), (3.0, math.inf)] if kind in ("single", "outside") else [(0.0, math.inf)]
        for low, high in spans:
            sized = [case for case in mine if low <= max(case["gap"], 1.0) < high]
            if sized:
                rows.append(_row(kind, play, low, high, sized))
    return table(["kind", "play", "gap", "cases", "right", "95 %", *OUTCOMES[1:]], rows)


def _row(kind: str, play: str, low: float, high: float, cases: Sequence[Case]) -> list[str]:
    counted = Counter(case["outcome"] for case in cases)
    hits, of = counted["right"], len(cases)
    below, above = wilson(hits, of)
    size = "all" if low == 0.0 else f"≥ {low:g}" if math.isinf(high) else f"{low:g}–{high:g}"
    shares = [f"{hits} ({100 * hits / of:.0f} %)", f"{100 * below:.0f}–{100 * above:.0f} %"]
    return [kind, play, size, str(of), *shares, *(str(counted[name]) for name in OUTCOMES[1:])]


def _numbers(cases: Sequence[Case]) -> str:
    right = [case for case in cases if case["outcome"] == "right" and case["names"] and case["kind"] != "outside"]
    large = [case for case in right if case["gap"] >= LARGE]
    rows = [
        ["processor time of a search", _median([case["cpu_s"] for case in cases], "s")],
        ["wall time of a search", _median([case["wall_s"] for case in cases], "s")],
        ["processor time of making the records", _median([case["truth_s"] for case in cases], "s")],
        ["closed share on the speed never fitted, rightly named", _median(_closed(right), "")],
        ["the same, gap ≥ 3", _median(_closed(large), "")],
    ]
    return table(["quantity", "value"], rows)


def _closed(cases: Iterable[Case]) -> list[float]:
    return [case["closed_share"] for case in cases if case["closed_share"] is not None]


def _median(values: Sequence[float], unit: str) -> str:
    if not values:
        return "–"
    low, high = min(values), max(values)
    return f"median {statistics.median(values):.3g} {unit}".strip() + f" ({low:.3g} to {high:.3g}, n = {len(values)})"


def _by_effect(cases: Sequence[Case]) -> str:
    """One row for each hidden effect: how often right at a large gap, for each play, and below; and what else came."""
    counted = confusion(cases)
    plays = [play for play in PLAYS if any(case["play"] == play for case in cases)]
    rows = []
    for name in sorted({case["hidden"][0]["name"] for case in cases}):
        mine = [case for case in cases if case["hidden"][0]["name"] == name]
        groups = [[c for c in mine if c["play"] == play and c["gap"] >= LARGE] for play in plays]
        groups.append([c for c in mine if c["gap"] < LARGE])
        shares = [f"{sum(c['outcome'] == 'right' for c in group)} of {len(group)}" for group in groups]
        others = [f"{found} {n}" for (hidden, found), n in sorted(counted.items()) if hidden == name and found != name]
        rows.append([name, *shares, ", ".join(others) or "–"])
    head = [f"play {play}, gap ≥ {LARGE:g}" for play in plays]
    return table(["hidden: right", *head, f"gap < {LARGE:g}", "other answers"], rows)
