"""Records that hang together count once; what a data set does not state is not mixed up with what it states wrongly."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from classifier.tasks.need import independent
from indexer_env.errors import SignalError


def stated(dataset, faults):
    """Every third record is of class 1, and all are of one machine."""
    draws = np.zeros(len(dataset.classes), dtype=int)
    return replace(dataset, table=pa.table({"machine_draw": draws, "fault_backlash": pa.array(faults, pa.float64())}))


def test_what_is_not_stated_is_a_group_of_its_own(dataset):
    count = len(dataset.classes)
    first = {0: None, 3: 0.0, 6: -1.0}
    labels = independent(stated(dataset, [first.get(row, 0.5) for row in range(count)]), np.ones(count, dtype=bool))
    assert len({labels[row] for row in (0, 3, 6, 9)}) == 4 and set(labels[9::3]) == {labels[9]}


def test_a_fault_that_is_nan_is_refused(dataset):
    count = len(dataset.classes)
    faults = [float("nan"), *[0.5] * (count - 1)]
    with pytest.raises(SignalError, match="column fault_backlash must hold a number or null in each row, got NaN"):
        independent(stated(dataset, faults), np.ones(count, dtype=bool))
