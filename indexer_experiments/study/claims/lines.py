"""What the claims that compare variants share: ratios of performances, lines of mean and best performance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from classifier.style import COLOURS
from indexer_experiments.study.claims.base import Rows
from indexer_experiments.study.trials import PERFORMANCE
from indexer_experiments.study.verdicts import Interval, by_seed, geometric

FLOOR = 1e-4
"""Performances below this count as this: outputs off by a hundredth, which nobody would tell from the targets."""

AXIS = "mean square error on the control set"


def performances(rows: Rows, reduce: Any = np.mean, value: str = PERFORMANCE) -> dict[str, np.ndarray]:
    """Performance of each variant reduced over networks, one number per data set, not below FLOOR."""
    return {name: np.maximum(values, FLOOR) for name, values in by_seed(rows, value, reduce).items()}


def ratio(values: dict[str, np.ndarray], above: Sequence[str], below: Sequence[str]) -> Interval:
    """Performance of some variants over that of others: geometric means over the variants."""
    return Interval.of_ratio(*(geometric(values[name] for name in names) for names in (above, below)))


def ranked(values: dict[str, np.ndarray], names: Sequence[str]) -> list[str]:
    """These variants from the best to the worst, by the geometric mean over data sets."""
    return sorted(names, key=lambda name: float(np.mean(np.log(values[name]))))


def errors_made(rows: Rows) -> str:
    """Share of misclassified control records, over all variants: how hard the data are."""
    return f"{100 * np.mean([row['control_misclassified'] for row in rows]):.2g} % of control records are misclassified"


def draw_means(ax: Axes, cells: Sequence[np.ndarray], label: str, colour: int) -> None:
    """Geometric means over data sets, one place after the other on a logarithmic axis, with their intervals."""
    middle, low, high = _spans(cells)
    arms = np.array([middle - low, high - middle]) if np.isfinite(high).all() else None
    ax.errorbar(range(len(cells)), middle, arms, fmt="o", color=COLOURS[colour], label=label)
    ax.set_yscale("log")


def draw_lines(ax: Axes, rows: Rows, names: Sequence[str], label: str, colour: int, style: str | None = None) -> None:
    """Mean and best performance over x: geometric means over data sets, with the interval of the mean as a band.

    style  of both lines; None: dotted for the mean and solid for the best, as in the paper's figs. 4 and 6
    """
    x = [next(row["x"] for row in rows if row["variant"] == name) for name in names]
    for reduce, words, own in ((np.mean, "mean", ":"), (np.min, "best", "-")):
        cells = performances(rows, reduce)
        middle, low, high = _spans([cells[name] for name in names])
        marker = "o" if words == "mean" else "."
        ax.plot(x, middle, style or own, marker=marker, markersize=4, color=COLOURS[colour], label=f"{label}, {words}")
        if np.isfinite(high).all():
            ax.fill_between(x, low, high, color=COLOURS[colour], alpha=0.15, linewidth=0)
    ax.set_yscale("log")
    ax.set_ylabel(AXIS)
    ax.legend()


def _spans(cells: Sequence[np.ndarray]) -> np.ndarray:
    """Geometric mean over data sets and the ends of its interval (3, cells)."""
    spans = [Interval.of(np.log(values)) for values in cells]
    return np.exp([[getattr(span, end) for span in spans] for end in ("mean", "low", "high")])
