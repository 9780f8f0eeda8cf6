"""Groups of records: what they were measured with and when, and data sets without one of them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa

from classifier.codes import CodeBook
from classifier.dataset import Dataset
from datagen.schema import COLUMNS, RECORD
from indexer_env.checks import did_you_mean
from indexer_env.errors import ParameterError, SignalError

_GROUPS = "groups"


def groups_of(dataset: Dataset, by: str) -> np.ndarray:
    """The group (n,) of every record, as text: what the labels table of measured records says under `by`, or a column
    of `datagen.schema`.

    Raises ParameterError where there is no such group or column, and SignalError where a record has none.
    """
    named = [json.loads(text) if text else {} for text in dataset.table.column(_GROUPS).to_pylist()]
    known = sorted({name for groups in named for name in groups})
    if by in known:
        values = [groups.get(by) for groups in named]
    elif by in COLUMNS and by not in (RECORD, _GROUPS):
        values = dataset.table.column(by).to_pylist()
    else:
        has = f"groups {', '.join(known)}" if known else "no groups"
        hint = did_you_mean(by, [*known, *COLUMNS]) or f"the data set has {has} and the columns of datagen/DATA.md"
        raise ParameterError(f"leaveout.by must be a group or column of the data set, got {by!r}; {hint}.")
    missing = next((place for place, value in enumerate(values) if value is None), None)
    if missing is not None:
        raise SignalError(f"every record must state its {by}, got none for record {missing}; add it to the labels.")
    return np.array([str(value) for value in values])


def part(dataset: Dataset, rows: np.ndarray) -> Dataset:
    """The rows (a mask) of a data set, with the classes that are left.

    Raises SignalError where a subset of them lacks a class, ParameterError where one class alone is left.
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
