"""Records of machines with a play and a crack of known size, whose features are smooth functions of both."""

import numpy as np
import pyarrow as pa
import pytest

from classifier.codes import CodeBook
from classifier.dataset import SUBSETS, Dataset

CODES = CodeBook((1, 2, 3, 4), ("intact", "backlash", "cracked", "both"), ("00", "01", "10", "11"))


def made(count: int, seed: int, strange: bool = False) -> tuple[Dataset, np.ndarray]:
    """A data set and features (count, 12) of it; `strange` ones have something that no other has."""
    rng = np.random.default_rng(seed)
    backlash = np.where(rng.uniform(size=count) < 0.5, 0.0, rng.uniform(0.05, 0.35, count))
    crack = np.where(rng.uniform(size=count) < 0.5, 0.0, rng.uniform(0.1, 0.6, count))
    machine = rng.normal(0, 0.05, (count, 2))
    hidden = np.column_stack([backlash / 0.35, crack / 0.6, machine, np.full(count, 1.5 * strange)])
    mixing = np.random.default_rng(0).normal(0, 1, (hidden.shape[1], 12))
    features = np.exp(hidden @ mixing + 0.03 * rng.standard_normal((count, 12)))
    classes = 1 + (backlash > 0) + 2 * (crack > 0)
    table = {
        "machine_draw": np.arange(count),
        "fault_backlash": backlash,
        "fault_roller_crack": crack,
        "fault_screw_looseness": np.zeros(count),
    }
    dataset = Dataset(
        records=np.zeros((count, 8), np.float32),
        classes=classes,
        subsets=np.resize(np.repeat(SUBSETS, (6, 2, 2)), count),
        codes=CODES,
        sample_rate=100.0,
        quantity="table_acceleration",
        unit="rad/s^2",
        provenance={},
        table=pa.table(table),
    )
    return dataset, features


@pytest.fixture(scope="session")
def known():
    return made(1000, 5)


@pytest.fixture(scope="session")
def strange():
    return made(200, 9, strange=True)[1]
