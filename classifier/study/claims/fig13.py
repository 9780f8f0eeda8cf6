"""Figs. 13 to 15: backlashes that were not taught."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np
import scipy.stats
from matplotlib.axes import Axes

from classifier.study.claims.base import Claim, Rows
from classifier.study.claims.on_bench import answers, draw_answers
from classifier.study.lab import Lab
from classifier.study.settings import BENCH, Setting
from classifier.study.verdicts import Interval, Statement

CASES = {"case a": (0, 4), "case b": (0, 2, 4), "case c": (0, 1, 3, 4)}
"""Numbers of the backlashes taught: 0 and 20°; 10° too; 5° and 15° too."""

RISING = 0.9
"""Rank correlation of output and backlash from which on an output is said to rise: ours."""

ERROR = "backlash_error_of_networks"


class Fig13(Claim):
    """Generalisation along the backlash."""

    key: ClassVar[str] = "fig13"
    where: ClassVar[str] = "§5.2, figs. 13–15"
    title: ClassVar[str] = "Unseen backlashes are told the better, the more are taught"
    says: ClassVar[str] = (
        "Taught 0 and 20° only (case a) the third node errs much on 5, 10 and 15°, but still rises; with 10° taught "
        "too (case b), and with 5° and 15° (case c), the error on what was not taught falls."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "All four states of rollers and screws are taught and judged; drawn is the paper's example, rollers cracked.",
        "Error: mean distance of the third output from its target over validation records of backlashes not taught, "
        "mean over networks.",
        "The cases leave different backlashes unseen (5, 10, 15; 5, 15; 10): they are judged at equal ones too.",
        "Printed intermediate targets (0.24, 0.48, 0.76) and other ways to stop are tried.",
    )
    settings: ClassVar[tuple[Setting, ...]] = BENCH
    panels: ClassVar[int] = 3

    def collect(self, lab: Lab, setting: Setting) -> Rows:
        """The three cases."""
        return answers(lab, setting, CASES)

    def judge(self, rows: Rows) -> tuple[Statement, ...]:
        """Errors of the cases against each other, and the order of the outputs in case a."""
        a, b, c = (_errors(rows, case) for case in CASES)
        level = {case: 100 * error.mean() for case, error in zip(CASES, (a, b, c), strict=True)}
        told = ", ".join(f"{case} {error:.1f} %" for case, error in level.items())
        sides_a, sides_b = (_errors(rows, case, (1, 3)) for case in ("case a", "case b"))
        middle_a, middle_c = (_errors(rows, case, (2,)) for case in ("case a", "case c"))
        rising = Interval.of(_rank(rows, seed) for seed in sorted({row["data_seed"] for row in rows}))
        return (
            _falls("the error falls from case a to case b", a, b, f"; errors: {told}"),
            _falls("at 5° and 15°, which neither is taught, it falls from case a to case b", sides_a, sides_b),
            _falls("at 10°, which neither is taught, it falls from case a to case c", middle_a, middle_c),
            _falls("the error falls from case b to case c", b, c),
            Statement(
                "in case a the output still rises with the backlash",
                f"mean rank correlation ≥ {RISING:g}",
                str(rising),
                rising.mean >= RISING,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """One panel a case, as in the paper's three figures."""
        for ax, case in zip(axes, CASES, strict=True):
            draw_answers(ax, rows, case)
            ax.set_title(case)


def _errors(rows: Rows, case: str, levels: Iterable[int] = range(5)) -> np.ndarray:
    """Error of each data set over the backlashes not taught, among `levels`."""
    cells: dict[int, list[float]] = {}
    for row in rows:
        if row["variant"] == case and not row["taught"] and row["level"] in levels:
            cells.setdefault(row["data_seed"], []).append(row[ERROR])
    return np.array([np.mean(cells[seed]) for seed in sorted(cells)])


def _falls(says: str, before: np.ndarray, after: np.ndarray, more: str = "") -> Statement:
    ratio = Interval.of_ratio(after, before)
    return Statement(says, "after over before below 1 by the whole interval", f"{ratio}{more}", ratio.high < 1.0)


def _rank(rows: Rows, seed: int) -> float:
    own = [row for row in rows if row["data_seed"] == seed and row["variant"] == "case a"]
    rank = scipy.stats.spearmanr([row["level"] for row in own], [row["output_backlash"] for row in own])
    return float(rank.statistic)  # type: ignore[attr-defined]
