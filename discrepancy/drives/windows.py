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
    lengths: Sequence[int], kept: Sequence[bool], share: float, least: Sequence[int], *, most: bool = False
) -> tuple[Windows, Windows, bool]:
    """Windows to fit and to hold out of records of these lengths (compared samples).

    Records marked as kept are held out whole. Where none is, the last `share` of each record is; then the third answer
    is True. A window has at least its record's `least` [samples], where the record has; with `most` it has about that.
    """
    whole = any(kept)
    fitted, held = [], []
    for k, (samples, keep) in enumerate(zip(lengths, kept, strict=True)):
        edge = samples if whole else round((1.0 - share) * samples)
        if whole and keep:
            held.append((k, 0, samples))
        else:
            fitted.append((k, 0, edge))
        if not whole:
            held.append((k, edge, samples))
    return _cut(fitted, least, most), _cut(held, least, most), not whole


def _cut(spans: Sequence[tuple[int, int, int]], least: Sequence[int], most: bool) -> Windows:
    each = max(PER_RECORD, math.ceil(WINDOWS / len(spans)))
    rows = []
    for track, start, stop in spans:
        fitting = max(1, (stop - start) // least[track])
        edges = np.linspace(start, stop, (fitting if most else min(each, fitting)) + 1).astype(int)
        rows += [(track, a, b - a) for a, b in itertools.pairwise(edges)]
    track, first, count = np.array(rows, dtype=np.int64).T
    return Windows(track, first, count)
