"""Fig. 6: how many hidden nodes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from classifier.study.claims.base import Claim, Rows
from classifier.study.claims.lines import alike, draw_lines, errors_made, performances
from classifier.study.lab import Lab
from classifier.study.settings import TABLE2, Setting
from classifier.study.verdicts import Interval, Statement

HIDDEN = (2, 5, 8, 10, 12, 15, 20, 25, 30, 40)
ENOUGH = 15
"""Hidden nodes from which on the paper sees little difference."""

CLEAR, ALIKE = 1.1, 1.25
"""Factor by which the best must lead to be clearly best, and up to which performances are alike: ours."""


class Fig6(Claim):
    """Size of the hidden layer."""

    key: ClassVar[str] = "fig6"
    where: ClassVar[str] = "§4.2, fig. 6"
    title: ClassVar[str] = "No number of hidden nodes is clearly best, 15 or more are much alike"
    says: ClassVar[str] = (
        "100 trainings for each number of hidden nodes: no number is clearly better than the others, and from 15 "
        "nodes on there are no great differences."
    )
    choices: ClassVar[tuple[str, ...]] = (
        f"The numbers of nodes are not printed: {', '.join(map(str, HIDDEN))}.",
        f"“Clearly better”: ahead of the second best by more than {100 * (CLEAR - 1):.0f} %, by the whole interval.",
        f"“No great differences”: means within a factor of {ALIKE:g}.",
    )
    settings: ClassVar[tuple[Setting, ...]] = TABLE2

    def collect(self, lab: Lab, setting: Setting) -> Rows:
        """All numbers of nodes."""
        return lab.trials(setting, [lab.variant(setting, _name(hidden), hidden, hidden=hidden) for hidden in HIDDEN])

    def judge(self, rows: Rows) -> tuple[Statement, ...]:
        """The best against the second best, and those of 15 and more against each other."""
        means = performances(rows)
        order = sorted(means, key=lambda name: float(np.mean(np.log(means[name]))))
        ahead = Interval.of_ratio(means[order[1]], means[order[0]])
        found = f"{order[0]} nodes before {order[1]} by a factor of {ahead} ({errors_made(rows)})"
        rule = f"second best over best not above {CLEAR:g} by the whole interval"
        enough = [_name(hidden) for hidden in HIDDEN if hidden >= ENOUGH]
        return (
            Statement("no number of nodes is clearly best", rule, found, ahead.low <= CLEAR),
            alike(f"{ENOUGH} or more nodes are much alike", rows, enough, ALIKE),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean dotted and best solid, as in the paper."""
        (ax,) = axes
        draw_lines(ax, rows, [_name(hidden) for hidden in HIDDEN], "binary, logistic", 0)
        ax.set_xlabel("hidden nodes")


def _name(hidden: int) -> str:
    return str(hidden)
