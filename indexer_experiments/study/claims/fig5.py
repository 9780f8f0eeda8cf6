"""Fig. 5: what the random start of a training does to its result."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import scipy.stats
from matplotlib.axes import Axes

from classifier.style import COLOURS, DARK
from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import AXIS, FLOOR
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import ANALYSIS, PATIENT, Training
from indexer_experiments.study.trials import PERFORMANCE
from indexer_experiments.study.verdicts import Interval, Line, data_sets

SHARE = 0.8
"""The paper's share of trainings near the mode."""

WITHIN = 2.0
"""Factor from the mode up to which a performance counts as near: ours."""

REMARKABLE = 2.0
"""Factor between the worst and the best start from which on the start matters: ours."""


class Fig5(Claim):
    """One network, a thousand starts."""

    key: ClassVar[str] = "fig5"
    where: ClassVar[str] = "§4.2, fig. 5"
    title: ClassVar[str] = "Four of five starts end near the most frequent performance"
    says: ClassVar[str] = (
        "Of 1000 trainings from random weights more than 80 % reach a performance in an acceptable range around the "
        "most frequent one, which is about 0.06; the influence of the start can be remarkable."
    )
    choices: ClassVar[tuple[str, ...]] = (
        f"The “acceptable range” is not printed: from the mode divided by {WITHIN:g} to the mode times {WITHIN:g}.",
        "The mode is that of a kernel density estimate of the logarithm (Scott's width).",
        "The start: rule of Nguyen and Widrow, the default of the paper's toolbox; the paper names none.",
        "The most frequent performance itself, 0.06 in the paper, is not judged: the main setting was chosen by it.",
    )
    settings: ClassVar[tuple[Training, ...]] = (*ANALYSIS, PATIENT)

    def collect(self, lab: Lab, setting: Training) -> Rows:
        """The paper's network from a thousand starts."""
        return lab.trials(setting, [lab.variant(setting, "paper's network")], times=10)

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Share near the mode, and worst over best."""
        sets = _performances(rows)
        modes = [_mode(values) for values in sets]
        near = Interval.of(_near(values, mode) for values, mode in zip(sets, modes, strict=True))
        spread = Interval.of_ratio([values.max() for values in sets], [values.min() for values in sets])
        width = float(np.mean([_width(values, mode) for values, mode in zip(sets, modes, strict=True)]))
        mode = np.exp(np.mean(np.log(modes)))
        return (
            Line(
                f"share of trainings within a factor of {WITHIN:g} of the most frequent performance",
                "more than 80 %",
                near,
                f"80 % lie within a factor of {width:.3g} of the most frequent one, {mode:.2g} (the paper: 0.06).",
                low=SHARE,
                percent=True,
            ),
            Line(
                "worst performance over the best",
                f"the start matters (above {REMARKABLE:g})",
                spread,
                "The same network on the same data, from other random weights.",
                low=REMARKABLE,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Histogram of the first data set, as in the paper; those of the others as thin lines."""
        (ax,) = axes
        sets = _performances(rows)
        mode = _mode(sets[0])
        bins = np.linspace(0.0, max(np.quantile(np.concatenate(sets), 0.995), 4 * FLOOR), 41)
        ax.axvspan(mode / WITHIN, min(mode * WITHIN, bins[-1]), color=COLOURS[1], alpha=0.15, linewidth=0)
        ax.hist(sets[0], bins, color=COLOURS[0], label="first data set")
        for place, values in enumerate(sets[1:]):
            label = "other data sets" if place == 0 else None
            ax.hist(values, bins, histtype="step", color=DARK, linewidth=0.4, label=label)
        ax.axvline(mode, color=DARK, linestyle=":", label=f"its mode, {mode:.2g}; blue: within a factor of {WITHIN:g}")
        ax.set(xlabel=AXIS, ylabel="trainings")
        ax.set_xlim(0, bins[-1])
        ax.set_ylim(top=1.35 * ax.get_ylim()[1])  # room for the legend
        ax.legend()


def _performances(rows: Rows) -> list[np.ndarray]:
    """Those of each data set."""
    return [np.maximum([row[PERFORMANCE] for row in own], FLOOR) for own in data_sets(rows)]


def _mode(values: np.ndarray) -> float:
    logs = np.log(values)
    if np.ptp(logs) == 0.0:
        return float(values[0])
    grid = np.linspace(logs.min(), logs.max(), 1000)
    return float(np.exp(grid[np.argmax(scipy.stats.gaussian_kde(logs)(grid))]))


def _near(values: np.ndarray, mode: float) -> float:
    return float(np.mean((values >= mode / WITHIN) & (values <= mode * WITHIN)))


def _width(values: np.ndarray, mode: float) -> float:
    """Factor from the mode within which the paper's share lies."""
    return float(np.exp(np.quantile(np.abs(np.log(values / mode)), SHARE)))
