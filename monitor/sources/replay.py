"""A data set of `indexer generate` or `indexer ingest`, replayed in real time or faster.

Each machine of the set becomes one; its rows follow each other in time. With the column `remaining_turns`
(campaign=wear) a row stands as many turns after the one before as it says, else one turn.
"""

from __future__ import annotations

import functools
import time
from pathlib import Path

import numpy as np

from datagen.shard import read_shards
from monitor.engine import Arrival, Engine
from monitor.intake.blocks import NANO, Block
from monitor.sources.base import Source


class ReplaySource(Source):
    """Replays a data set.

    Parameters
    ----------
    folder : Path
    speed : float
        Times faster than real time, > 0; the gaps between rows count as well.
    start_ns : int
        Time of the first row [ns since 1970].
    """

    def __init__(self, folder: Path, speed: float, start_ns: int) -> None:
        super().__init__()
        self.name = f"replay:{folder}"
        self._speed, self._start_ns = speed, start_ns
        self._blocks = blocks_of(folder, start_ns)

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        began = time.monotonic()
        last = {block.machine: block for block in self._blocks}
        for block in self._blocks:
            # once the last block of a machine is kept no more will come
            ended = functools.partial(engine.ended, block.machine) if block is last[block.machine] else None
            due = began + (block.end_ns - self._start_ns) / NANO / self._speed
            if self.stopping.wait(max(0.0, due - time.monotonic())):
                return
            while not engine.offer(Arrival(block, kept=ended), timeout=0.5):
                if self.stopping.is_set():
                    return


def blocks_of(folder: Path, start_ns: int) -> list[Block]:
    """Every row of a data set as a block, in the order of their times."""
    data = read_shards(folder)
    table = data.table
    draws = table.column("machine_draw").to_numpy()
    rates = table.column("sample_rate").to_numpy()
    units = table.column("unit").to_pylist()
    wears = "remaining_turns" in table.column_names and not table.column("remaining_turns").null_count
    left = table.column("remaining_turns").to_numpy() if wears else None
    blocks = []
    for draw in np.unique(draws):
        rows = np.flatnonzero(draws == draw)
        for place, row in enumerate(rows):
            record = data.records[row]
            turn_s = record.shape[-1] / rates[row]
            passed = place if left is None else int(left[rows[0]] - left[row])
            start = start_ns + round(passed * turn_s * NANO)
            blocks.append(
                Block(f"machine {draw}", start, float(rates[row]), units[row], np.atleast_2d(record)[0], begins=True)
            )
    return sorted(blocks, key=lambda block: block.end_ns)
