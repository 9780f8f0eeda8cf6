"""What a table counts: each record's true faults, what was named, and whether it was right."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from indexer_experiments.tables import grouped, table


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


COUNTS = (
    "misnamed", "misnamed above", "healthy called faulty", "healthy named", "intervals hold", "alone", "beside others",
    "detected at the stated size", "left out refused",
)  # fmt: skip
"""What is counted; see `flags`."""

SHOWN = {
    "misnamed": "misnamed", "misnamed above": "misnamed above the size",
    "healthy called faulty": "healthy called faulty", "intervals hold": "intervals hold",
    "detected at the stated size": "alarm at the stated size", "left out refused": "unknown refused",
}  # fmt: skip
"""Columns of a table, with their headings."""


def flags(rows: Sequence[Judged]) -> dict[str, list[bool]]:
    """What is counted in each column, record by record; of intervals, fault by fault. A healthy record is called faulty
    by the verdict, which no fault below its smallest stated size makes, and named where any fault is told."""
    known = [row for row in rows if not row.left_out and row.at_size is None]
    return {
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


def summary(rows: Sequence[Judged]) -> dict[str, float | None]:
    """Shares over records; None where there is no record to count."""
    return {name: float(np.mean(given)) if given else None for name, given in flags(rows).items()}


def markdown(rows: Mapping[tuple[str, str], Sequence[Sequence[Judged]]]) -> str:
    """A table with a line for each method and kind of machine: of each column the share in per cent over all records of
    its machines, its 95 % interval and the counts; the last one is the processor time of a record, median and 95 %."""
    body = []
    for (method, kind), machines in rows.items():
        found = [flags(given) for given in machines]
        cells = [_share([one[column] for one in found]) for column in SHOWN]
        spent = [row.cpu for given in machines for row in given if row.cpu]
        cells.append("{:.3g}, {:.3g}".format(*np.quantile(spent, (0.5, 0.95))) if spent else "–")
        body.append([method, kind, str(len(machines)), *cells])
    return table(["method", "machine", "machines", *SHOWN.values(), "processor time, s"], body)


def _share(machines: Sequence[Sequence[bool]]) -> str:
    """ "8.1 (4.3–11.5), 48 of 592" of what is counted machine by machine."""
    whole = [flag for given in machines for flag in given]
    if not whole:
        return "–"
    low, high = grouped(machines)
    return f"{100.0 * np.mean(whole):.1f} ({100.0 * low:.1f}–{100.0 * high:.1f}), {sum(whole)} of {len(whole)}"
