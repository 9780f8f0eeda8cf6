"""Random streams: one independent generator for each part of each item, from the seed of the data set alone.

Law: `numpy.random.SeedSequence(seed, spawn_key=(part, item))` feeding PCG64. Item i therefore never depends
on item i-1, on the count, on the shard it lands in or on who computes it, and a row's `seed` and `item` are
enough to draw it again.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Part(IntEnum):
    """What a stream is for; the number is part of the data format, so numbers are only ever added."""

    MACHINE = 0
    """The draws that make an item's machine."""
    SENSOR = 1
    """The noise of an item's sensor."""
    EXAMPLE_MACHINE = 2
    """The machine of the example file, which is in no data set."""
    EXAMPLE_SENSOR = 3
    """The noise of the example file."""


def stream(seed: int, part: Part, item: int) -> np.random.Generator:
    """The generator of one part of one item; the same arguments always give the same numbers."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(int(part), item))))
