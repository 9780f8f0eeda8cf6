"""A sample of rows made again, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from datagen.audit.words import Faults
from datagen.remake import differences, other_versions, remake_all
from indexer_env.device import gpu_name
from indexer_env.errors import IndexerError


class Again:
    """Takes a random sample of the rows that pass; `faults` makes them again."""

    def __init__(self, records: int, wanted: int, seed: int) -> None:
        places = np.random.default_rng(seed).choice(records, min(wanted, records), replace=False)
        self._places = {int(place) for place in places}
        self._rows: list[tuple[str, dict[str, Any]]] = []
        self._passed = 0
        self.remade = 0
        self.notes: list[str] = []

    def take(self, owner: str, table: pa.Table) -> None:
        """Keep the rows of the sample among the next rows of the data set."""
        for at in range(len(table)):
            if self._passed + at in self._places:
                self._rows += [(owner, row) for row in table.slice(at, 1).to_pylist() if row["kind"] == "simulated"]
        self._passed += len(table)

    def faults(self) -> Faults:
        """Faults of the rows that are not what their columns make; those of other versions, or of a GPU that is not
        here, are noted and not judged."""
        here = gpu_name() if any(row["device"] for _, row in self._rows) else None
        for owner, row in self._rows:
            where = f"{owner}, item {row['item']}"
            if versions := other_versions(row):
                self.notes.append(f"{where}: not made again, as other versions made it: {versions}.")
                continue
            if row["device"] not in (None, here):
                self.notes.append(f"{where}: not made again, as {row['device']} made it, which is not here.")
                continue
            try:
                found = differences(remake_all(row), row)
            except (IndexerError, AssertionError, KeyError, TypeError, ValueError) as error:
                found = f"none ({error})"
            self.remade += 1
            if found:
                yield f"{where}: its record must be what its columns make, got {found}."
