"""Training rules, one file each; `base` holds the loop they share.

    traingdx   gradient descent with momentum and variable learning rate (the paper's choice)

TRAINERS finds a rule by its name; `make_trainer` makes one from a plain mapping, as in conf/trainer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from classifier.trainers.base import Examples, Trainer, Training
from classifier.trainers.traingdx import TrainGdx
from indexer_env.build import from_mapping
from indexer_env.checks import check_choice

__all__ = ["TRAINERS", "Examples", "TrainGdx", "Trainer", "Training", "make_trainer"]

TRAINERS: dict[str, type[Trainer]] = {TrainGdx.kind: TrainGdx}


def make_trainer(mapping: Mapping[str, Any]) -> Trainer:
    """Training rule from a plain mapping ``{"kind": ..., parameters}``. Raises ParameterError."""
    parameters = dict(mapping)
    kind = parameters.pop("kind", None)
    check_choice("trainer", "kind", kind, tuple(TRAINERS))
    return from_mapping(TRAINERS[kind], parameters, owner="trainer")
