"""Null, range and choice of every column, row by row."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from datagen.audit.words import Faults, rows_at_fault
from datagen.campaign import SUBSETS
from datagen.schema import COLUMNS, SCHEMA_VERSION

KINDS = ("simulated", "measured")
UNITS = ("rad/s^2", "m/s^2")


@dataclass(frozen=True)
class Range:
    """Bounds of a column; the others follow from building the row's objects (`datagen.audit.rebuild`)."""

    low: float
    high: float = math.inf
    low_open: bool = False

    def __str__(self) -> str:
        if self.high < math.inf:
            return f"{'above' if self.low_open else 'from'} {self.low:g} to {self.high:g}"
        return f"{'>' if self.low_open else '>='} {self.low:g}"

    def broken(self, values: np.ndarray) -> np.ndarray:
        """Which of the values lie outside; NaN, which stands for null, does not."""
        return (values < self.low) | (values > self.high) | (self.low_open & (values == self.low))


RANGES = {
    "sample_rate": Range(0.0, low_open=True),
    "class": Range(1),
    "machine_draw": Range(0),
    "remaining_turns": Range(0),
    "clipped_share": Range(0.0, 1.0),
    "constant_share": Range(0.0, 1.0),
    "fault_roller_crack": Range(0.0, 1.0),
    "fault_cracked_station": Range(0),
    "fault_screw_looseness": Range(0.0),
    "fault_backlash": Range(0.0),
    "seed": Range(0),
    "item": Range(0),
    "source_rate": Range(0.0, low_open=True),
    "source_duration": Range(0.0, low_open=True),
    "warmup_turns": Range(0),
    "warmup_difference": Range(0.0),
    "schema_version": Range(SCHEMA_VERSION, SCHEMA_VERSION),
}

CHOICES = {"subset": SUBSETS, "kind": KINDS, "unit": UNITS}

_JSON: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "effects": (
        "a JSON list of mappings with a name",
        lambda value: isinstance(value, list) and all(isinstance(one, dict) and "name" in one for one in value),
    ),
    "motion_law_parameters": ("a JSON mapping", lambda value: isinstance(value, dict)),
    "groups": ("a JSON mapping", lambda value: isinstance(value, dict)),
}

_PATTERNS = {
    "code": ("characters 0 and 1", r"^[01]+$"),
    "source_sha256": ("64 hexadecimal digits", r"^[0-9a-f]{64}$"),
    "source": ("a file's path below the folder that was read", r"^[^/]"),
}


def value_faults(owner: str, table: pa.Table, items: np.ndarray) -> Faults:
    """Faults of the columns of a shard other than its records."""
    yield from _nulls(owner, table, items)
    for name in table.column_names:
        column = table.column(name)
        if pa.types.is_floating(column.type):
            infinite = pc.invert(pc.is_finite(column)).fill_null(False)  # type: ignore[attr-defined]
            yield from _said(owner, name, column, items, infinite.to_numpy(), "a finite number")
        if name in RANGES:
            numbers = column.cast(pa.float64(), safe=False).to_numpy()
            yield from _said(owner, name, column, items, RANGES[name].broken(numbers), str(RANGES[name]))
        if name in CHOICES:
            known = pc.is_in(column, value_set=pa.array(CHOICES[name])).to_numpy()  # type: ignore[attr-defined]
            wrong = ~known & column.is_valid().to_numpy()
            yield from _said(owner, name, column, items, wrong, "one of " + ", ".join(CHOICES[name]))
        if name in _PATTERNS:
            rule, pattern = _PATTERNS[name]
            matches = pc.match_substring_regex(column, pattern).fill_null(True).to_numpy()  # type: ignore[attr-defined]
            yield from _said(owner, name, column, items, ~matches, rule)
        elif pa.types.is_string(column.type):
            empty = pc.equal(pc.utf8_length(column), 0).fill_null(False).to_numpy()  # type: ignore[attr-defined]
            yield from _said(owner, name, column, items, empty, "a text that is not empty")
        if name in _JSON:
            yield from _json(owner, name, column, items)


def _nulls(owner: str, table: pa.Table, items: np.ndarray) -> Faults:
    kinds = np.array(table.column("kind").to_pylist())
    for kind in KINDS:
        of_kind = kinds == kind
        for name in table.column_names:
            null = table.column(name).is_null().to_numpy() & of_kind
            if not COLUMNS[name].may_be_null(kind):
                yield from rows_at_fault(owner, items, null, f"{name} of a {kind} row must be given", lambda _: None)
            elif kind == "simulated" and COLUMNS[name].of == "measured":
                given = of_kind & ~null
                rule = f"{name} of a simulated row must be null"
                yield from rows_at_fault(owner, items, given, rule, lambda at, name=name: table[name][at].as_py())


def _json(owner: str, name: str, column: pa.ChunkedArray, items: np.ndarray) -> Faults:
    rule, holds = _JSON[name]
    # Most rows share their text, so each different one is read once.
    encoded = pc.dictionary_encode(column.combine_chunks(), null_encoding="encode")  # type: ignore[attr-defined]
    wrong = np.array([text is not None and not _loads(text, holds) for text in encoded.dictionary.to_pylist()])
    yield from _said(owner, name, column, items, wrong[encoded.indices.to_numpy()], rule)


def _loads(text: str, holds: Callable[[Any], bool]) -> bool:
    try:
        return holds(json.loads(text))
    except json.JSONDecodeError:
        return False


def _said(owner: str, name: str, column: pa.ChunkedArray, items: np.ndarray, wrong: np.ndarray, rule: str) -> Faults:
    yield from rows_at_fault(owner, items, wrong, f"{name} must be {rule}", lambda at: column[at].as_py())
