"""How many turns are left until the machine fails, learnt from machines that were run to failure, with an interval."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from classifier.dataset import Dataset
from classifier.tasks.conformal import least_records
from classifier.tasks.need import machines, need
from classifier.tasks.severity import COVERAGE, Quantity, Severity


@dataclass(frozen=True, eq=False)
class Remaining(Severity):
    """The turns left, by the regression and the intervals of `Severity`.

    Records of one life share their error: a machine that wears faster than most is told too long a life in each of its
    records. So the interval is one for a record of a new life, and each life of the control subset counts as one. It
    is for lives and running conditions as those of the training; a trend of the machine's own severity (`monitor`)
    needs no such lives.
    """

    kind: ClassVar[str] = "remaining"
    quantities: ClassVar[Mapping[str, Quantity]] = {"remaining_turns": Quantity("remaining_turns", 1.0, math.inf)}
    missing: ClassVar[str] = "no turns left until failure that every row states"

    @classmethod
    def check_control(cls, dataset: Dataset, coverage: float) -> None:
        """Raise NotAvailable where the control subset has too few lives for an interval of this coverage."""
        need("lives in the control subset", least_records(coverage), len(np.unique(cls.units_of(dataset))))

    @classmethod
    def units_of(cls, dataset: Dataset, coverage: float = COVERAGE) -> np.ndarray:
        """Lives (k,) of the k control records."""
        return machines(dataset, dataset.rows("control"))
