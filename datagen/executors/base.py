"""What an executor is: something that does one task for many numbers and gives the answers as they come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable
from typing import ClassVar, TypeVar

from indexer_env.errors import IndexerError

T = TypeVar("T")


class ExecutorError(IndexerError, RuntimeError):
    """An executor cannot be had or has lost what it runs on."""


class Executor(ABC):
    """Every answer depends on its number alone, so who works, how many and in which order change nothing."""

    here: ClassVar[bool]
    """Whether tasks run on this machine and so reach its folders."""

    @abstractmethod
    def describe(self) -> str:
        """What did the work, for run.json and the card."""

    @abstractmethod
    def threads(self, tasks: int) -> int:
        """Threads for each of so many tasks, so that no core idles."""

    @abstractmethod
    def map(self, task: Callable[[int], T], numbers: Iterable[int]) -> Generator[T]:
        """The answers, in whatever order they come; an error of a task is raised here. Closing the generator gives up
        what has not begun."""
