"""Records that hang together count once; what a data set does not state is not mixed up with what it states wrongly."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from classifier.tasks.need import independent
from indexer_env.errors import SignalError


def stated(dataset, faults):
    count = len(dataset.classes)
    table = pa.table({"machine_draw": np.zeros(count, dtype=int), "fault_backlash": pa.array(faults, pa.float64())})
    return replace(dataset, table=table, classes=np.ones(count, dtype=int))


def test_what_is_not_stated_is_a_group_of_its_own(dataset):
    count = len(dataset.classes)
    faults = [None, 0.0, -1.0, *[0.5] * (count - 3)]
    labels = independent(stated(dataset, faults), np.ones(count, dtype=bool))
    assert len(set(labels[:4])) == 4 and set(labels[3:]) == {labels[3]}


def test_a_fault_that_is_nan_is_refused(dataset):
    count = len(dataset.classes)
    faults = [float("nan"), *[0.5] * (count - 1)]
    with pytest.raises(SignalError, match="column fault_backlash must hold a number or null in each row, got NaN"):
        independent(stated(dataset, faults), np.ones(count, dtype=bool))
