"""Which stage a long command is at: a spinner that says the last fit on a terminal, a log line otherwise."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator, Sequence

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

_log = logging.getLogger(__name__)

FITS = "discrepancy.fit"
"""The logger that is told of every fit."""


@contextlib.contextmanager
def stages(titles: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Give a function that is told the title of each stage as it begins."""

    def words(title: str) -> str:
        return f"{titles.index(title) + 1} of {len(titles)}: {title}"

    if not sys.stderr.isatty():
        yield lambda title: _log.info(words(title))
        return
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True)) as bars:
        begun: list[str] = []

        def begin(title: str) -> None:
            for task in bars.task_ids:
                bars.update(task, total=1, completed=1)
            begun.append(words(title))
            bars.add_task(begun[-1], total=None)

        def fitted(said: str) -> None:
            for task in bars.task_ids[-1:]:
                bars.update(task, description=f"{begun[-1]} ({said})")

        with _heard(fitted):
            yield begin
        for task in bars.task_ids:
            bars.update(task, total=1, completed=1)


@contextlib.contextmanager
def _heard(hear: Callable[[str], None]) -> Iterator[None]:
    """Have every fit told to `hear`, and to nobody else: on a terminal no log line may break the spinner."""
    logger, handler = logging.getLogger(FITS), _Hearing(hear)
    level, propagate = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        logger.propagate = propagate


class _Hearing(logging.Handler):
    def __init__(self, hear: Callable[[str], None]) -> None:
        super().__init__()
        self.hear = hear

    def emit(self, record: logging.LogRecord) -> None:
        self.hear(record.getMessage())
