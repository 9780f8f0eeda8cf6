"""What the claims that compare variants share: lines of mean and best performance, and rules about ratios."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from classifier.study.claims.base import Rows
from classifier.study.trials import PERFORMANCE
from classifier.study.verdicts import Interval, Statement, by_seed, geometric
from classifier.style import COLOURS

FLOOR = 1e-4
"""Performances below this count as this: outputs off by a hundredth, which nobody would tell from the targets."""

BETTER = "the ratio's whole interval lies below 1"
AXIS = "mean square error on the control set"


def performances(rows: Rows, reduce: Any = np.mean) -> dict[str, np.ndarray]:
    """Performance of each variant reduced over networks, one number per data seed, not below FLOOR."""
    return {name: np.maximum(values, FLOOR) for name, values in by_seed(rows, PERFORMANCE, reduce).items()}


def better(says: str, rows: Rows, first: Sequence[str], second: Sequence[str]) -> Statement:
    """Whether the first variants have lower values than the second ones: geometric means over the variants of the
    means over networks.
    """
    means = performances(rows)
    ratio = Interval.of_ratio(*(geometric(means[name] for name in names) for names in (first, second)))
    return Statement(says, BETTER, f"ratio {ratio}", ratio.high < 1.0)


def better_best(says: str, rows: Rows, first: Sequence[str], second: Sequence[str]) -> Statement:
    """The same of the best network of each variant and data set."""
    bests = performances(rows, np.min)
    ratio = Interval.of_ratio(*(geometric(bests[name] for name in names) for names in (first, second)))
    return Statement(says, BETTER, f"ratio {ratio}", ratio.high < 1.0)


def alike(says: str, rows: Rows, names: Sequence[str], most: float) -> Statement:
    """Whether the mean performances of variants, geometric means over data seeds, differ by a factor of at most
    `most`.
    """
    means = performances(rows)
    level = {name: float(np.exp(np.mean(np.log(means[name])))) for name in names}
    worst, best = max(level, key=level.__getitem__), min(level, key=level.__getitem__)
    factor = level[worst] / level[best]
    found = f"factor {factor:.3g}, from {level[best]:.3g} ({best}) to {level[worst]:.3g} ({worst})"
    return Statement(says, f"largest over smallest mean ≤ {most:g}", found, factor <= most)


def errors_made(rows: Rows) -> str:
    """Share of misclassified control records, over all variants: how hard the data are."""
    return f"{100 * np.mean([row['control_misclassified'] for row in rows]):.2g} % of control records misclassified"


def draw_lines(ax: Axes, rows: Rows, names: Sequence[str], label: str, colour: int, style: str | None = None) -> None:
    """Mean and best performance over x: geometric means over data seeds, with the interval of the mean as a band.

    style  of both lines; None: dotted for the mean and solid for the best, as in the paper's figs. 4 and 6
    """
    x = [next(row["x"] for row in rows if row["variant"] == name) for name in names]
    for reduce, words, own in ((np.mean, "mean", ":"), (np.min, "best", "-")):
        cells = performances(rows, reduce)
        spans = [Interval.of(np.log(cells[name])) for name in names]
        middle, low, high = (np.exp([getattr(span, end) for span in spans]) for end in ("mean", "low", "high"))
        marker = "o" if words == "mean" else "."
        ax.plot(x, middle, style or own, marker=marker, markersize=4, color=COLOURS[colour], label=f"{label}, {words}")
        if np.isfinite(low).all():
            ax.fill_between(x, low, high, color=COLOURS[colour], alpha=0.15, linewidth=0)
    ax.set_yscale("log")
    ax.set_ylabel(AXIS)
    ax.legend()
