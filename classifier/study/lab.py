"""Where claims are worked on: size, seeds, threads, the data sets made so far and the trainings on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from classifier.features import Psd
from classifier.study.recipes import Labelled, Recipe, labelled_by_code, make
from classifier.study.settings import Setting
from classifier.study.trials import Trained, Variant, train
from classifier.trainers import TRAINERS
from indexer_env.checks import check_integer


@dataclass(frozen=True)
class Size:
    """How much is done; conf/size.

    data_seeds       data sets of each kind, over which intervals are taken
    trainings        networks of each variant on each data set; a tenth of them under the settings that only show
                     what a verdict hangs on
    initialisations  networks of fig. 5 on each data set
    epochs           most epochs of a training
    others           whether those settings are studied at all

    Raises ParameterError.
    """

    data_seeds: int
    trainings: int
    initialisations: int
    epochs: int
    others: bool

    def __post_init__(self) -> None:
        check_integer("size", "data_seeds", self.data_seeds, low=2)
        for name in ("trainings", "initialisations", "epochs"):
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
        return range(self.seed, self.seed + self.size.data_seeds)

    def networks(self, setting: Setting, wanted: int | None = None) -> int:
        """Networks trained for each variant and data set."""
        wanted = self.size.trainings if wanted is None else wanted
        return wanted if setting.main else -(-wanted // 10)

    def place(self, recipe: Recipe, seed: int) -> Path:
        """Folder of a data set, made now if it is not there."""
        return make(recipe, seed, self.folder / "data")

    def psd(self, setting: Setting, resolution_hz: float = Psd.resolution_hz) -> Psd:
        """Power spectral density on the setting's scale."""
        return Psd(resolution_hz=resolution_hz, scale=setting.scale)

    def variant(
        self, setting: Setting, label: str, x: float = 0.0, *, rule: str = "traingdx", **choices: Any
    ) -> Variant:
        """A variant with the setting's features and the training's limits, unless chosen otherwise."""
        trainer = TRAINERS[rule](epochs=self.size.epochs, patience=setting.patience)
        return Variant(
            label, x, **{"features": self.psd(setting), "trainer": trainer, "scaled": setting.scaled, **choices}
        )

    def trials(self, setting: Setting, variants: Sequence[Variant], wanted: int | None = None) -> list[dict[str, Any]]:
        """Every variant on every data set of the setting: one row per network."""
        rows: list[dict[str, Any]] = []
        for seed in self.seeds:
            data = labelled_by_code(self.place(setting.recipe, seed))
            for variant in variants:
                rows += self.told(setting, seed, self.train(data, variant, setting, seed, wanted).rows())
        return rows

    def train(
        self, data: Labelled, variant: Variant, setting: Setting, seed: int, wanted: int | None = None
    ) -> Trained:
        """Networks of one variant on one data set."""
        return train(data, variant, self.networks(setting, wanted), seed)

    @staticmethod
    def told(setting: Setting, seed: int, rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
        """Rows that say under which setting and on which data set."""
        return [{"setting": setting.key, "data_seed": seed, **row} for row in rows]
