"""Random streams: one independent generator for each part of each item, from the seed of the data set alone.

Law: `numpy.random.SeedSequence(seed, spawn_key=(part, item))` feeding PCG64. Item i therefore never depends
on item i-1, on the count, on the shard it lands in or on who computes it, and a row's `seed` and `item` are
enough to draw it again.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

BLOCK = 1024
"""Points of the Sobol' sequence made and put in order at once, part of the data format; scipy needs some milliseconds
to begin a sequence."""


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
    RECORD = 4
    """What differs from repeat to repeat on one machine."""
    EXAMPLE_RECORD = 5
    """The same for the example file."""
    SEQUENCE = 6
    """The Sobol' sequence: as item 0 its scrambling, one for the whole data set, as item 1 + b the order of the points
    of block b."""
    EXAMPLE_SEQUENCE = 7
    """The same for the example file."""
    DRIVE = 8
    """The noise of an item's drive."""
    EXAMPLE_DRIVE = 9
    """The same for the example file."""

    @property
    def of_drive(self) -> Part:
        """The noise of the drive that belongs to that of the sensor."""
        return {Part.SENSOR: Part.DRIVE, Part.EXAMPLE_SENSOR: Part.EXAMPLE_DRIVE}[self]


def stream(seed: int, part: Part, item: int) -> np.random.Generator:
    """The generator of one part of one item; the same arguments always give the same numbers."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(int(part), item))))


@dataclass(frozen=True)
class Chance:
    """All chance of a data set, or of its example file, which has streams of its own."""

    seed: int
    example: bool = False

    def machine(self, machine_draw: int) -> np.random.Generator:
        """What one machine of the data set is drawn with."""
        return stream(self.seed, Part.EXAMPLE_MACHINE if self.example else Part.MACHINE, machine_draw)

    def record(self, item: int) -> np.random.Generator:
        """What makes this item differ from the repeats on the same machine."""
        return stream(self.seed, Part.EXAMPLE_RECORD if self.example else Part.RECORD, item)

    def point(self, machine_draw: int, dimensions: int) -> tuple[float, ...]:
        """The machine's point of the data set's scrambled Sobol' sequence of so many dimensions."""
        if dimensions == 0:
            return ()
        part = Part.EXAMPLE_SEQUENCE if self.example else Part.SEQUENCE
        block, place = divmod(machine_draw, BLOCK)
        return tuple(_points(self.seed, part, dimensions, block)[place].tolist())


@functools.lru_cache(maxsize=16)
def _points(seed: int, part: Part, dimensions: int, block: int) -> np.ndarray:
    """The points of a block in their order, shape (BLOCK, dimensions), whichever were asked for before."""
    # Half a second to import, which only a data set with a sobol law should pay.
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimensions, scramble=True, rng=stream(seed, part, 0))
    if block:
        sequence.fast_forward(block * BLOCK)
    return sequence.random(BLOCK)[_order(seed, part, block)]


def _order(seed: int, part: Part, block: int) -> np.ndarray:
    """In which order a block's points are taken, shape (BLOCK,): its halves exchanged at random, in each half its
    halves, and so on down to neighbours.

    The first 2^k points stay 2^k neighbours of the sequence, so they fill space as evenly. The sequence's own order
    would give each subset a region of its own: the lowest bits of d, by which subsets and classes go round, tell in
    which half of its range a coordinate lies.
    """
    rng, order = stream(seed, part, 1 + block), np.zeros(1, dtype=int)
    while len(order) < BLOCK:
        second = rng.integers(2, size=len(order))
        order = np.stack([2 * order + second, 2 * order + 1 - second], axis=1).ravel()
    return order
