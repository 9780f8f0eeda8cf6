"""What a part needs of a data set, and how it says that this is not there."""

from __future__ import annotations

import numpy as np

from classifier.dataset import Dataset
from indexer_env.errors import IndexerError


class NotAvailable(IndexerError, ValueError):
    """A part cannot be had from a data set; the text says what it needs and what there is, without a full stop."""


def need(what: str, least: int, got: int) -> None:
    """Raise NotAvailable where there are fewer of something than a part needs at least."""
    if got < least:
        raise NotAvailable(f"{got} {what}, {least} needed")


def independent(dataset: Dataset, rows: np.ndarray) -> np.ndarray:
    """Labels (k,) of the k rows of a mask (n,), alike where records hang together: those of one file, or of one
    machine with the same class and faults.

    Turns of one file are nearly equal, so that many of them promise no more than one. Where the data set states no
    machine each record stands for itself.
    """
    if "machine_draw" not in dataset.table.column_names:
        return np.flatnonzero(rows)
    faults = [name for name in dataset.table.column_names if name.startswith("fault_")]
    stated = [dataset.table.column(name).to_numpy() for name in ("machine_draw", *faults)]
    columns = [np.nan_to_num(np.asarray(column, dtype=np.float64), nan=-1.0) for column in stated]
    return np.unique(np.column_stack([dataset.classes, *columns])[rows], axis=0, return_inverse=True)[1].ravel()


def count_independent(dataset: Dataset, *subsets: str) -> int:
    """How many independent records some subsets hold."""
    return len(np.unique(independent(dataset, np.isin(dataset.subsets, subsets))))
