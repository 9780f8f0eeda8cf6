"""Data sets of experiments, with what a network is to say of their records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa

from datagen.campaign import SUBSETS
from datagen.shard import read_shards


@dataclass(frozen=True, eq=False)
class Labelled:
    """Records with what a network is to say of them.

    records      (n, samples) float32
    targets      (n, bits) in [0, 1]
    subsets      calibration, control and validation: a mask (n,) of the rows of each
    sample_rate  [Hz]
    """

    records: np.ndarray
    targets: np.ndarray
    subsets: Mapping[str, np.ndarray]
    sample_rate: float


def read(folder: Path) -> tuple[np.ndarray, pa.Table, float]:
    """Records, all other columns and the sample rate [Hz] of a data set."""
    data = read_shards(folder)
    return data.records, data.table, float(data.table.column("sample_rate")[0].as_py())


def column(table: pa.Table, name: str) -> np.ndarray:
    """One column (n,)."""
    return np.array(table.column(name).to_pylist())


def labelled_by_code(folder: Path) -> Labelled:
    """Records of a data set with the bits of their classes as targets."""
    records, table, rate = read(folder)
    targets = np.array([[float(bit) for bit in code] for code in column(table, "code")])
    return Labelled(records, targets, masks(table), rate)


def masks(table: pa.Table) -> dict[str, np.ndarray]:
    """The rows (n,) of each subset."""
    subsets = column(table, "subset")
    return {subset: subsets == subset for subset in SUBSETS}
