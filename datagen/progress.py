"""How far a long command is: a bar on a terminal, a log line now and then otherwise."""

from __future__ import annotations

import contextlib
import logging
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

LOG_INTERVAL = 10.0
"""Least time between two log lines [s]."""

Advance = Callable[[int], None]

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def progress(title: str, total: int, noun: str) -> Iterator[Advance]:
    """Give a function that is told how many more of `total` are done."""
    if sys.stderr.isatty():
        with _bar(title, total, noun) as advance:
            yield advance
    else:
        yield _log_lines(title, total, noun)


@contextlib.contextmanager
def _bar(title: str, total: int, noun: str) -> Iterator[Advance]:
    rate = TextColumn("{task.fields[rate]}")
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        rate,
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bars:
        task = bars.add_task(title, total=total, rate="")
        start, done = time.monotonic(), 0

        def advance(more: int) -> None:
            nonlocal done
            done += more
            bars.update(task, advance=more, rate=_rate(done, start, noun))

        yield advance


def _log_lines(title: str, total: int, noun: str) -> Advance:
    start = last = time.monotonic()
    done = 0

    def advance(more: int) -> None:
        nonlocal done, last
        done += more
        now = time.monotonic()
        if done >= total or now - last >= LOG_INTERVAL:
            last = now
            _log.info("%s: %d of %d %s, %s", title, done, total, noun, _rate(done, start, noun))

    return advance


def _rate(done: int, start: float, noun: str) -> str:
    return f"{done / max(time.monotonic() - start, 1e-9):.0f} {noun}/s"
