"""What is visibly wrong with a record, as columns: flat tops of a sensor at its limits, stretches in which it is dead.

Both are shares, not verdicts: a quantiser of few bits holds a value for some samples too. Who reads the data set
decides how much is too much.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SHORTEST_FLAT = 3
"""Samples in a row at the same extreme value that count as clipped; a sampled peak has two at most by chance."""

_CUT = 5.0
"""Times as many samples at the extreme value as at the next one from which on it is a limit: twice the √2 + 1 of the
flattest peak that a quantiser can make of a parabola."""

_ONE_VALUE = 0.9
"""Share of a record in one run above which it is one of one value, be this its largest or not: a table that indexes
leaves the limit of a sensor within every cam turn."""


def quality_columns(records: np.ndarray) -> list[dict[str, Any]]:
    """The quality columns of each record.

    Parameters
    ----------
    records : array_like, shape (n, samples)
        As they are stored: the float32 of a data set.

    Returns
    -------
    list of dict
        For each record `clipped_share`, the share [-] of its samples that lie in runs of at least SHORTEST_FLAT equal
        samples at its largest or smallest value, and `constant_share`, the share in its longest run of equal samples,
        0 where no two neighbours are equal.
    """
    stored = np.asarray(records, dtype=np.float32)
    held = stored[:, 1:] == stored[:, :-1]
    columns = [{"clipped_share": 0.0, "constant_share": 0.0} for _ in stored]
    for place in np.flatnonzero(held.any(axis=1)):
        columns[place] = _shares(stored[place], held[place])
    return columns


def worst_quality(channels: Sequence[np.ndarray]) -> dict[str, float]:
    """The quality columns of a record of several channels, each with its samples (n,): the largest share of any."""
    found = [quality_columns(np.asarray(samples)[None])[0] for samples in channels]
    return {name: max(columns[name] for columns in found) for name in found[0]}


def is_dead(clipped_share: float, constant_share: float, most: float) -> bool:
    """Whether a record holds one value for more than the share `most` [-] of it as a dead sensor does, and not as one
    at its limits: a run longer than all flat tops together lies at none of them; of a record of one value it cannot be
    told."""
    return constant_share > most and (constant_share > clipped_share or constant_share > _ONE_VALUE)


def is_clipped(record: np.ndarray, clipped_share: float, most: float) -> bool:
    """Whether a sensor's limit cuts more than the share `most` [-] of a record (n,) off. A quantiser of few bits holds
    the top of a smooth peak too, but then the value next to it at least √2 - 1 times as long, as a parabola stays: a
    limit is passed on a slope."""
    if clipped_share <= most:
        return False
    counts = np.unique(np.asarray(record, dtype=np.float32), return_counts=True)[1]
    return len(counts) < 3 or counts[0] > _CUT * counts[1] or counts[-1] > _CUT * counts[-2]


def _shares(record: np.ndarray, held: np.ndarray) -> dict[str, float]:
    """The shares of one record; held[i] says that sample i + 1 equals sample i."""
    begins = np.flatnonzero(np.concatenate(([True], ~held)))
    lengths = np.diff(np.append(begins, len(record)))
    values = record[begins]
    extreme = (values == record.max()) | (values == record.min())
    clipped = int(lengths[extreme & (lengths >= SHORTEST_FLAT)].sum())
    return {"clipped_share": clipped / len(record), "constant_share": int(lengths.max()) / len(record)}
