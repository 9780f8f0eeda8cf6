"""The channels of a measured record: how the column `source_channel` names them, and where their samples stand.

The record of several channels holds all samples of the first, then those of the second and so on, as many of each.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np


def channels_text(names: Sequence[str]) -> str:
    """One channel by its name, several as a JSON list; a single name that reads as such a list is put into one."""
    alone = len(names) == 1 and channels_of(names[0]) == tuple(names)
    return names[0] if alone else json.dumps(list(names), ensure_ascii=False)


def channels_of(text: str | None) -> tuple[str, ...]:
    """The channels that a column's text names; None, of a simulated record, is one without a name."""
    if text is None:
        return ("",)
    try:
        names = json.loads(text) if text.startswith("[") else text
    except json.JSONDecodeError:
        return (text,)
    listed = isinstance(names, list) and names and all(isinstance(name, str) for name in names)
    return tuple(names) if listed else (text,)


def by_channel(records: np.ndarray, channels: int) -> np.ndarray:
    """Records (n, channels · samples) as (n, channels, samples); those of one channel as they are."""
    return records if channels == 1 else records.reshape(len(records), channels, -1)
