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
    true, named : frozenset of str
        Faults that are there, and that are named.
    refused : bool
        Whether the method said unknown or not comparable.
    above : bool
        Whether every fault is above its stated smallest size.
    held : tuple of bool
        For each fault rightly named: whether its interval holds its size.
    left_out : bool
        Whether the fault is in no table.
    """

    true: frozenset[str]
    named: frozenset[str]
    refused: bool
    above: bool
    held: tuple[bool, ...] = ()
    left_out: bool = False

    @property
    def wrong(self) -> bool:
        """Misnamed: other faults than those that are there, or none said where there are some."""
        return self.refused or self.true != self.named


def summary(rows: Sequence[Judged]) -> dict[str, Any]:
    """Shares over records; None where there is no record to count."""
    known = [row for row in rows if not row.left_out]
    above = [row for row in known if row.above and row.true]
    healthy = [row for row in known if not row.true]
    strangers = [row for row in rows if row.left_out]
    held = [one for row in known for one in row.held]
    return {
        "records": len(rows),
        "misnamed": share([row.wrong for row in known]),
        "misnamed above": share([row.wrong for row in above]),
        "healthy called faulty": share([bool(row.named) or row.refused for row in healthy]),
        "intervals hold": share(held),
        "left out refused": share([row.refused for row in strangers]),
    }


def share(flags: Sequence[bool]) -> float | None:
    """Share of true ones."""
    return float(np.mean(flags)) if len(flags) else None


def markdown(rows: dict[tuple[str, str], list[dict[str, Any]]]) -> str:
    """A table with a line for each method and kind of machine: mean and range over machines, in per cent."""
    columns = ["misnamed", "misnamed above", "healthy called faulty", "intervals hold", "left out refused"]
    lines = ["| method | machine | machines | " + " | ".join(columns) + " |", "|---|---|---|" + "---|" * len(columns)]
    for (method, kind), machines in rows.items():
        cells = []
        for column in columns:
            values = [100.0 * one[column] for one in machines if one[column] is not None]
            cells.append(f"{np.mean(values):.1f} ({min(values):.1f}–{max(values):.1f})" if values else "–")
        lines.append(f"| {method} | {kind} | {len(machines)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
