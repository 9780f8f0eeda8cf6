"""What the challenge must show, beside what its cases show so far."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from indexer_experiments.challenge.draw import PLAYS
from indexer_experiments.tables import share, share_of_groups, share_of_worst, table

Case = dict[str, Any]

LARGE = 3.0
"""Gap from which on an effect must be named."""

_INTERVALS = (
    "Intervals are Wilson's; that of the effect named worst is wide enough for those of all effects to hold at once "
    "(Bonferroni), those of sizes and parameters at least as wide as the bootstrap over cases, which err together."
)


def criteria(cases: Sequence[Case]) -> str:
    """One row for each number that is wanted, in Markdown; groups without a case say so."""
    rows: list[Sequence[str]] = []
    for play in PLAYS:
        large = [c for c in cases if c["kind"] == "single" and c["play"] == play and c["gap"] >= LARGE]
        what = f"one effect, gap ≥ {LARGE:g}, play {play}"
        rows.append((f"{what}: right name first", "≥ 95 %", *_counted(large, _right)))
        rows.append((f"{what}: the effect named worst", "≥ 85 %", *_worst(large)))
    single = [c for c in cases if c["kind"] == "single"]
    small = [c for c in single if c["gap"] < LARGE]
    rows += [
        (f"one effect, gap < {LARGE:g}, all plays: right name first", "–", *_counted(small, _right)),
        ("one effect, all gaps and plays: a wrong name", "–", *_counted(single, _wrong)),
    ]
    empty, outside, two = ([c for c in cases if c["kind"] == kind] for kind in ("none", "outside", "two"))
    rows += [
        ("nothing hidden: a name is given", "≤ 1 %", *_counted(empty, _wrong)),
        ("outside the library: no name, something remains", "≥ 90 %", *_counted(outside, _right)),
        ("outside the library: a wrong name", "≤ 5 %", *_counted(outside, _wrong)),
        ("two effects: both named", "≥ 80 %", *_counted(two, _right)),
    ]
    named = [c for c in cases if _right(c) and c["names"] and c["kind"] != "outside"]
    closed = [c["closed_share"] for c in named if c["closed_share"] is not None]
    middle = f"{100 * statistics.median(closed):.1f} %" if closed else "–"
    rows.append(("closed share on the speed and load never fitted, median", "≥ 95 %", middle, f"n = {len(closed)}"))
    for label, effects in (("effects' sizes", True), ("the machine's parameters", False)):
        rows.append(
            (f"95 % intervals of {label} that hold the truth", "90–99 %", *share_of_groups(_covered(named, effects)))
        )
    for label, key in (("by the clock", "wall_s"), ("of the processor", "cpu_s")):
        taken = sorted(c[key] for c in cases)
        middle = f"{statistics.median(taken):.1f} s" if taken else "–"
        most = f"90 % below {taken[math.ceil(0.9 * len(taken)) - 1]:.0f} s" if taken else "–"
        rows.append((f"time of a case {label}, median", "≤ 30 s", middle, f"{most}, n = {len(taken)}"))
    return table(["must show", "wanted", "got", "95 %"], rows) + f"\n\n{_INTERVALS}"


def _right(case: Case) -> bool:
    return case["outcome"] == "right"


def _wrong(case: Case) -> bool:
    return case["outcome"] == "wrong"


def _counted(cases: Sequence[Case], holds: Callable[[Case], bool]) -> tuple[str, str]:
    return share(sum(map(holds, cases)), len(cases))


def _worst(cases: Sequence[Case]) -> tuple[str, str]:
    """The effect with the least share of right answers, by name."""
    of = Counter(c["hidden"][0]["name"] for c in cases)
    hits = Counter(c["hidden"][0]["name"] for c in cases if _right(c))
    if not of:
        return share(0, 0)
    name = min(of, key=lambda name: (hits[name] / of[name], -of[name]))
    text, interval = share_of_worst(hits[name], of[name], len(of))
    return f"{name}: {text}", interval


def _covered(cases: Iterable[Case], effects: bool) -> list[list[bool]]:
    """Whether each interval of a case holds the truth: of hidden effects, or of the machine's own parameters."""
    return [
        [
            low <= truth <= high
            for name, truth, _, low, high in case["intervals"]
            if effects == any(name.startswith(f"{effect['name']}.") for effect in case["hidden"])
        ]
        for case in cases
    ]
