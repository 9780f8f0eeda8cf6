"""Tasks on a Ray cluster, one core each; those of a worker or node that dies are done again by another."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from datagen.executors.base import Executor, ExecutorError
from indexer_env.checks import check_integer
from indexer_env.errors import refuse

T = TypeVar("T")

_ATTEMPTS = 10
"""Times a task is tried again after its worker or node has died; one that brings down each of so many is at fault."""

_AHEAD = 2
"""Tasks handed out for each core: one that runs and one that waits there."""


@dataclass(frozen=True)
class RayExecutor(Executor):
    """A cluster that runs already, or one started here for the occasion.

    Attributes
    ----------
    address : str
        "auto": the cluster that this machine belongs to; "local": a new one of this machine's cores;
        "ray://HOST:PORT" or "HOST:PORT": another.
    workers : int or None
        Shards made at once, >= 1. None: as many as the cluster has cores at the start.
    """

    here: ClassVar[bool] = False

    address: str = "auto"
    workers: int | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.address, str) or not self.address:
            raise refuse("datagen", "address", "auto, local or the address of a Ray cluster", self.address)
        if self.workers is not None:
            check_integer("datagen", "workers", self.workers, low=1)

    def describe(self) -> str:
        return f"ray, {self.workers or int(_ray(self.address).cluster_resources().get('CPU', 1))} workers"

    def threads(self, tasks: int) -> int:
        return 1

    def map(self, task: Callable[[int], T], numbers: Iterable[int]) -> Generator[T]:
        ray = _ray(self.address)
        remote = ray.remote(num_cpus=1, max_retries=_ATTEMPTS)(_answer)
        shared, waiting = ray.put(task), iter(numbers)
        running: list[Any] = []
        try:
            while True:
                # Anew each time: nodes come and go.
                room = self.workers or _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
                more = itertools.islice(waiting, max(0, room - len(running)))
                running += [remote.remote(shared, number) for number in more]
                if not running:
                    return
                done, running = ray.wait(running, num_returns=1)
                yield ray.get(done[0])
        except ray.exceptions.RayError as error:
            task_error = isinstance(error, ray.exceptions.RayTaskError)
            if task_error and not isinstance(error.cause, ray.exceptions.RayError):
                raise error.cause from None
            cause = str(error).strip().partition("\n")[0]
            remedy = "see that its nodes live, then run the same command again, which goes on where this run stopped"
            raise ExecutorError(f"the Ray cluster at address {self.address} has failed ({cause}); {remedy}.") from None
        finally:
            for reference in running:
                ray.cancel(reference)


def _answer(task: Callable[[int], T], number: int) -> T:
    return task(number)


def _ray(address: str) -> Any:
    """The package, connected."""
    try:
        import ray
    except ImportError:
        raise ExecutorError(
            "executor=ray needs the package ray, which is not installed; pip install 'indexer-diagnosis[ray]'."
        ) from None
    if not ray.is_initialized():
        try:
            ray.init(address, logging_level=logging.WARNING, log_to_driver=False)
        except (ConnectionError, ValueError) as error:
            remedy = "start one with `ray start --head`, or take address=local for one on this machine"
            cause = str(error).strip().partition("\n")[0]
            raise ExecutorError(f"no Ray cluster answers at address {address} ({cause}); {remedy}.") from None
    return ray
