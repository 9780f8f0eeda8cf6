"""What twin.yaml says of the networks."""

from __future__ import annotations

import numpy as np

from tests.twin.test_judge import turns
from twin.card import scores


def test_with_one_fault_in_the_table_there_is_no_score_of_several():
    part = turns(12, 1, faulty=True)
    told = {"faults": np.where(part.there, 3.0, -3.0)}
    assert scores(told, np.arange(12), part) == {"all": 1.0, "healthy": None, "one": 1.0, "several": None}
