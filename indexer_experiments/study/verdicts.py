"""From numbers to verdicts: intervals over data sets, lines with the values that the paper allows, one rule for all.

The rule. A claim is one line or several; each is a number with its interval over data sets and a range that the paper's
words or numbers allow. A line is reproduced where the interval lies wholly inside the range, not reproduced where it
lies wholly outside, and undecided where it holds or touches an end of the range. A claim is not reproduced where one of
its lines is not, reproduced where all are, and undecided otherwise.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

LEVEL = 0.95
"""Confidence of every interval."""


class Verdict(enum.StrEnum):
    """What became of a line or a claim."""

    REPRODUCED = "reproduced"
    UNDECIDED = "undecided"
    NOT_REPRODUCED = "not reproduced"


@dataclass(frozen=True)
class Interval:
    """An estimate over data sets and the ends of its confidence interval."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Interval:
        """Mean of one value per data set, with Student's t; infinitely wide for a single data set."""
        numbers = np.asarray(list(values), float)
        mean = float(numbers.mean())
        if len(numbers) < 2:
            return cls(mean, -np.inf, np.inf)
        half = float(scipy.stats.t.ppf(0.5 + LEVEL / 2, len(numbers) - 1) * scipy.stats.sem(numbers))
        return cls(mean, mean - half, mean + half)

    @classmethod
    def of_ratio(cls, above: Iterable[float], below: Iterable[float]) -> Interval:
        """Geometric mean of above / below, data set by data set, with Student's t of the logarithms.

        ValueError where one of them is not positive.
        """
        ratios = [np.asarray(list(values), float) for values in (above, below)]
        for values in ratios:
            if not (values > 0.0).all():
                raise ValueError(f"a ratio must be of positive values, got {values.tolist()}")
        logs = cls.of(np.log(ratios[0] / ratios[1]))
        return cls(*(float(np.exp(value)) for value in (logs.mean, logs.low, logs.high)))

    @classmethod
    def of_yes(cls, answers: Iterable[bool]) -> Interval:
        """Share of the data sets that say yes, with the exact interval of Clopper and Pearson (1934)."""
        yes = list(answers)
        test = scipy.stats.binomtest(sum(yes), len(yes))
        ends = test.proportion_ci(LEVEL, method="exact")
        return cls(sum(yes) / len(yes), float(ends.low), float(ends.high))


@dataclass(frozen=True)
class Line:
    """One part of a claim under one setting.

    says     what is measured
    paper    the paper's number or words
    ours     the same here
    why      one short sentence that helps to understand the number
    low, high  the range that the paper allows, ends not counted
    percent  whether the numbers are printed in per cent
    """

    says: str
    paper: str
    ours: Interval
    why: str
    low: float = -math.inf
    high: float = math.inf
    percent: bool = False

    @property
    def verdict(self) -> Verdict:
        """By the interval against the range."""
        if self.low < self.ours.low and self.ours.high < self.high:
            return Verdict.REPRODUCED
        if self.ours.high < self.low or self.ours.low > self.high:
            return Verdict.NOT_REPRODUCED
        return Verdict.UNDECIDED

    @property
    def rule(self) -> str:
        """The range in words."""
        if math.isinf(self.high):
            return f"above {self._told(self.low)}{self._unit}"
        if math.isinf(self.low):
            return f"below {self._told(self.high)}{self._unit}"
        return f"{self._told(self.low)} to {self._told(self.high)}{self._unit}"

    @property
    def found(self) -> str:
        """The number and its interval."""
        told = (self._told(value) for value in (self.ours.mean, self.ours.low, self.ours.high))
        return "{} [{}, {}]".format(*told) + self._unit

    @property
    def _unit(self) -> str:
        return " %" if self.percent else ""

    def _told(self, value: float) -> str:
        return f"{100 * value:.3g}" if self.percent else f"{value:.3g}"


def conjunction(lines: Sequence[Line]) -> Verdict:
    """Verdict of a claim: that of its worst line."""
    found = {line.verdict for line in lines}
    return next(verdict for verdict in reversed(Verdict) if verdict in found)


def deciding(lines: Sequence[Line]) -> Line:
    """The first line that has the claim's verdict."""
    verdict = conjunction(lines)
    return next(line for line in lines if line.verdict is verdict)


def by_seed(rows: Iterable[Mapping[str, Any]], value: str, reduce: Any = np.mean) -> dict[str, np.ndarray]:
    """For each variant its values reduced over networks, one number per data set, in the order of their seeds."""
    cells: dict[str, dict[int, list[float]]] = {}
    for row in rows:
        cells.setdefault(row["variant"], {}).setdefault(row["data_seed"], []).append(row[value])
    return {
        variant: np.array([reduce(seeds[seed]) for seed in sorted(seeds)], float) for variant, seeds in cells.items()
    }


def data_sets(rows: Iterable[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """The rows of each data set, in the order of their seeds."""
    cells: dict[int, list[dict[str, Any]]] = {}
    for row in rows:
        cells.setdefault(row["data_seed"], []).append(row)
    return [cells[seed] for seed in sorted(cells)]


def geometric(values: Iterable[np.ndarray]) -> np.ndarray:
    """Geometric mean over variants, data set by data set."""
    return np.exp(np.mean([np.log(value) for value in values], axis=0))
