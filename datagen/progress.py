"""How far a long command is: a bar on a terminal, a log line now and then otherwise."""

from __future__ import annotations

import contextlib
import logging
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

LOG_INTERVAL = 10.0
"""Least time between two log lines [s]."""

Advance = Callable[[int], None]

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def progress(title: str, total: int, noun: str, *, done: int = 0) -> Iterator[Advance]:
    """Give a function that is told how many more of `total` are done; `done` are before it begins, which the rate and
    the time left do not count."""
    if sys.stderr.isatty():
        with _bar(title, total, noun, done) as advance:
            yield advance
    else:
        yield _log_lines(title, total, noun, done)


@contextlib.contextmanager
def _bar(title: str, total: int, noun: str, before: int) -> Iterator[Advance]:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[speed]}"))
    with Progress(*columns, console=Console(stderr=True)) as bars:
        task = bars.add_task(title, total=total, completed=before, speed="")
        start, done = time.monotonic(), before

        def advance(more: int) -> None:
            nonlocal done
            done += more
            bars.update(task, advance=more, speed=_speed(done - before, total - done, start, noun))

        yield advance


def _log_lines(title: str, total: int, noun: str, before: int) -> Advance:
    start = last = time.monotonic()
    done = before
    if before:
        _log.info("%s: %d of %d %s are done", title, before, total, noun)

    def advance(more: int) -> None:
        nonlocal done, last
        done += more
        now = time.monotonic()
        if done >= total or now - last >= LOG_INTERVAL:
            last = now
            _log.info("%s: %d of %d %s, %s", title, done, total, noun, _speed(done - before, total - done, start, noun))

    return advance


def _speed(done: int, left: int, start: float, noun: str) -> str:
    """Rate since the start and the time left at this rate."""
    rate = done / max(time.monotonic() - start, 1e-9)
    minutes, seconds = divmod(round(left / rate), 60) if rate else (0, 0)
    hours, minutes = divmod(minutes, 60)
    pace = f"{rate:.0f} {noun}/s" if rate >= 1.0 else f"{60.0 * rate:.2g} {noun}/min"
    return pace + (f", {hours}:{minutes:02d}:{seconds:02d} left" if left else "")
