"""As many records of three tones as trees and convolutions need."""

import numpy as np
import pytest

from classifier.dataset import SUBSETS, Dataset


@pytest.fixture(scope="session")
def tones(dataset: Dataset) -> Dataset:
    rng = np.random.default_rng(6)
    classes = np.tile(dataset.codes.classes, 80)
    time = np.arange(400) / dataset.sample_rate
    phase = rng.uniform(0, 2 * np.pi, (len(classes), 1))
    records = np.sin(2 * np.pi * 10 * classes[:, None] * time + phase) + 0.3 * rng.standard_normal((len(classes), 400))
    return Dataset(
        records=records.astype(np.float32),
        classes=classes,
        subsets=np.repeat(SUBSETS, (120, 60, 60)),
        codes=dataset.codes,
        sample_rate=dataset.sample_rate,
        quantity=dataset.quantity,
        unit=dataset.unit,
        provenance={"folder": "made by the tests"},
    )
