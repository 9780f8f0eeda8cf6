"""A small data set whose three classes ring at 10, 20 and 30 Hz; no machine is simulated."""

import numpy as np

from classifier.codes import CodeBook
from classifier.dataset import SUBSETS, Dataset

RATE = 200.0
CODES = CodeBook((1, 2, 3), ("rings at 10 Hz", "rings at 20 Hz", "rings at 30 Hz"), ("011", "101", "110"))


def ringing() -> Dataset:
    """24 records of each class, 400 samples each; seed 5."""
    rng = np.random.default_rng(5)
    classes = np.tile(CODES.classes, 24)
    time = np.arange(400) / RATE
    phase, level = rng.uniform(0, 2 * np.pi, (2, len(classes)))
    records = (1 + 0.1 * level[:, None]) * np.sin(2 * np.pi * 10 * classes[:, None] * time + phase[:, None])
    records += 0.3 * rng.standard_normal(records.shape)
    return Dataset(
        records=records.astype(np.float32),
        classes=classes,
        subsets=np.repeat(SUBSETS, 24),
        codes=CODES,
        sample_rate=RATE,
        quantity="table_acceleration",
        unit="rad/s^2",
        provenance={"folder": "made by the tests"},
    )
