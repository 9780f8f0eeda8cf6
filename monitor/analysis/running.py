"""Times of turns -> time for which a machine has run: a part that stands still does not wear.

Nobody tells a monitor that a machine stands: turns stop coming, as they do between two recordings of a logger that is
switched on once in a while. So a gap between two diagnosed turns counts up to LONGEST_S, or up to SPARSE times the
usual gap where this is more. Running time begins as the time of the first turn and falls behind with each stop.
"""

from __future__ import annotations

from typing import Any

LONGEST_S = 24.0 * 3600.0
"""Gap that still counts as running [s]: nights come every day and belong to how a machine is used, so that they need no
telling apart; weekends hardly, holidays and repairs not at all."""

SPARSE = 3.0
"""Times the usual gap that count as running: recordings at even times, however rare, are no stops, and one or two of
them may be lost."""

_GAPS = 9


class Running:
    """The running time of one machine.

    Parameters
    ----------
    body : mapping, optional
        What `to_dict` gave.
    """

    def __init__(self, body: dict[str, Any] | None = None) -> None:
        body = body or {}
        self._last_s: float | None = body.get("last_s")
        self._ran_s: float | None = body.get("ran_s")
        self._gaps: list[float] = list(body.get("gaps", ()))

    @property
    def ran_s(self) -> float:
        """The running time at the newest turn [s]."""
        return self._ran_s or 0.0

    def turn(self, time_s: float) -> float:
        """A turn was diagnosed at this time [s]; returns the running time then [s]."""
        if self._last_s is None or self._ran_s is None:
            self._last_s = self._ran_s = time_s
        gap = time_s - self._last_s
        if gap > 0.0:
            self._gaps = [*self._gaps, gap][-_GAPS:]
            usual = sorted(self._gaps)[(len(self._gaps) - 1) // 2]
            self._ran_s += min(gap, max(LONGEST_S, SPARSE * usual))
        self._last_s = time_s
        return self._ran_s

    def set_clock(self, shift_s: float) -> None:
        """The sender's clock was set by so much [s]: it has not run for that."""
        self._last_s = None if self._last_s is None else self._last_s + shift_s

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same."""
        return {"last_s": self._last_s, "ran_s": self._ran_s, "gaps": self._gaps}
