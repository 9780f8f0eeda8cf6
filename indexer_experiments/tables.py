"""Shares with their intervals, and tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.stats import binomtest


def wilson(hits: int, of: int, beside: int = 1) -> tuple[float, float]:
    """95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22 (1927) 209); of one that was picked from so many
    shares `beside` each other, wide enough that those of all would hold at once (Bonferroni)."""
    if of == 0:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(1.0 - 0.05 / beside, method="wilson")
    return float(found.low), float(found.high)


def grouped(groups: Sequence[Sequence[bool]], seed: int = 0, draws: int = 2000) -> tuple[float, float]:
    """95 % interval of a share of what comes in groups and errs together (the parameters of one machine, say):
    Wilson's of all, or, where it is wider, that of the bootstrap which draws whole groups."""
    held = [group for group in groups if len(group)]
    hits, of = np.array([sum(group) for group in held]), np.array([len(group) for group in held])
    low, high = wilson(int(hits.sum()), int(of.sum()))
    if not held:
        return low, high
    rows = np.random.default_rng(seed).integers(0, len(held), (draws, len(held)))
    below, above = np.quantile(hits[rows].sum(axis=1) / of[rows].sum(axis=1), (0.025, 0.975))
    return min(low, float(below)), max(high, float(above))


def share(hits: int, of: int) -> tuple[str, str]:
    """ "19 of 20 (95 %)" and its interval "76–99 %"; dashes where there is no case."""
    return _said(hits, of, wilson(hits, of))


def share_of_worst(hits: int, of: int, beside: int) -> tuple[str, str]:
    """The same of a share that was picked as the worst of so many."""
    text, interval = _said(hits, of, wilson(hits, of, beside))
    return text, f"{interval}, for {beside} at once" if of and beside > 1 else interval


def share_of_groups(groups: Sequence[Sequence[bool]]) -> tuple[str, str]:
    """The same of all in these groups, which err together."""
    return _said(sum(map(sum, groups)), sum(map(len, groups)), grouped(groups))


def _said(hits: int, of: int, interval: tuple[float, float]) -> tuple[str, str]:
    if not of:
        return "no case", "–"
    low, high = interval
    return f"{hits} of {of} ({100 * hits / of:.1f} %)", f"{100 * low:.1f}–{100 * high:.1f} %"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows of texts under a head, in Markdown."""
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, ["---"] * len(head), *rows))
