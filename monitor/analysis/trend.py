"""Turn by turn -> one value with its interval, and a history of bounded length.

The value is the running median over `window` turns, of the sizes and of both ends of their intervals: one strange turn
does not move it. The history keeps POINTS means at most; when it is full, neighbours are merged in pairs, so that it
reaches back to the first turn with an ever coarser step.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from monitor.analysis.finding import Size

POINTS = 96
"""Points of a history: a curve with its bend needs some tens, and they are stored with every turn."""

_DIGITS = 7


class Trend:
    """The trend of one quantity in one mode.

    Parameters
    ----------
    window : int
        Turns of the running median.
    body : mapping, optional
        What `to_dict` gave.
    """

    def __init__(self, window: int, body: dict[str, Any] | None = None) -> None:
        body = body or {}
        self._window = window
        self._recent: list[list[float]] = _rows(body.get("recent", []))
        self._points: list[list[float]] = _rows(_timed(body.get("points", [])))
        self._stride = int(body.get("stride", 1))
        # the point that is not full yet: sums, and of how many turns; earlier versions kept these themselves
        rows = _rows(_timed(body.get("open", [])))
        self._open = np.sum(rows, axis=0).tolist() if rows else [0.0] * 5
        self._count = int(body.get("count", len(rows)))

    def add(self, time_s: float, size: Size, ran_s: float | None = None) -> Size:
        """Take in a turn at `time_s` [s], when the machine had run for `ran_s` [s] (None: it never stood); returns the
        smoothed value with its interval."""
        self._recent = [*self._recent, [float(_round(part)) for part in size]][-self._window :]
        ran_s = time_s if ran_s is None else ran_s
        turn = (float(time_s), *(float(_round(part)) for part in size), float(ran_s))
        self._open, self._count = [whole + part for whole, part in zip(self._open, turn, strict=True)], self._count + 1
        if self._count >= self._stride:
            self._points.append([float(_round(part / self._count, 13)) for part in self._open])
            self._open, self._count = [0.0] * 5, 0
        if len(self._points) >= POINTS:
            pairs = np.array(self._points[: len(self._points) // 2 * 2]).reshape(-1, 2, 5).mean(axis=1)
            rest = self._points[len(pairs) * 2 :]
            self._points = [[float(_round(part, 13)) for part in pair] for pair in pairs] + rest
            self._stride *= 2
        return self.now

    @property
    def now(self) -> Size:
        """The smoothed value with its interval."""
        return Size(*np.median(np.array(self._recent), axis=0).tolist())

    @property
    def full(self) -> bool:
        """Whether the median has all its turns."""
        return len(self._recent) >= self._window

    @property
    def stride(self) -> int:
        """Turns of which each point of the history is the mean."""
        return self._stride

    @property
    def history(self) -> np.ndarray:
        """Points (n, 4): time [s], value and the ends of its interval."""
        return self._all[:, :4]

    @property
    def running(self) -> np.ndarray:
        """The full points alone, each the mean of `stride` turns, with the time for which the machine had run [s]."""
        return np.array(self._points, dtype=float).reshape(-1, 5)[:, [4, 1, 2, 3]]

    @property
    def _all(self) -> np.ndarray:
        points: Sequence[list[float]] = self._points
        if self._count:
            points = [*points, [part / self._count for part in self._open]]
        return np.array(points, dtype=float).reshape(-1, 5)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same trend."""
        still_open = {"open": [self._open] if self._count else [], "count": self._count}
        return {"recent": self._recent, "points": self._points, "stride": self._stride, **still_open}


def _rows(stored: Iterable[Iterable[float | None]]) -> list[list[float]]:
    """Rows as they were stored; None is how stores of earlier versions tell an end that is infinite."""
    return [[math.inf if part is None else part for part in row] for row in stored]


def _timed(stored: Iterable[Sequence[float | None]]) -> list[list[float | None]]:
    """Points with their running time; earlier versions took all time for it."""
    return [[*row, row[0]] if len(row) == 4 else [*row] for row in stored]


def _round(value: float, digits: int = _DIGITS) -> str:
    """A number in so many digits: what is stored is what goes on being used."""
    return f"{value:.{digits}g}"
