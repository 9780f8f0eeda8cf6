"""What must agree between the rows of a data set: items, classes, codes, subsets, counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from datagen.audit.words import Faults, rows_at_fault
from datagen.campaign import SUBSETS
from indexer_records.channels import channels_of

_CODES = {name: code for code, name in enumerate(SUBSETS)}


class Together:
    """Facts gathered row group by row group; `faults` judges them at the end. A row takes 24 bytes."""

    def __init__(self, manifest: Mapping[str, Any]) -> None:
        self._manifest = manifest
        self._classes: dict[tuple[int, str, str], tuple[str, int]] = {}
        self._tallies = {"classes": Counter[str](), "subsets": Counter[str]()}
        self._unsettled = 0
        self._channels = 0
        self._unit = ""
        self._last_item = -1
        self._items: list[np.ndarray] = []
        self._draws: list[np.ndarray] = []

    def add(self, owner: str, table: pa.Table, items: np.ndarray) -> Faults:
        """Take in the next rows; gives the faults that show at once."""
        yield from self._common(owner, table, items)
        yield from self._same_channels(owner, table, items)
        yield from self._same_unit(owner, table, items)
        before = np.concatenate(([self._last_item], items[:-1]))
        rule = "item must be above that of the row before"
        yield from rows_at_fault(owner, items, items <= before, rule, lambda at: int(items[at]))
        yield from self._kinds_of_class(owner, table, items)
        self._last_item = int(items[-1]) if len(items) else self._last_item
        self._items.append(items)
        subsets = table.column("subset").to_pylist()
        codes = np.array([_CODES.get(name, -1) for name in subsets])
        pairs = np.stack([table.column("machine_draw").to_numpy(), codes], axis=1)
        self._draws.append(np.unique(pairs, axis=0))
        self._tallies["classes"].update(table.column("class_name").to_pylist())
        self._tallies["subsets"].update(subsets)
        self._unsettled += table.column("warmup_settled").to_pylist().count(False)

    def _common(self, owner: str, table: pa.Table, items: np.ndarray) -> Faults:
        """Columns that repeat what the manifest says of the whole."""
        versions = {f"{name}_version": value for name, value in self._manifest["versions"].items()}
        told = {"campaign": self._manifest["campaign"], "seed": self._manifest["seed"], **versions}
        for name, expected in told.items():
            if name in table.column_names:
                column = table.column(name)
                wrong = np.array([value not in (expected, None) for value in column.to_pylist()], dtype=bool)
                rule = f"{name} must be {expected}, as the manifest says"
                yield from rows_at_fault(owner, items, wrong, rule, lambda at, column=column: column[at].as_py())

    def _same_channels(self, owner: str, table: pa.Table, items: np.ndarray) -> Faults:
        """All records have as many channels as the first."""
        counts = np.array([len(channels_of(text)) for text in table.column("source_channel").to_pylist()], dtype=int)
        self._channels = self._channels or (int(counts[0]) if len(counts) else 0)
        rule = f"source_channel must name {self._channels} as that of the first row"
        wrong = counts != self._channels
        yield from rows_at_fault(owner, items, wrong, rule, lambda at: table["source_channel"][at].as_py())

    def _same_unit(self, owner: str, table: pa.Table, items: np.ndarray) -> Faults:
        """All records are in the unit of the first."""
        units = table.column("unit").to_pylist()
        self._unit = self._unit or (units[0] if units else "")
        wrong = np.array([unit != self._unit for unit in units], dtype=bool)
        rule = f"unit must be {self._unit} as that of the first row"
        yield from rows_at_fault(owner, items, wrong, rule, lambda at: units[at])

    def _kinds_of_class(self, owner: str, table: pa.Table, items: np.ndarray) -> Faults:
        """One name and one code for each class; what is new is kept with the place where it was seen first."""
        columns = ("class", "class_name", "code")
        seen = table.select(columns).group_by(list(columns), use_threads=False).aggregate([([], "count_all")])
        for row in seen.to_pylist():
            key = (row["class"], row["class_name"], row["code"])
            if key in self._classes:
                continue
            mask = np.ones(len(items), dtype=bool)
            for name in columns:
                mask &= pc.equal(table.column(name), row[name]).to_numpy()  # type: ignore[attr-defined]
            item = int(items[np.argmax(mask)])
            for (number, name, code), (first_owner, first_item) in self._classes.items():
                first = f"{name!r} with code {code} in {first_owner}, item {first_item}"
                if number == row["class"]:
                    yield f"{owner}, item {item}: class {number} must be {first}, got {key[1]!r} with code {key[2]}."
                elif code == row["code"]:
                    yield f"{owner}, item {item}: code {code} must be of one class, got {key[0]} and {number}."
                elif len(code) != len(row["code"]):
                    yield f"{owner}, item {item}: code must be as long as that of {first}, got {row['code']!r}."
                else:
                    continue
                break
            self._classes[key] = (owner, item)

    def faults(self, rejected: pa.Table) -> Faults:
        """Faults of the data set as a whole, its rejected items included."""
        yield from self._split()
        yield from self._complete(rejected.column("item").to_numpy())
        counts = {
            "records": sum(map(len, self._items)),
            "rejected": len(rejected),
            "not_settled": self._unsettled,
        }
        for name, found in counts.items():
            # Measured data sets have no warm-up and need not count it.
            if (told := self._manifest.get(name, 0)) != found:
                yield f"manifest.json: {name} must be {found}, as the files hold, got {told}."
        for name, tally in self._tallies.items():
            listed = {key: count for key, count in self._manifest[name].items() if count}
            if listed != dict(tally):
                key = min(key for key in set(listed) | set(tally) if listed.get(key) != tally.get(key))
                rule = f"{name} must count {tally[key]} of {key!r}, as the files hold"
                yield f"manifest.json: {rule}, got {listed.get(key, 0)}."

    def _split(self) -> Faults:
        pairs = np.unique(np.concatenate([np.empty((0, 2), dtype=np.int64), *self._draws]), axis=0)
        draws, counts = np.unique(pairs[:, 0], return_counts=True)
        shared = draws[counts > 1]
        if len(shared):
            subsets = [SUBSETS[code] if code >= 0 else "another" for code in pairs[pairs[:, 0] == shared[0], 1]]
            more = f", as have {len(shared) - 1} more" if len(shared) > 1 else ""
            yield f"data: machine draw {shared[0]} must be in one subset, got {' and '.join(subsets)}{more}."

    def _complete(self, rejected: np.ndarray) -> Faults:
        items = np.concatenate([np.empty(0, dtype=np.int64), *self._items])
        if len(both := np.intersect1d(items, rejected)):
            yield f"rejected.parquet, item {both[0]}: an item must be a record or rejected, got both."
        count = self._manifest["count"]
        have = np.union1d(items, rejected)
        if len(strange := have[(have < 0) | (have >= count)]):
            yield f"data, item {strange[0]}: item must be from 0 to {count - 1}, as the manifest counts, got another."
        elif len(have) < count:
            missing = np.setdiff1d(np.arange(count), have)
            yield f"data, item {missing[0]}: an item must be a record or rejected, got neither for {len(missing)}."
