"""Which samples of which record are fitted and which are held out, cut into windows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WINDOWS = 12
"""Windows of all records fitted, at least: intervals rest on how much windows differ."""

PER_RECORD = 4
"""Windows of each record, at least."""

_MOVES = 0.5
"""Least share of their share of a record's motion that the part fitted and the part held out must have each."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of records.

    Attributes
    ----------
    track : ndarray (w,) of int
        Index of the record among all.
    first, count : ndarray (w,) of int
        Samples of the record, as they are compared.
    """

    track: np.ndarray
    first: np.ndarray
    count: np.ndarray

    @property
    def tracks(self) -> list[int]:
        """Records in these windows, in their order."""
        return list(dict.fromkeys(self.track.tolist()))

    @property
    def groups(self) -> np.ndarray:
        """Number of each window's record among those in these windows."""
        return np.array([self.tracks.index(k) for k in self.track.tolist()], dtype=np.int64)


def split(
    lengths: Sequence[int], kept: Sequence[bool], share: float, least: Sequence[int], *, most: bool = False,
    moving: Sequence[np.ndarray] = (),
) -> tuple[Windows, Windows, bool]:  # fmt: skip
    """Windows to fit and to hold out of records of these lengths (compared samples).

    Records marked as kept are held out whole. Where none is, the last `share` of each record is; then the third answer
    is True. A window has at least its record's `least` [samples], where the record has; with `most` it has about that.
    Where `moving` (samples,) of each record says that a part has less than half its share of the motion, the record is
    cut by the time in which it moves, and what stands behind that is left out.
    """
    whole = any(kept)
    fitted, held = [], []
    for k, (samples, keep) in enumerate(zip(lengths, kept, strict=True)):
        if whole:
            (held if keep else fitted).append((k, 0, samples))
            continue
        edge, end = _division(samples, share, moving[k] if len(moving) else np.full(samples, True))
        fitted.append((k, 0, edge))
        held.append((k, edge, end))
    return _cut(fitted, least, most), _cut(held, least, most), not whole


def _division(samples: int, share: float, moving: np.ndarray) -> tuple[int, int]:
    """Where the part to hold out begins and ends."""
    edge, moved = round((1.0 - share) * samples), np.cumsum(moving)
    fitted, total = float(moved[edge - 1]), float(moved[-1])
    if min(fitted / (1.0 - share), (total - fitted) / share) >= _MOVES * total:
        return edge, samples
    return int(np.searchsorted(moved, round((1.0 - share) * total))) + 1, int(np.searchsorted(moved, total)) + 1


def _cut(spans: Sequence[tuple[int, int, int]], least: Sequence[int], most: bool) -> Windows:
    each = max(PER_RECORD, math.ceil(WINDOWS / len(spans)))
    rows = []
    for track, start, stop in spans:
        fitting = max(1, (stop - start) // least[track])
        edges = np.linspace(start, stop, (fitting if most else min(each, fitting)) + 1).astype(int)
        rows += [(track, a, b - a) for a, b in itertools.pairwise(edges)]
    track, first, count = np.array(rows, dtype=np.int64).T
    return Windows(track, first, count)
