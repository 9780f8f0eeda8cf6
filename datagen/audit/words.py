"""How a fault is said: which file, which item, the rule, the value, and how many rows more."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

Faults = Iterator[str]
"""Sentences, one for each fault."""


def rows_at_fault(owner: str, items: np.ndarray, wrong: np.ndarray, rule: str, value: Callable[[int], Any]) -> Faults:
    """One sentence about the first of the rows that break a rule; `value(place)` is what it has instead."""
    places = np.flatnonzero(wrong)
    if len(places):
        more = f", as do {len(places) - 1} more rows after it" if len(places) > 1 else ""
        yield f"{owner}, item {items[places[0]]}: {rule}, got {value(int(places[0]))!r}{more}."
