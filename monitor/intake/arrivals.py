"""Blocks on their way into the engine, and those of machines that another process has."""

from __future__ import annotations

import contextlib
import queue
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from monitor.intake.blocks import Block

_FIRST, _MOST = 16, 256
"""Blocks of the first batch, and of any."""

_LONG_S, _WAIT_S = 1.0, 0.1


@dataclass(frozen=True, eq=False)
class Arrival:
    """A block and how its source learns that it is kept.

    position  source, item and value that are stored with it, for a source that is read and not sent
    kept      called once the block is in the store
    """

    block: Block
    position: tuple[str, str, str] | None = None
    kept: Callable[[], None] | None = None


class Batches:
    """What waits in a queue, in batches that take about a second: while one is worked off others wait for the store."""

    def __init__(self, waiting: queue.Queue[Arrival]) -> None:
        self._waiting, self.size = waiting, _FIRST

    def next(self) -> list[Arrival]:
        """The oldest blocks; none where none comes for a while."""
        batch: list[Arrival] = []
        with contextlib.suppress(queue.Empty):
            batch.append(self._waiting.get(timeout=_WAIT_S))
            while len(batch) < self.size:
                batch.append(self._waiting.get_nowait())
        return batch

    def took(self, seconds: float) -> None:
        """How long the last one took: a turn takes a network milliseconds, and a twin seconds."""
        self.size = max(1, self.size // 2) if seconds > _LONG_S else min(_MOST, 2 * self.size)


class Standby:
    """The blocks of the last `seconds` of machines that another process has, for when it dies."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._waiting: dict[str, deque[tuple[float, Arrival]]] = {}

    def keep(self, arrival: Arrival) -> None:
        """Take in a block, and forget those that are too old."""
        waiting, now = self._waiting.setdefault(arrival.block.machine, deque()), time.monotonic()
        waiting.append((now, Arrival(arrival.block)))
        while now - waiting[0][0] > self.seconds:
            waiting.popleft()

    @property
    def machines(self) -> set[str]:
        """Those of which blocks are kept."""
        return set(self._waiting)

    def blocks(self, machine: str) -> list[Arrival]:
        """What is kept of a machine, oldest first."""
        return [arrival for _, arrival in self._waiting.get(machine, ())]

    def drop(self, machine: str) -> None:
        """Forget a machine."""
        self._waiting.pop(machine, None)
