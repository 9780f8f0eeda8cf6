"""A small setting of the study, and rows with a known answer."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from datagen.recipes import Recipe
from indexer_experiments.recipes import Labelled
from indexer_experiments.study.settings import Training


@pytest.fixture(scope="session")
def small(table2: Recipe) -> Training:
    return Training("small", "small data", table2)


@pytest.fixture(scope="session")
def labelled(dataset) -> Labelled:
    """The package's ringing records as the study takes them."""
    subsets = {name: dataset.rows(name) for name in ("calibration", "control", "validation")}
    return Labelled(dataset.records, dataset.codes.targets(dataset.classes), subsets, dataset.sample_rate)


@pytest.fixture(scope="session")
def trials() -> Callable[..., list[dict[str, Any]]]:
    """Rows of three data sets with four networks for each variant, whose performances spread by a few per cent around
    the level given for it; seed 0."""

    def make(levels: Mapping[str, float], spread: float = 0.03, **more: Any) -> list[dict[str, Any]]:
        rng = np.random.default_rng(0)
        rows = []
        for x, (variant, level) in enumerate(levels.items()):
            for seed in range(3):
                for network in range(4):
                    performance = float(level * np.exp(spread * rng.standard_normal()))
                    rows.append(
                        {
                            "setting": "paper",
                            "data_seed": seed,
                            "variant": variant,
                            "x": float(x),
                            "network": network,
                            "performance": performance,
                            "performance_of_targets": performance,
                            "control_misclassified": performance,
                            "seconds": 0.01,
                            **more,
                        }
                    )
        return rows

    return make
