"""Fig. 12: the twenty cases of the bench."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.on_bench import NODES, answers, draw_answers
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import BENCH, OnBench
from indexer_experiments.study.trials import misclassified
from indexer_experiments.study.verdicts import Interval, Line, data_sets

EVERYTHING = "all backlashes taught"

MOST = 0.5
"""Share of the data sets from which on what the paper saw on its one data set is what most would show."""


class Fig12(Claim):
    """Every case taught."""

    key: ClassVar[str] = "fig12"
    where: ClassVar[str] = "§5.2, fig. 12"
    title: ClassVar[str] = "All twenty cases of the bench are classified"
    says: ClassVar[str] = (
        "Two states of the rollers, two of the screws and five backlashes, ten tests of each case, seven to train "
        "and three to validate: every case is classified, and any user could say which it is."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "The bench is simulated (campaign=bench); it is ours, the paper's records are not published.",
        "No control set is named for the bench: of the 7 training tests 5 train and 2 stop the training; all 7 with "
        "the 3 others as control are tried.",
        "“Backlash 20 %” is read as 20 degrees; intermediate targets are 0.25, 0.5 and 0.75, and the 0.24, 0.48 and "
        "0.76 of the figures are tried.",
        "Fig. 12 goes by the mean of the three records of a case, and so does the verdict.",
        "Classified: the three outputs lie nearest to the record's own code of the twenty; kept is the network with "
        "the lowest control error.",
    )
    settings: ClassVar[tuple[OnBench, ...]] = BENCH

    def collect(self, lab: Lab, setting: OnBench) -> Rows:
        """One case: everything taught."""
        return answers(lab, setting, {EVERYTHING: (0, 1, 2, 3, 4)})

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """By the mean of the three records of a case; single records are told beside it."""
        cases = [_cases_right(own) for own in data_sets(rows)]
        records = 1.0 - np.mean([row["wrong"] for row in rows])
        return (
            Line(
                "data sets of which every case is right, by the mean of its three records",
                "100 % of the cases",
                Interval.of_yes(share == 1.0 for share in cases),
                f"{100 * np.mean(cases):.3g} % of the cases are right, of single records {100 * records:.3g} %.",
                low=MOST,
                percent=True,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """The paper's example: rollers cracked, screws tight."""
        draw_answers(axes[0], rows, EVERYTHING)


def _cases_right(rows: Rows) -> float:
    """Share of the cases whose mean outputs lie nearest to their own code."""
    cells: dict[tuple[int, ...], Rows] = {}
    for row in rows:
        cells.setdefault((row["roller"], row["screws"], row["level"]), []).append(row)
    outputs, targets = (
        np.array([[np.mean([row[f"{what}_{node}"] for row in own]) for node in NODES] for own in cells.values()])
        for what in ("output", "target")
    )
    return float(1.0 - misclassified(outputs[None], targets).mean())
