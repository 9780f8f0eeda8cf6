"""From numbers to verdicts: intervals over data seeds, statements with their rules, and what follows from them."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

LEVEL = 0.95
"""Confidence of every interval: Student's t over data seeds."""


class Verdict(enum.StrEnum):
    """What became of a claim."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    FAILS = "does not hold"


@dataclass(frozen=True)
class Interval:
    """A mean over data seeds and the ends of its confidence interval; infinitely wide for a single seed."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Interval:
        """From one value per data seed."""
        numbers = np.asarray(list(values), float)
        mean = float(numbers.mean())
        if len(numbers) < 2:
            return cls(mean, -np.inf, np.inf)
        half = float(scipy.stats.t.ppf(0.5 + LEVEL / 2, len(numbers) - 1) * scipy.stats.sem(numbers))
        return cls(mean, mean - half, mean + half)

    @classmethod
    def of_ratio(cls, above: Iterable[float], below: Iterable[float]) -> Interval:
        """Geometric mean of above / below, data seed by data seed; both positive."""
        logs = cls.of(np.log(np.asarray(list(above)) / np.asarray(list(below))))
        return cls(*(float(np.exp(value)) for value in (logs.mean, logs.low, logs.high)))

    def __str__(self) -> str:
        return f"{self.mean:.3g} [{self.low:.3g}, {self.high:.3g}]"

    def percent(self) -> str:
        """The same in per cent."""
        return f"{100 * self.mean:.1f} % [{100 * self.low:.1f}, {100 * self.high:.1f}]"


@dataclass(frozen=True)
class Statement:
    """One part of a claim under one setting.

    says   the part, in a few words
    rule   when it counts as true
    found  the numbers
    holds  whether the rule is met
    """

    says: str
    rule: str
    found: str
    holds: bool


@dataclass(frozen=True)
class Outcome:
    """All statements of a claim under one setting."""

    setting: str
    statements: tuple[Statement, ...]

    @property
    def verdict(self) -> Verdict:
        """Holds where every statement does, does not hold where none does."""
        held = [statement.holds for statement in self.statements]
        return Verdict.HOLDS if all(held) else Verdict.IN_PART if any(held) else Verdict.FAILS


def overall(verdicts: Sequence[Verdict]) -> Verdict:
    """Verdict of a claim from those under its main settings: theirs where they agree, otherwise in part."""
    return verdicts[0] if len(set(verdicts)) == 1 else Verdict.IN_PART


def by_seed(rows: Iterable[Mapping[str, Any]], value: str, reduce: Any = np.mean) -> dict[str, np.ndarray]:
    """For each variant its values reduced over networks, one number per data seed, seeds in order."""
    cells: dict[str, dict[int, list[float]]] = {}
    for row in rows:
        cells.setdefault(row["variant"], {}).setdefault(row["data_seed"], []).append(row[value])
    return {
        variant: np.array([reduce(seeds[seed]) for seed in sorted(seeds)], float) for variant, seeds in cells.items()
    }


def geometric(values: Iterable[np.ndarray]) -> np.ndarray:
    """Geometric mean over variants, data seed by data seed."""
    return np.exp(np.mean([np.log(value) for value in values], axis=0))
