"""Scaled features of a data set with the parts that are fitted to them, without training a network."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa

from classifier.codes import CodeBook
from classifier.compare.methods.base import ScaledFeatures
from classifier.dataset import Dataset
from classifier.features import Psd


@dataclass(frozen=True, eq=False)
class Seen:
    """A data set and what a network on PSD features would see of it.

    scaled  (n, count) features of all its records, scaled on the calibration records
    """

    dataset: Dataset
    features: ScaledFeatures
    scaled: np.ndarray

    @classmethod
    def of(cls, dataset: Dataset) -> Seen:
        """Of a data set, with the paper's features."""
        features = ScaledFeatures.fit(Psd(), dataset)
        return cls(dataset, features, features.apply(dataset.records))


def chosen(dataset: Dataset, rows: np.ndarray) -> Dataset:
    """The rows (a mask) of a data set, with the classes that are left.

    Raises SignalError where a subset of them lacks a class.
    """
    classes = dataset.classes[rows]
    places = dataset.codes.positions(classes)
    names, codes = (np.array(column)[places] for column in (dataset.codes.names, dataset.codes.codes))
    return replace(
        dataset,
        records=dataset.records[rows],
        classes=classes,
        subsets=dataset.subsets[rows],
        codes=CodeBook.of_rows(classes, names, codes),
        table=dataset.table.filter(pa.array(rows)) if dataset.table.num_columns else dataset.table,
    )
