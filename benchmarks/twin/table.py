"""What a table counts: each record's true faults, what was named, and whether it was right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


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
        Whether every fault is above its stated smallest size.
    held : tuple of bool
        For each fault rightly named: whether its interval holds its size.
    at_size : bool or None
        Of a record with one fault of the stated smallest size: whether an alarm was raised.
    left_out : bool
        Whether the fault is in no table.
    """

    true: frozenset[str]
    named: frozenset[str]
    large: frozenset[str]
    refused: bool
    above: bool
    held: tuple[bool, ...] = ()
    left_out: bool = False
    at_size: bool | None = None

    @property
    def wrong(self) -> bool:
        """Misnamed: other faults than those that are there, or none said where there are some."""
        return self.refused or self.true != self.named


def summary(rows: Sequence[Judged]) -> dict[str, Any]:
    """Shares over records; None where there is no record to count."""
    sized = [row.at_size for row in rows if row.at_size is not None]
    known = [row for row in rows if not row.left_out and row.at_size is None]
    above = [row for row in known if row.above and row.true]
    healthy = [row for row in known if not row.true]
    strangers = [row for row in rows if row.left_out]
    held = [one for row in known for one in row.held]
    return {
        "records": len(rows),
        "misnamed": share([row.wrong for row in known]),
        "misnamed above": share([row.refused or row.true != row.large for row in above]),
        "healthy called faulty": share([bool(row.named) or row.refused for row in healthy]),
        "intervals hold": share(held),
        "alone": share([one for row in known if len(row.named) == 1 for one in row.held]),
        "beside others": share([one for row in known if len(row.named) > 1 for one in row.held]),
        "detected at the stated size": share(sized),
        "left out refused": share([row.refused for row in strangers]),
    }


def share(flags: Sequence[bool]) -> float | None:
    """Share of true ones."""
    return float(np.mean(flags)) if len(flags) else None


def markdown(rows: dict[tuple[str, str], list[dict[str, Any]]]) -> str:
    """A table with a line for each method and kind of machine: mean and range over machines, in per cent."""
    columns = [
        "misnamed", "misnamed above", "healthy called faulty", "intervals hold", "alone", "beside others",
        "detected at the stated size", "left out refused",
    ]  # fmt: skip
    lines = ["| method | machine | machines | " + " | ".join(columns) + " |", "|---|---|---|" + "---|" * len(columns)]
    for (method, kind), machines in rows.items():
        cells = []
        for column in columns:
            values = [100.0 * one[column] for one in machines if one[column] is not None]
            cells.append(f"{np.mean(values):.1f} ({min(values):.1f}–{max(values):.1f})" if values else "–")
        lines.append(f"| {method} | {kind} | {len(machines)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
