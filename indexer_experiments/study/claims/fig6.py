"""Fig. 6: how many hidden nodes."""

from __future__ import annotations

from typing import ClassVar

from matplotlib.axes import Axes

from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import draw_lines, errors_made, performances, ranked, ratio
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import ANALYSIS, Training
from indexer_experiments.study.verdicts import Line

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
        f"“Clearly better”: ahead of the second best by more than {100 * (CLEAR - 1):.0f} %.",
        f"“No great differences”: means within a factor of {ALIKE:g}.",
    )
    settings: ClassVar[tuple[Training, ...]] = ANALYSIS

    def collect(self, lab: Lab, setting: Training) -> Rows:
        """All numbers of nodes."""
        return lab.trials(setting, [lab.variant(setting, _name(hidden), hidden, hidden=hidden) for hidden in HIDDEN])

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """The second best against the best, and the worst of 15 and more against the best of them."""
        means = performances(rows)
        best, second = ranked(means, list(means))[:2]
        order = ranked(means, [_name(hidden) for hidden in HIDDEN if hidden >= ENOUGH])
        return (
            Line(
                "error of the second best number of nodes over that of the best",
                f"none clearly best (below {CLEAR:g})",
                ratio(means, [second], [best]),
                f"Best are {best} nodes, then {second}; {errors_made(rows)}.",
                high=CLEAR,
            ),
            Line(
                f"error of the worst number from {ENOUGH} on over that of the best",
                f"no great differences (below {ALIKE:g})",
                ratio(means, [order[-1]], [order[0]]),
                f"From {ENOUGH} nodes on, {order[0]} are best and {order[-1]} worst.",
                high=ALIKE,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean dotted and best solid, as in the paper."""
        (ax,) = axes
        draw_lines(ax, rows, [_name(hidden) for hidden in HIDDEN], "binary, logistic", 0)
        ax.set_xlabel("hidden nodes")


def _name(hidden: int) -> str:
    return str(hidden)
