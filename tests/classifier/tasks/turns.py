"""Machines with several turns each, made of records that are one of a machine."""

from dataclasses import replace

import numpy as np

from classifier.dataset import Dataset


def turned(dataset: Dataset, features: np.ndarray, rows: np.ndarray, seed: int) -> tuple[Dataset, np.ndarray]:
    """The data set of these rows, in which one that is there k times is a machine with k turns, alike but for 1 % of
    noise in the features."""
    parts = {name: getattr(dataset, name)[rows] for name in ("records", "classes", "subsets")}
    noise = 0.01 * np.random.default_rng(seed).standard_normal((len(rows), features.shape[1]))
    return replace(dataset, table=dataset.table.take(rows), **parts), features[rows] * np.exp(noise)
