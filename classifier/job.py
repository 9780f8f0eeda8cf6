"""A training as its configuration asks for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from classifier.dataset import Dataset
from classifier.feature_choice import FeatureChoice, chosen, make_choice
from classifier.parts import check_kinds
from classifier.train import Result, train
from classifier.trainers import Trainer, make_trainer
from indexer_env.build import from_mapping


@dataclass(frozen=True)
class Net:
    """The keys of conf/net; `Mlp` checks their values."""

    hidden: int
    hidden_function: str
    output_function: str
    targets: str


@dataclass(frozen=True)
class Job:
    """A training before its data set is read; the fields are those of `train`."""

    net: Net
    features: FeatureChoice
    trainer: Trainer
    parts: Sequence[str] | None
    seed: int
    restarts: int
    device: str

    @classmethod
    def of(cls, config: Mapping[str, Any]) -> Job:
        """The training of a configuration with these keys. Raises ParameterError for what breaks a rule."""
        return cls(
            net=from_mapping(Net, config["net"], owner="net"),
            features=make_choice(config["features"]),
            trainer=make_trainer(config["trainer"]),
            parts=check_kinds(config["parts"]),
            **{key: config[key] for key in ("seed", "restarts", "device")},
        )

    def train(self, dataset: Dataset, progress: Callable[[int, float], None] | None = None) -> Result:
        """Train on a data set; as `classifier.train.train`."""
        settings = {key: getattr(self, key) for key in ("seed", "restarts", "device", "parts")}
        return train(
            dataset, chosen(self.features, dataset), self.trainer, **asdict(self.net), **settings, progress=progress
        )
