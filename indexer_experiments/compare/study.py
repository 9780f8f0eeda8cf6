"""What a study of the comparison is, and what one seed of it is given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from classifier.dataset import Dataset, load_dataset
from classifier.results import Row
from datagen.recipes import Recipe, make
from datagen.shard import Records, read_shards

_APART = 1000
"""Seeds of a study stay below, so that no seed is used twice."""


@dataclass(frozen=True)
class Setting:
    """One seed of a study.

    seed     of data and training
    records  machines in the larger data sets
    folder   where data sets are kept
    methods  names of some of the study's methods
    """

    seed: int
    records: int
    folder: Path
    methods: tuple[str, ...]

    def dataset(self, recipe: Recipe) -> Dataset:
        """The data set of a recipe, made where it is not there yet."""
        return load_dataset(make(recipe, self.seed, self.folder))

    def apart(self, recipe: Recipe) -> Records:
        """Records of a recipe whose machines are drawn apart from those of `dataset`, to judge what learnt there."""
        return read_shards(make(recipe, self.seed + _APART, self.folder))


@dataclass(frozen=True)
class Study:
    """One comparison.

    question  what it answers, in one line
    methods   what it compares, by name
    run       the rows of one seed
    metrics   columns of its table with their decimals, names as in the rows
    pictures  by file name: figures from the rows of all seeds
    beside    a metric, the lower the better, and the method that all others are compared with seed by seed; None: no
              such table
    own       whether methods of a user's own may join, as FILE.py:NAME
    sized     whether it makes data sets of as many records as it is told
    """

    question: str
    methods: tuple[str, ...]
    run: Callable[[Setting], list[Row]]
    metrics: Sequence[tuple[str, int]]
    pictures: Mapping[str, Callable[[Sequence[Row]], Figure]]
    beside: tuple[str, str] | None = None
    own: bool = False
    sized: bool = True
