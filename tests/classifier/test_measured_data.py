"""A data set of measured files is a data set like any other."""

from __future__ import annotations

import numpy as np
import pytest

from classifier.dataset import load_dataset
from datagen.ingest.publish import ingest
from datagen.ingest.settings import Settings
from datagen.ingest.sources import sources_of


@pytest.fixture
def measured(tmp_path):
    for place, name in enumerate(("intact", "worn")):
        (tmp_path / "files" / name).mkdir(parents=True)
        for number in range(5):
            values = np.random.default_rng([place, number]).normal(size=1000)
            rows = [f"{k / 1000:.3f},{value:.6f}" for k, value in enumerate(values)]
            (tmp_path / "files" / name / f"{number}.csv").write_text("\n".join(["time [s],acc [rad/s^2]", *rows]))
    ingest(sources_of(str(tmp_path / "files"), None), Settings(period=0.5), tmp_path / "set")
    return tmp_path / "set"


def test_the_classifier_loads_it(measured):
    data = load_dataset(measured)
    assert data.records.shape == (20, 500) and data.sample_rate == 1000.0 and data.unit == "rad/s^2"
    assert [data.codes.names, data.codes.codes] == [("intact", "worn"), ("10", "01")]
    assert {name: int((data.subsets == name).sum()) for name in set(data.subsets)} == {
        "calibration": 12,
        "control": 4,
        "validation": 4,
    }
