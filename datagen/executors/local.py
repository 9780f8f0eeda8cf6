"""Threads of this process: the kernel, the filters' and the encoder's loops and SHA-256 let each other run."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import ClassVar, TypeVar

from datagen.executors.base import Executor
from indexer_env.checks import check_integer
from indexer_env.engine import cores

T = TypeVar("T")


@dataclass(frozen=True)
class LocalExecutor(Executor):
    """Whole shards side by side, one for each worker, so that one is written while the next is simulated.

    Attributes
    ----------
    workers : int or None
        Shards made at once, >= 1; each takes some 150 MB at 576 records of 8200 samples. None: as many as cores.
    """

    here: ClassVar[bool] = True

    workers: int | None = None

    def __post_init__(self) -> None:
        if self.workers is not None:
            check_integer("datagen", "workers", self.workers, low=1)

    @property
    def size(self) -> int:
        """Shards made at once."""
        return self.workers or cores()

    def describe(self) -> str:
        return f"local, {self.size} worker{'s' if self.size > 1 else ''}"

    def threads(self, tasks: int) -> int:
        return max(1, self.size // max(1, tasks))

    def map(self, task: Callable[[int], T], numbers: Iterable[int]) -> Generator[T]:
        waiting = iter(numbers)
        pool = ThreadPoolExecutor(self.size, thread_name_prefix="datagen")
        try:
            running: set[Future[T]] = {pool.submit(task, number) for number in itertools.islice(waiting, self.size)}
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                running |= {pool.submit(task, number) for number in itertools.islice(waiting, len(done))}
                for future in done:
                    yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)
