"""Fig. 9: ten training rules."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import AXIS, draw_means, errors_made, performances, ranked, ratio
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import ANALYSIS, Training
from indexer_experiments.study.verdicts import Interval, Line, by_seed

RULES = tuple(f"train{rule}" for rule in ("gdx", "gda", "rp", "cgf", "cgp", "cgb", "scg", "bfg", "oss", "lm"))
"""In the order of the paper's list."""

POOR, CHOSEN = "trainrp", "traingdx"
ALIKE, SLOWER, CLEAR = 1.5, 3.0, 1.1
"""Factors up to which errors are alike, from which on durations differ and a rule is clearly better: ours."""


class Fig9(Claim):
    """Which rule to train by."""

    key: ClassVar[str] = "fig9"
    where: ClassVar[str] = "§4.2, fig. 9"
    title: ClassVar[str] = "Training rules differ in time more than in performance; trainrp is poor"
    says: ClassVar[str] = (
        "Ten training rules differ remarkably in duration but not much in performance, except trainrp, which is very "
        "poor; traingdx is the best choice by performance and time together."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "No number of any rule is printed: those documented for the paper's toolbox, or of the source of the rule.",
        f"“No important differences”: means of the nine others within a factor of {ALIKE:g}.",
        f"“Remarkable” durations: slowest over fastest at least {SLOWER:g}, in processor time of this implementation.",
        f"The best choice: no rule that is not slower is better by more than {100 * (CLEAR - 1):.0f} %.",
    )
    settings: ClassVar[tuple[Training, ...]] = ANALYSIS

    def collect(self, lab: Lab, setting: Training) -> Rows:
        """The paper's network by every rule."""
        return lab.trials(setting, [lab.variant(setting, rule, x, rule=rule) for x, rule in enumerate(RULES)])

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """trainrp, the nine others, durations, the paper's choice."""
        means, seconds = performances(rows), by_seed(rows, "seconds")
        order = ranked(means, RULES)
        others = [rule for rule in order if rule != POOR]
        speed = sorted(RULES, key=lambda rule: float(seconds[rule].mean()))
        # The chosen rule is not slower than itself, so there is always one.
        fast = [rule for rule in RULES if seconds[rule].mean() <= seconds[CHOSEN].mean()]
        rival = ranked(means, fast)[0]
        place = order.index(POOR) + 1
        return (
            Line(
                f"error of {POOR} over that of the worst other rule",
                f"{POOR} very poor (above 1)",
                ratio(means, [POOR], others[-1:]),
                f"Of ten rules {POOR} is number {place}, the worst other rule is {others[-1]}; {errors_made(rows)}.",
                low=1.0,
            ),
            Line(
                "error of the worst of the nine others over that of the best",
                f"no important differences (below {ALIKE:g})",
                ratio(means, others[-1:], others[:1]),
                f"Of the nine others {others[0]} is best and {others[-1]} worst.",
                high=ALIKE,
            ),
            Line(
                "time of the slowest rule over that of the fastest",
                f"remarkable differences (above {SLOWER:g})",
                Interval.of_ratio(seconds[speed[-1]], seconds[speed[0]]),
                f"Fastest is {speed[0]} with {_milliseconds(seconds, speed[0])} a network, slowest {speed[-1]} with "
                f"{_milliseconds(seconds, speed[-1])}.",
                low=SLOWER,
            ),
            Line(
                f"least error among rules not slower than {CHOSEN} over that of {CHOSEN}",
                f"none clearly better (above {1 / CLEAR:.2g})",
                ratio(means, [rival], [CHOSEN]),
                f"That rule is {rival}, in {_milliseconds(seconds, rival)} a network beside "
                f"{_milliseconds(seconds, CHOSEN)}.",
                low=1 / CLEAR,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean and best of each rule, as in the paper, and the time that each takes."""
        (ax,) = axes
        for reduce, label, colour in ((np.mean, "mean", 0), (np.min, "best", 2)):
            cells = performances(rows, reduce)
            draw_means(ax, [cells[rule] for rule in RULES], label, colour)
        seconds = by_seed(rows, "seconds")
        words = [f"{rule.removeprefix('train')}\n{1000 * seconds[rule].mean():.0f}" for rule in RULES]
        ax.set_xticks(range(len(RULES)), words)
        ax.set(xlabel="training rule, train…; below it milliseconds a network", ylabel=AXIS)
        ax.legend()


def _milliseconds(seconds: dict[str, np.ndarray], rule: str) -> str:
    return f"{1000 * seconds[rule].mean():.3g} ms"
