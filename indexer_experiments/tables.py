"""Shares with their intervals, and tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

_NORMAL_95 = 1.96


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    if of == 0:
        return 0.0, 1.0
    share, z2 = hits / of, _NORMAL_95**2
    middle = (share + z2 / (2 * of)) / (1.0 + z2 / of)
    half = _NORMAL_95 * math.sqrt(share * (1.0 - share) / of + z2 / (4 * of**2)) / (1.0 + z2 / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def share(hits: int, of: int) -> tuple[str, str]:
    """ "19 of 20 (95 %)" and its interval "76–99 %"; dashes where there is no case."""
    if not of:
        return "no case", "–"
    low, high = wilson(hits, of)
    return f"{hits} of {of} ({100 * hits / of:.1f} %)", f"{100 * low:.1f}–{100 * high:.1f} %"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows of texts under a head, in Markdown."""
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, ["---"] * len(head), *rows))
