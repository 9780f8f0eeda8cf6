"""How good a network is: the two readings of the paper's "percentage error", confusion, and what else the field
reports.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import rankdata

from classifier.codes import CodeBook

BINS = 10
"""Bins of equal width in which confidences are compared with the share that is right."""


@dataclass(frozen=True)
class Score:
    """Errors of one network on one subset.

    The paper gives "0.3 %" without saying of what (§4.3), so both readings stand here:

    mse_percent            100 · mean over records and outputs of (output − target)²  [%]
    misclassified_percent  100 · share of records whose nearest code is not their own  [%]
    macro_f1               mean over the classes of 2 TP / (2 TP + FP + FN) [-], see `macro_f1`
    auroc                  mean over the bits of the area under the ROC curve of that output [-], see `auroc`
    records                number of records
    confusion              confusion[true][named]: counts, classes in the order of the code book
    """

    mse_percent: float
    misclassified_percent: float
    macro_f1: float
    auroc: float
    records: int
    confusion: tuple[tuple[int, ...], ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON and YAML."""
        return {**asdict(self), "confusion": [list(row) for row in self.confusion]}


def score(codes: CodeBook, outputs: np.ndarray, classes: np.ndarray) -> Score:
    """Score of outputs (n, bits) for records of classes (n,)."""
    true, named = codes.positions(classes), codes.decode(outputs)
    confusion = confusion_of(true, named, len(codes.classes))
    targets = codes.targets(classes)
    return Score(
        mse_percent=float(100 * np.mean((outputs - targets) ** 2)),
        misclassified_percent=float(100 * np.mean(true != named)),
        macro_f1=macro_f1(confusion),
        auroc=mean_auroc(outputs, targets),
        records=len(classes),
        confusion=tuple(tuple(int(count) for count in row) for row in confusion),
    )


def confusion_of(true: np.ndarray, named: np.ndarray, classes: int) -> np.ndarray:
    """Counts (classes, classes) of records by true and named class, both (n,) as positions from 0."""
    confusion = np.zeros((classes, classes), dtype=int)
    np.add.at(confusion, (true, named), 1)
    return confusion


def macro_f1(confusion: np.ndarray) -> float:
    """Mean F1 over the classes that are true or named for a record at all, from counts [true, named].

    F1 = 2 TP / (2 TP + FP + FN): every class counts alike, however rare.
    """
    right, total = np.diag(confusion), confusion.sum(axis=0) + confusion.sum(axis=1)
    return float(np.mean(2 * right[total > 0] / total[total > 0]))


def auroc(scores: np.ndarray, positive: np.ndarray) -> float:
    """Area under the receiver operating characteristic of scores (n,) for a mask (n,) of positive records.

    The probability that a positive record scores higher than a negative one, ties counting half:
    (Σ ranks of the positive − p (p + 1) / 2) / (p (n − p)). NaN where all records are on one side.
    Source: J. A. Hanley, B. J. McNeil, Radiology 143 (1982) 29–36.
    """
    hits = int(positive.sum())
    misses = len(positive) - hits
    if hits == 0 or misses == 0:
        return float("nan")
    return float((rankdata(scores)[positive].sum() - hits * (hits + 1) / 2) / (hits * misses))


def mean_auroc(outputs: np.ndarray, targets: np.ndarray) -> float:
    """Mean over the columns of outputs (n, k) of `auroc` for targets (n, k) of 0 and 1; a column with one kind of
    target alone does not count, and NaN is the mean over none."""
    areas = [auroc(column, target > 0.5) for column, target in zip(outputs.T, targets.T, strict=True)]
    known = [area for area in areas if not np.isnan(area)]
    return float(np.mean(known)) if known else float("nan")


class Reliability(NamedTuple):
    """Confidence beside what it is worth, in bins of equal width.

    confidence  (bins,) mean confidence; NaN in an empty bin
    right       (bins,) share that is right; NaN in an empty bin
    share       (bins,) share of all records
    """

    confidence: np.ndarray
    right: np.ndarray
    share: np.ndarray

    @property
    def error(self) -> float:
        """Expected calibration error: Σ share |right − confidence|.

        Source: M. P. Naeini, G. Cooper, M. Hauskrecht, Proc. AAAI (2015) 2901–2907.
        """
        filled = self.share > 0
        return float(np.sum(self.share[filled] * np.abs(self.right - self.confidence)[filled]))


def reliability(confidence: np.ndarray, right: np.ndarray, bins: int = BINS) -> Reliability:
    """Reliability of confidences (n,) in [0, 1] in names that are right where the mask right (n,) says so."""
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    count = np.bincount(place, minlength=bins)
    with np.errstate(invalid="ignore"):
        means = (np.bincount(place, weights=values, minlength=bins) / count for values in (confidence, right))
        return Reliability(*means, share=count / len(place))
