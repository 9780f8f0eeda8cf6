"""Fig. 9: ten training rules."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from classifier.study.claims.base import Claim, Rows
from classifier.study.claims.lines import AXIS, alike, errors_made, performances
from classifier.study.lab import Lab
from classifier.study.settings import TABLE2, Setting
from classifier.study.verdicts import Interval, Statement, by_seed
from classifier.style import COLOURS

RULES = tuple(f"train{rule}" for rule in ("gdx", "gda", "rp", "cgf", "cgp", "cgb", "scg", "bfg", "oss", "lm"))
"""In the order of the paper's list."""

POOR, CHOSEN = "trainrp", "traingdx"
ALIKE, SLOWER = 1.5, 3.0
"""Factor up to which performances are alike and from which on durations differ remarkably: ours."""


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
        "The best choice: no other rule is both better, by the whole interval, and faster.",
    )
    settings: ClassVar[tuple[Setting, ...]] = TABLE2

    def collect(self, lab: Lab, setting: Setting) -> Rows:
        """The paper's network by every rule."""
        variants = [lab.variant(setting, rule, x, rule=rule) for x, rule in enumerate(RULES)]
        # On inputs that are not scaled trainlm takes a second and more for each network.
        return lab.trials(setting, variants, None if setting.scaled else -(-lab.size.trainings // 4))

    def judge(self, rows: Rows) -> tuple[Statement, ...]:
        """trainrp, the nine others, durations, the paper's choice."""
        means, seconds = performances(rows), by_seed(rows, "seconds")
        others = [rule for rule in RULES if rule != POOR]
        worst = max(others, key=lambda rule: float(np.mean(np.log(means[rule]))))
        poor = Interval.of_ratio(means[POOR], means[worst])
        slow = {rule: float(seconds[rule].mean()) for rule in RULES}
        duration = max(slow.values()) / min(slow.values())
        told = ", ".join(f"{rule} {1000 * slow[rule]:.0f}" for rule in RULES)
        return (
            Statement(
                "trainrp performs worst, clearly",
                "its mean over that of the worst other rule lies above 1 by the whole interval",
                f"{poor} times that of {worst} ({errors_made(rows)})",
                poor.low > 1.0,
            ),
            alike("the other nine perform alike", rows, others, ALIKE),
            Statement(
                "durations differ remarkably",
                f"slowest over fastest ≥ {SLOWER:g}",
                f"{duration:.1f}; ms a network: {told}",
                duration >= SLOWER,
            ),
            _choice(means, slow),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean and best of each rule, as in the paper, and the time that each takes."""
        (ax,) = axes
        for reduce, label, marker in ((np.mean, "mean", "o"), (np.min, "best", "s")):
            cells = performances(rows, reduce)
            spans = [Interval.of(np.log(cells[rule])) for rule in RULES]
            middle, low, high = (np.exp([getattr(span, end) for span in spans]) for end in ("mean", "low", "high"))
            arms = None if np.isinf(high).any() else np.array([middle - low, high - middle])
            ax.errorbar(
                range(len(RULES)), middle, arms, fmt=marker, color=COLOURS[0 if label == "mean" else 2], label=label
            )
        ax.set_yscale("log")
        seconds = by_seed(rows, "seconds")
        words = [f"{rule.removeprefix('train')}\n{1000 * seconds[rule].mean():.0f}" for rule in RULES]
        ax.set_xticks(range(len(RULES)), words)
        ax.set(xlabel="training rule, train…; below it milliseconds a network", ylabel=AXIS)
        ax.legend()


def _choice(means: dict[str, np.ndarray], slow: dict[str, float]) -> Statement:
    ahead = []
    for rule in means:
        ratio = Interval.of_ratio(means[rule], means[CHOSEN])
        if ratio.high < 1.0 and slow[rule] < slow[CHOSEN]:
            ahead.append(f"{rule} (performance {ratio} times, time {slow[rule] / slow[CHOSEN]:.2g} times)")
    return Statement(
        "traingdx is the best choice",
        "no other rule is better and faster",
        f"better and faster: {', '.join(ahead) or 'none'}",
        not ahead,
    )
