"""A data set of `indexer generate` or `indexer ingest`, replayed in real time or faster.

Each machine of the set becomes one; its rows follow each other in time. With the column `remaining_turns`
(campaign=wear) a row stands as many turns after the one before as it says, else one turn. When the set began and how
many rows are kept goes into the store with each row, so that a restart goes on with the next.
"""

from __future__ import annotations

import functools
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from datagen.shard import read_shards
from monitor.engine import Arrival, Engine
from monitor.intake.blocks import NANO, Block
from monitor.sources.base import Source

_ROWS = "rows"
"""Item of its position: when the set began [ns since 1970] and how many rows are kept."""


class ReplaySource(Source):
    """Replays a data set.

    Parameters
    ----------
    folder : Path
    speed : float
        Times faster than real time, > 0; the gaps between rows count as well.
    """

    def __init__(self, folder: Path, speed: float) -> None:
        super().__init__()
        self.name = f"replay:{folder}"
        self._speed = speed
        self._blocks = blocks_of(folder)

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        stored = engine.positions(self.name).get(_ROWS)
        start_ns, done = (time.time_ns(), 0) if stored is None else map(int, stored.split())
        left, passed_ns = self._blocks[done:], self._blocks[done - 1].end_ns if done else 0
        last = {block.machine: block for block in left}
        for machine in {block.machine for block in self._blocks} - last.keys():
            engine.ended(machine)
        if not left:
            self.tell(f"the data set of {self.name} has been replayed to its end; name another out to begin anew")
        began = time.monotonic()
        for row, block in enumerate(left, done + 1):
            # once the last block of a machine is kept no more will come
            ended = functools.partial(engine.ended, block.machine) if block is last[block.machine] else None
            due = began + (block.end_ns - passed_ns) / NANO / self._speed
            if self.stopping.wait(max(0.0, due - time.monotonic())):
                return
            placed = replace(block, start_ns=start_ns + block.start_ns)
            arrival = Arrival(placed, (self.name, _ROWS, f"{start_ns} {row}"), ended)
            while not engine.offer(arrival, timeout=0.5):
                if self.stopping.is_set():
                    return


def blocks_of(folder: Path) -> list[Block]:
    """Every row of a data set as a block, in the order of their times; the first begins at 0 ns."""
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
            start = round(passed * turn_s * NANO)
            blocks.append(
                Block(f"machine {draw}", start, float(rates[row]), units[row], np.atleast_2d(record)[0], begins=True)
            )
    return sorted(blocks, key=lambda block: block.end_ns)
