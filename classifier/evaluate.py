"""How good a network is: the two readings of the paper's "percentage error", and the confusion matrix."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from classifier.codes import CodeBook


@dataclass(frozen=True)
class Score:
    """Errors of one network on one subset.

    The paper gives "0.3 %" without saying of what (§4.3), so both readings stand here:

    mse_percent            100 · mean over records and outputs of (output − target)²  [%]
    misclassified_percent  100 · share of records whose nearest code is not their own  [%]
    records                number of records
    confusion              confusion[true][named]: counts, classes in the order of the code book
    """

    mse_percent: float
    misclassified_percent: float
    records: int
    confusion: tuple[tuple[int, ...], ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON and YAML."""
        return {**asdict(self), "confusion": [list(row) for row in self.confusion]}


def score(codes: CodeBook, outputs: np.ndarray, classes: np.ndarray) -> Score:
    """Score of outputs (n, bits) for records of classes (n,)."""
    true, named = codes.positions(classes), codes.decode(outputs)
    confusion = np.zeros((len(codes.classes),) * 2, dtype=int)
    np.add.at(confusion, (true, named), 1)
    return Score(
        mse_percent=float(100 * np.mean((outputs - codes.targets(classes)) ** 2)),
        misclassified_percent=float(100 * np.mean(true != named)),
        records=len(classes),
        confusion=tuple(tuple(int(count) for count in row) for row in confusion),
    )
