"""What a table counts: each record's true faults, what was named, and whether it was right."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from indexer_experiments import tables


@dataclass(frozen=True)
class Judged:
    """A record of a machine, judged by one method.

    Attributes
    ----------
    true, named, large : frozenset of str
        Faults that are there, that are named, and those of the named that are as large as their smallest stated size.
    refused : bool
        Whether the method said unknown or not comparable.
    above : bool
        Whether every fault is above its stated smallest size; no fault is for which none is stated.
    held : tuple of bool
        For each fault rightly named: whether its interval holds its size.
    at_size : bool or None
        Of a record with one fault of the stated smallest size: whether an alarm was raised.
    left_out : bool
        Whether the fault is in no table.
    sizes : mapping
        Share of the largest of each fault that is there.
    cpu : float
        Processor time [s].
    """

    true: frozenset[str]
    named: frozenset[str]
    large: frozenset[str]
    refused: bool
    above: bool
    held: tuple[bool, ...] = ()
    left_out: bool = False
    at_size: bool | None = None
    sizes: Mapping[str, float] = field(default_factory=dict)
    cpu: float = 0.0

    def plain(self) -> dict[str, Any]:
        """As JSON knows it."""
        return {k: sorted(v) if isinstance(v, frozenset) else v for k, v in dataclasses.asdict(self).items()}

    @classmethod
    def restore(cls, given: Mapping[str, Any]) -> Judged:
        """What gave these values."""
        sets = {name: frozenset(given[name]) for name in ("true", "named", "large")}
        return cls(**{**given, **sets, "held": tuple(given["held"])})

    @property
    def wrong(self) -> bool:
        """Misnamed: other faults than those that are there, or none said where there are some."""
        return self.refused or self.true != self.named


Counts = Mapping[str, Sequence[int]]
"""Of each column: hits, of how many."""

SHOWN = {
    "misnamed": "misnamed", "misnamed above": "misnamed above the size",
    "healthy called faulty": "healthy called faulty", "intervals hold": "intervals hold",
    "detected at the stated size": "alarm at the stated size", "left out refused": "unknown refused",
}  # fmt: skip
"""Columns of a table, of those of `counts`, with their headings."""


def counts(rows: Sequence[Judged]) -> Counts:
    """What is counted in each column, over records; of intervals, over faults. A healthy record is called faulty
    by the verdict, which no fault below its smallest stated size makes, and named where any fault is told."""
    known = [row for row in rows if not row.left_out and row.at_size is None]
    counted = {
        "misnamed": [row.wrong for row in known],
        "misnamed above": [row.refused or row.true != row.large for row in known if row.above and row.true],
        "healthy called faulty": [bool(row.large) or row.refused for row in known if not row.true],
        "healthy named": [bool(row.named) or row.refused for row in known if not row.true],
        "intervals hold": [one for row in known for one in row.held],
        "alone": [one for row in known if len(row.named) == 1 for one in row.held],
        "beside others": [one for row in known if len(row.named) > 1 for one in row.held],
        "detected at the stated size": [row.at_size for row in rows if row.at_size is not None],
        "left out refused": [row.refused for row in rows if row.left_out],
    }
    return {name: (sum(given), len(given)) for name, given in counted.items()}


def markdown(table: Mapping[tuple[str, str], Sequence[Counts]]) -> str:
    """A table with a line for each method and kind of machine: of each column the share in per cent over all records of
    its machines, its 95 % interval and the counts."""
    body = [
        [method, kind, str(len(machines)), *(_share([one[column] for one in machines]) for column in SHOWN)]
        for (method, kind), machines in table.items()
    ]
    return tables.table(["method", "machine", "machines", *SHOWN.values()], body)


def _share(machines: Sequence[Sequence[int]]) -> str:
    """ "8.1 (4.3–11.5), 48 of 592" of what is counted machine by machine."""
    hits, of = (sum(each) for each in zip(*machines, strict=True))
    if not of:
        return "–"
    low, high = tables.grouped([[k < hit for k in range(count)] for hit, count in machines])
    return f"{100.0 * hits / of:.1f} ({100.0 * low:.1f}–{100.0 * high:.1f}), {hits} of {of}"
