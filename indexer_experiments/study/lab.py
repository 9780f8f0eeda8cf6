"""Where claims are worked on: size, seeds and folder, the data sets made so far and the trainings on them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from classifier.features import Psd
from classifier.trainers import TRAINERS
from datagen.recipes import Recipe, make
from indexer_env.checks import check_integer
from indexer_experiments.recipes import Labelled, labelled_by_code
from indexer_experiments.study.settings import Setting, Training
from indexer_experiments.study.trials import Trained, Variant, train

_APART = 2**32
"""Beyond every seed of a study, which stay below 2³¹ + its data sets."""


@dataclass(frozen=True)
class Size:
    """How much is done; conf/size.

    data_sets  of each kind, over which intervals are taken
    trainings  networks of each variant on each data set; ten times as many for fig. 5
    others     the same under the settings that only show what a verdict hangs on; 0: these are left out
    epochs     most epochs of a training

    Raises ParameterError.
    """

    data_sets: int
    trainings: int
    others: int
    epochs: int

    def __post_init__(self) -> None:
        check_integer("size", "data_sets", self.data_sets, low=2)
        check_integer("size", "others", self.others, low=0)
        for name in ("trainings", "epochs"):
            check_integer("size", name, getattr(self, name), low=1)


@dataclass(frozen=True)
class Lab:
    """A study's size, first data seed and folder."""

    size: Size
    seed: int
    folder: Path

    @property
    def seeds(self) -> range:
        """Seeds of the data sets, and of the random starts on each."""
        return range(self.seed, self.seed + self.size.data_sets)

    def for_others(self) -> Lab:
        """The same with the trainings of the other settings."""
        return dataclasses.replace(self, size=dataclasses.replace(self.size, trainings=self.size.others))

    def place(self, recipe: Recipe, seed: int) -> Path:
        """Folder of a data set, made now if it is not there."""
        return make(recipe, seed, self.folder / "data")

    def place_apart(self, recipe: Recipe, seed: int) -> Path:
        """As `place`, of machines drawn apart from those of every `place`.

        Item k has the same draws in all recipes of one seed, so that another recipe alone would not do.
        """
        return make(recipe, seed + _APART, self.folder / "data")

    def psd(self, setting: Training, resolution_hz: float = Psd.resolution_hz) -> Psd:
        """Power spectral density on the setting's scale."""
        return Psd(resolution_hz=resolution_hz, scale=setting.scale)

    def variant(
        self, setting: Training, label: str, x: float = 0.0, *, rule: str = "traingdx", **choices: Any
    ) -> Variant:
        """A variant with the setting's features and the training's limits, unless chosen otherwise."""
        trainer = TRAINERS[rule](epochs=self.size.epochs, patience=setting.patience)
        return Variant(
            label, x, **{"features": self.psd(setting), "trainer": trainer, "scaled": setting.scaled, **choices}
        )

    def trials(self, setting: Training, variants: Sequence[Variant], times: int = 1) -> list[dict[str, Any]]:
        """Every variant on every data set of the setting, `times` the usual trainings: one row per network."""
        rows: list[dict[str, Any]] = []
        for seed in self.seeds:
            data = labelled_by_code(self.place(setting.recipe, seed))
            for variant in variants:
                rows += self.told(setting, seed, self.train(data, variant, seed, times).rows())
        return rows

    def train(self, data: Labelled, variant: Variant, seed: int, times: int = 1) -> Trained:
        """Networks of one variant on one data set."""
        return train(data, variant, times * self.size.trainings, seed)

    @staticmethod
    def told(setting: Setting, seed: int, rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
        """Rows that say under which setting and on which data set."""
        return [{"setting": setting.key, "data_seed": seed, **row} for row in rows]
