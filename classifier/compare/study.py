"""What a study of the comparison is, and what one seed of it is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from classifier.compare.methods import METHODS, Method
from classifier.compare.recipes import Recipe, make
from classifier.compare.results import Row
from classifier.dataset import Dataset, load_dataset


@dataclass(frozen=True)
class Setting:
    """One seed of a study.

    seed     of data and training
    records  machines in the larger data sets
    folder   where data sets are kept
    methods  names in METHODS
    """

    seed: int
    records: int
    folder: Path
    methods: tuple[str, ...]

    def folder_of(self, recipe: Recipe) -> Path:
        """The data set of a recipe, made where it is not there yet."""
        return make(recipe, self.seed, self.folder)

    def dataset(self, recipe: Recipe) -> Dataset:
        """The same, read."""
        return load_dataset(self.folder_of(recipe))

    def chosen(self) -> dict[str, Method]:
        """The methods by name."""
        return {name: METHODS[name] for name in self.methods}


@dataclass(frozen=True)
class Study:
    """One comparison.

    question  what it answers, in one line
    run       the rows of one seed
    metrics   columns of its table with their decimals, names as in the rows
    draw      pictures by file name, from the rows of all seeds
    """

    question: str
    run: Callable[[Setting], list[Row]]
    metrics: Sequence[tuple[str, int]]
    draw: Callable[[Sequence[Row]], dict[str, Figure]]
