"""What a part needs of a data set, and how it says that this is not there."""

from __future__ import annotations

import json

import numpy as np

from classifier.dataset import Dataset
from indexer_env.errors import IndexerError, SignalError


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

    Raises
    ------
    SignalError
        A column that says what hangs together holds NaN.
    """
    if "machine_draw" not in dataset.table.column_names:
        return np.flatnonzero(rows)
    faults = [name for name in dataset.table.column_names if name.startswith("fault_")]
    columns = [part for name in ("machine_draw", *faults) for part in _stated(dataset, name)]
    return np.unique(np.column_stack([dataset.classes, *columns])[rows], axis=0, return_inverse=True)[1].ravel()


def machines(dataset: Dataset, rows: np.ndarray) -> np.ndarray:
    """Labels (k,) of the machines, or files, of the k rows of a mask (n,). Where the data set states none each record
    stands for itself."""
    if "machine_draw" not in dataset.table.column_names:
        return np.flatnonzero(rows)
    return dataset.table.column("machine_draw").to_numpy()[rows]


def draws_are_machines(dataset: Dataset) -> bool:
    """Whether records of two machine draws are of two machines: of measured ones only where each row states the group
    `machine` and no machine is in two draws, as files of one machine may be."""
    if not dataset.measured:
        return True
    groups = [json.loads(text or "{}") for text in dataset.table.column("groups").to_pylist()]
    draws = dataset.table.column("machine_draw").to_pylist()
    pairs = {(group.get("machine"), draw) for group, draw in zip(groups, draws, strict=True)}
    return all(machine for machine, _ in pairs) and len({machine for machine, _ in pairs}) == len(pairs)


def _stated(dataset: Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Whether a column (n,) states a number, and the number, 0 where it does not."""
    column = dataset.table.column(name)
    numbers = column.fill_null(0).to_numpy().astype(np.float64)
    if np.isnan(numbers).any():
        raise SignalError(f"the data set's column {name} must hold a number or null in each row, got NaN; repair it.")
    return column.is_valid().to_numpy(), numbers


def count_independent(dataset: Dataset, *subsets: str) -> int:
    """How many independent records some subsets hold."""
    return len(np.unique(independent(dataset, np.isin(dataset.subsets, subsets))))
