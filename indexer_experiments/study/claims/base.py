"""What every claim offers; a claim is one file, listed in `indexer_experiments.study.claims.CLAIMS`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from matplotlib.axes import Axes

from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import Setting
from indexer_experiments.study.verdicts import Line

Rows = list[dict[str, Any]]
"""A results table: rows of plain values under the same keys."""


class Claim(ABC):
    """One claim of the paper.

    key       its name on the command line and its folder
    where     figure or section of the paper
    title     a few words
    says      the claim in our own words
    choices   what the paper leaves open or misprints, and what is done here
    settings  the first one gives the verdict, the others show what it hangs on
    panels    axes that its picture has
    """

    key: ClassVar[str]
    where: ClassVar[str]
    title: ClassVar[str]
    says: ClassVar[str]
    choices: ClassVar[tuple[str, ...]]
    settings: ClassVar[Sequence[Setting]]
    panels: ClassVar[int] = 1

    @abstractmethod
    def collect(self, lab: Lab, setting: Any) -> Rows:
        """Do the work under one of its settings."""

    @abstractmethod
    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """The claim's lines, from the rows of one setting alone."""

    @abstractmethod
    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """The paper's figure, from the rows of one setting."""
