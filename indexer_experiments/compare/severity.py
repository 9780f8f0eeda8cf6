"""How far severities are off, whether their intervals hold, and whether they follow wear."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import rankdata

from classifier.results import Row, means
from classifier.style import COLOURS, GREY, style
from classifier.tasks.severity import COVERAGE, QUANTITIES, Severity, severities_of
from indexer_experiments.compare.recipes import drawn, varied, wear
from indexer_experiments.compare.study import Setting, Study
from indexer_experiments.compare.trained import Seen

ERROR, COVERED, COVERED_WHEN, WIDTH, RANK = (
    "mean error",
    "covered [%]",
    "covered where there is a fault [%]",
    "mean width",
    "rank correlation",
)
TOLD = "told"
"""Single records of one life, for the picture: what is told, over the true backlash."""


def run(setting: Setting) -> list[Row]:
    """Both data sets with held-out machines, then the lives of the campaign `wear` under the part of the first one."""
    rows: list[Row] = []
    parts = {}
    for data, recipe in (("drawn", drawn(setting.records)), ("varied", varied(setting.records))):
        seen = Seen.of(setting.dataset(recipe))
        part = Severity.fit(seen.dataset, seen.scaled, np.empty((len(seen.scaled), 0)), setting.seed)
        parts[data] = (seen, part)
        validation = seen.dataset.rows("validation")
        told = part.assess(seen.scaled[validation], np.empty(0), seen.dataset.records[validation])
        truth = severities_of(seen.dataset)
        for name in part.names:
            found = _judged(told, name, truth[name][validation])
            rows += [Row("severity", data, name, metric, setting.seed, value) for metric, value in found.items()]
    return rows + _wear(setting, *parts["drawn"])


def rank_correlation(told: np.ndarray, truth: np.ndarray) -> float:
    """Spearman's: the correlation between the ranks of two columns (n,)."""
    return float(np.corrcoef(rankdata(told), rankdata(truth))[0, 1])


def _judged(told: dict[str, np.ndarray], name: str, truth: np.ndarray) -> dict[str, float]:
    low, high = told[f"{name}_low"], told[f"{name}_high"]
    inside = (low <= truth) & (truth <= high)
    return {
        ERROR: float(np.abs(told[name] - truth).mean()),
        COVERED: float(100 * inside.mean()),
        COVERED_WHEN: float(100 * inside[truth > 0].mean()),
        WIDTH: float((high - low).mean()),
        RANK: rank_correlation(told[name], truth),
    }


def _wear(setting: Setting, seen: Seen, part: Severity) -> list[Row]:
    """All lives count as new machines: the part has seen none of them. The rank correlation is the mean over the lives
    of that between the backlash told and the true one, which only grows."""
    name = "backlash_deg"
    data = setting.apart(wear(max(4, setting.records // 75)))
    truth = QUANTITIES[name].factor * data.table.column(QUANTITIES[name].column).to_numpy()
    told = part.assess(seen.features.apply(data.records), np.empty(0), data.records)
    found = _judged(told, name, truth)
    lives = data.table.column("machine_draw").to_numpy()
    ranks = [rank_correlation(told[name][lives == life], truth[lives == life]) for life in np.unique(lives)]
    found[RANK] = float(np.mean(ranks))
    rows = [Row("severity", "wear", name, metric, setting.seed, value) for metric, value in found.items()]
    first = np.flatnonzero(lives == lives[0])
    for ending in ("", "_low", "_high"):
        column = told[name + ending]
        rows += [
            Row("severity", "wear", name + ending, TOLD, setting.seed, float(column[row]), float(truth[row]))
            for row in first
        ]
    return rows


def follow_wear(rows: Sequence[Row]) -> Figure:
    """Backlash told over the true one in the first life of every seed, with the interval of the first."""
    with style():
        figure = Figure(figsize=(6, 4), layout="constrained")
        ax = figure.subplots()
        for place, seed in enumerate(sorted({row.seed for row in rows})):
            truth, value, low, high = (_told(rows, seed, ending) for ending in ("x", "", "_low", "_high"))
            colour = COLOURS[place % len(COLOURS)]
            if place == 0:
                label = f"{100 * COVERAGE:.0f} % interval of seed {seed}"
                ax.fill_between(truth, low, high, color=colour, alpha=0.2, linewidth=0, label=label)
            ax.plot(truth, value, ".-", color=colour, linewidth=0.6, label=f"a life of seed {seed}")
        ax.axline((0, 0), slope=1, color=GREY, label="true")
        ax.set(xlabel="true backlash [° at the motor shaft]", ylabel="backlash told [°]", title="campaign wear")
        ax.legend()
    return figure


def _told(rows: Sequence[Row], seed: int, ending: str) -> list[float]:
    """What is told of the records of a life under a name with this ending; "x": their true backlash."""
    method = "backlash_deg" + (ending if ending != "x" else "")
    life = [row for row in rows if (row.seed, row.metric, row.method) == (seed, TOLD, method)]
    return [row.x if ending == "x" else row.value for row in life]


def coverage(rows: Sequence[Row]) -> Figure:
    """Coverage of every severity on every data set beside the promised one."""
    found = {key[:2]: value for key, value in means(rows).items() if key[2] == COVERED}
    with style():
        figure = Figure(figsize=(6, 1 + 0.35 * len(found)), layout="constrained")
        ax = figure.subplots()
        for line, (value, low, high, _) in enumerate(found.values()):
            ax.plot([low, high], [line, line], color=COLOURS[0], linewidth=2)
            ax.plot(value, line, "o", color=COLOURS[0])
        ax.axvline(100 * COVERAGE, color=GREY)
        ax.set_yticks(range(len(found)), [f"{data}: {name}" for data, name in found])
        ax.invert_yaxis()
        ax.set(xlabel=COVERED, title="share of held-out records whose true severity lies in its interval")
    return figure


STUDY = Study(
    "How far are severities off, do their 90 % intervals hold, and do they follow wear?",
    ("severity",),
    run,
    ((ERROR, 3), (WIDTH, 3), (COVERED, 1), (COVERED_WHEN, 1), (RANK, 3)),
    {"wear": follow_wear, "coverage": coverage},
)
