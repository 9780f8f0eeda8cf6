"""Fig. 11: the backlash node's output against the play."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import scipy.stats
from matplotlib.axes import Axes

from classifier.style import COLOURS, DARK, GREY
from indexer_experiments.recipes import column, labelled_by_code, read
from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import DIAGNOSIS, Simulated
from indexer_experiments.study.verdicts import Interval, Line, data_sets

NODE = 4
"""The fifth output node, whose bit is 1 without play (Table 2)."""

RISING, LINEAR = 0.95, 0.95
"""Rank correlation with the play, and share of variance that a straight line explains, at least: ours."""


class Fig11(Claim):
    """A network taught none and much says how much."""

    key: ClassVar[str] = "fig11"
    where: ClassVar[str] = "§4.3, fig. 11"
    title: ClassVar[str] = "The backlash node's output follows the play about linearly"
    says: ClassVar[str] = (
        "Taught on classes with and without play in joint 2, the network answers plays between with an output of its "
        "fifth node that changes about linearly with the play."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "Trained as in §4.3; judged on new machines of Model B with linear joints and eleven plays, 12 machines each.",
        "The bit is 1 without play in Table 2 (and 1 with play in §5): shown is 1 − output, which should rise.",
        "The largest play is not printed: 1 mrad is ours, and 0.2 mrad is tried.",
        f"“About linearly”: rank correlation ≥ {RISING:g} and a straight line explains ≥ {100 * LINEAR:.0f} % of the "
        "variance of the mean outputs.",
    )
    settings: ClassVar[tuple[Simulated, ...]] = DIAGNOSIS

    def collect(self, lab: Lab, setting: Simulated) -> Rows:
        """Outputs of every network for every play, mean over machines."""
        variant, rows = lab.variant(setting, "paper's network"), []
        for seed in lab.seeds:
            trained = lab.train(labelled_by_code(lab.place(setting.recipe, seed)), variant, seed)
            records, table, _ = read(lab.place_apart(setting.sweep, seed))
            plays = column(table, "output_joint_backlash")
            said = 1.0 - trained.outputs(records)[:, :, NODE]
            for play in np.unique(plays):
                outputs = said[:, plays == play].mean(axis=1)
                own = [
                    {"play": float(play), "network": network, "output": float(output)}
                    for network, output in enumerate(outputs)
                ]
                rows += lab.told(setting, seed, own)
        return rows

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Rank correlation and straight line of the mean over networks, data set by data set."""
        curves = _curves(rows)
        span = np.mean([outputs[-1] - outputs[0] for _, outputs in curves])
        halves = [half for curve in curves if (half := _half(*curve)) is not None]
        where = f"at {100 * np.mean(halves):.0f} % of the largest play" if halves else "at no play"
        some = f" on {len(halves)} of {len(curves)} data sets" if 0 < len(halves) < len(curves) else ""
        return (
            Line(
                "rank correlation of the output with the play",
                f"rises (above {RISING:g})",
                Interval.of(_rank(plays, outputs) for plays, outputs in curves),
                f"From no play to the largest the output changes by {span:.2g}.",
                low=RISING,
            ),
            Line(
                "share of the output's variance on a straight line",
                f"quite linear (above {LINEAR:g})",
                Interval.of(np.corrcoef(plays, outputs)[0, 1] ** 2 for plays, outputs in curves),
                f"The output reaches one half {where}{some}.",
                low=LINEAR,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean over networks: each data set grey, their mean blue."""
        (ax,) = axes
        curves = _curves(rows)
        for place, (plays, outputs) in enumerate(curves):
            ax.plot(1e3 * plays, outputs, color=GREY, linewidth=0.7, label="data sets" if place == 0 else None)
        plays, mean = curves[0][0], np.mean([outputs for _, outputs in curves], axis=0)
        ax.plot(1e3 * plays, mean, "o-", color=COLOURS[0], label="their mean")
        line = np.polynomial.Polynomial.fit(plays, mean, 1)
        ax.plot(1e3 * plays, line(plays), ":", color=DARK, label="straight line")
        ax.set(xlabel="play of joint 2 [mrad]", ylabel="1 − output of node 5")
        ax.legend()


def _half(plays: np.ndarray, outputs: np.ndarray) -> float | None:
    """Share of the largest play at which the output first rises to one half; None where it never does."""
    rises = np.flatnonzero((outputs[:-1] < 0.5) & (outputs[1:] >= 0.5))
    if not rises.size:
        return None
    k = slice(rises[0], rises[0] + 2)
    return float(np.interp(0.5, outputs[k], plays[k] / plays[-1]))


def _rank(plays: np.ndarray, outputs: np.ndarray) -> float:
    rank = scipy.stats.spearmanr(plays, outputs)
    return float(rank.statistic)  # type: ignore[attr-defined]


def _curves(rows: Rows) -> list[tuple[np.ndarray, np.ndarray]]:
    """Plays [rad] and mean outputs over networks, of each data set."""
    curves = []
    for own in data_sets(rows):
        plays = sorted({row["play"] for row in own})
        means = [np.mean([row["output"] for row in own if row["play"] == play]) for play in plays]
        curves.append((np.array(plays), np.array(means)))
    return curves
