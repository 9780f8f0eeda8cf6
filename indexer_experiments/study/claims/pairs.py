"""Figs. 7 and 8: two kinds of network compared over several numbers of hidden nodes."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes

from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import draw_lines, performances, ratio
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import ANALYSIS, Training
from indexer_experiments.study.verdicts import Line, by_seed

HIDDEN = (5, 10, 15, 20, 30)


class Pair(Claim):
    """What both figures share.

    first, second  name of each kind; the claim is that the first performs better
    what           what it is that differs
    networks       choices of each kind by its name, as `Variant` takes them; further kinds are only drawn and told
    """

    first: ClassVar[str]
    second: ClassVar[str]
    what: ClassVar[str]
    networks: ClassVar[dict[str, dict[str, Any]]]
    settings: ClassVar[tuple[Training, ...]] = ANALYSIS

    def collect(self, lab: Lab, setting: Training) -> Rows:
        """Every kind with every number of hidden nodes."""
        variants = [
            lab.variant(setting, _name(kind, hidden), hidden, hidden=hidden, **choices)
            for kind, choices in self.networks.items()
            for hidden in HIDDEN
        ]
        return lab.trials(setting, variants)

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Mean and best performance of the first kind over those of the second."""
        first, second = _names(self.first), _names(self.second)
        mean, best = (ratio(performances(rows, reduce), first, second) for reduce in (np.mean, np.min))
        says = f"error of {self.first} {self.what} over that of {self.second} ones"
        better = f"{self.first} better (below 1)"
        return (
            Line(f"{says}, in the mean", better, mean, self.why(rows), high=1.0),
            Line(f"{says}, at best", better, best, "The best network of each kind and data set.", high=1.0),
        )

    def why(self, rows: Rows) -> str:
        """What helps to understand the ratio of the means."""
        shares = by_seed(rows, "control_misclassified")
        told = (
            f"{100 * np.mean([shares[name] for name in _names(kind)]):.3g} % with {kind}"
            for kind in (self.first, self.second)
        )
        return f"Misclassified control records: {', '.join(told)} {self.what}."

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """First kind solid, the others dashed, as in the paper: mean with circles, best with dots."""
        (ax,) = axes
        for place, kind in enumerate(self.networks):
            style = "-" if kind == self.first else "--"
            draw_lines(ax, rows, _names(kind), kind, (0, 4, 2)[place], style)
        ax.set_xlabel("hidden nodes")


class Fig7(Pair):
    """Targets."""

    key: ClassVar[str] = "fig7"
    where: ClassVar[str] = "§4.2, fig. 7"
    title: ClassVar[str] = "Binary targets are better than bipolar ones"
    says: ClassVar[str] = "Networks taught 0 and 1 perform better than networks taught −1 and 1."
    choices: ClassVar[tuple[str, ...]] = (
        "A logistic output cannot reach −1: bipolar networks get a tanh output; the hidden layer is logistic, and "
        "tanh as well in a third line.",
        "The mean square error on targets of −1 and 1 is four times that on 0 and 1 for the same answers: all are "
        "compared on the scale of 0 and 1, and the ratio on the targets' own scale is told beside it.",
        f"The abscissa is not named: hidden nodes, {', '.join(map(str, HIDDEN))}.",
    )
    first: ClassVar[str] = "binary"
    second: ClassVar[str] = "bipolar"
    what: ClassVar[str] = "targets"
    networks: ClassVar[dict[str, dict[str, Any]]] = {
        "binary": {},
        "bipolar": {"targets": "bipolar", "output_function": "tanh"},
        "bipolar, tanh hidden": {"targets": "bipolar", "output_function": "tanh", "hidden_function": "tanh"},
    }

    def why(self, rows: Rows) -> str:
        """The ratio on the targets' own scale, too."""
        own = ratio(performances(rows, value="performance_of_targets"), _names(self.first), _names(self.second))
        scale = f"With each error on its targets' own scale the ratio would be {own.mean:.2g}."
        return f"{super().why(rows)} {scale}"


class Fig8(Pair):
    """Output functions."""

    key: ClassVar[str] = "fig8"
    where: ClassVar[str] = "§4.2, fig. 8"
    title: ClassVar[str] = "A logistic output is better than a linear one"
    says: ClassVar[str] = (
        "Logistic functions in both layers perform better than a logistic hidden and a linear output layer."
    )
    choices: ClassVar[tuple[str, ...]] = (f"The abscissa is not named: hidden nodes, {', '.join(map(str, HIDDEN))}.",)
    first: ClassVar[str] = "logistic"
    second: ClassVar[str] = "linear"
    what: ClassVar[str] = "outputs"
    networks: ClassVar[dict[str, dict[str, Any]]] = {"logistic": {}, "linear": {"output_function": "linear"}}


def _name(kind: str, hidden: int) -> str:
    return f"{kind}, {hidden} hidden"


def _names(kind: str) -> list[str]:
    return [_name(kind, hidden) for hidden in HIDDEN]
