"""How far a long command is: a bar on a terminal, a log line now and then otherwise."""

from __future__ import annotations

import contextlib
import logging
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

LOG_INTERVAL = 10.0
"""Least time between two log lines [s]."""

_log = logging.getLogger(__name__)


class Advance(ABC):
    """Is told how many more are done, and what is going on."""

    def __init__(self, title: str, total: int, noun: str, before: int) -> None:
        self.title, self.total, self.noun = title, total, noun
        self.start, self.done, self.before = time.monotonic(), before, before

    def __call__(self, more: int, *, earlier: bool = False) -> None:
        """So many more are done; `earlier` ones were so before the work began, and count neither in its rate nor in the
        time left."""
        self.done += more
        if earlier:
            self.before += more
        self._show(earlier)

    def now(self, title: str) -> None:
        """Something else is going on from here on."""
        self.title = title
        self._retitle()

    def _speed(self) -> str:
        """Rate since the start and the time left at this rate."""
        left, rate = self.total - self.done, (self.done - self.before) / max(time.monotonic() - self.start, 1e-9)
        minutes, seconds = divmod(round(left / rate), 60) if rate else (0, 0)
        hours, minutes = divmod(minutes, 60)
        pace = f"{rate:.0f} {self.noun}/s" if rate >= 1.0 else f"{60.0 * rate:.2g} {self.noun}/min"
        return pace + (f", {hours}:{minutes:02d}:{seconds:02d} left" if left else "")

    @abstractmethod
    def _show(self, earlier: bool) -> None: ...

    @abstractmethod
    def _retitle(self) -> None: ...


@contextlib.contextmanager
def progress(title: str, total: int, noun: str, *, done: int = 0) -> Iterator[Advance]:
    """Show at once what is going on, and give what is to be told of its steps; `done` of `total` are done before."""
    if not sys.stderr.isatty():
        yield _Lines(title, total, noun, done)
        return
    columns = (
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("{task.fields[speed]}"),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as bars:
        yield _Bar(title, total, noun, done, bars)


class _Bar(Advance):
    def __init__(self, title: str, total: int, noun: str, before: int, bars: Progress) -> None:
        super().__init__(title, total, noun, before)
        self._bars, self._task = bars, bars.add_task(title, total=total, completed=before, speed="")

    def _show(self, earlier: bool) -> None:
        self._bars.update(self._task, completed=self.done, speed="" if earlier else self._speed())

    def _retitle(self) -> None:
        self._bars.update(self._task, description=self.title)


class _Lines(Advance):
    def __init__(self, title: str, total: int, noun: str, before: int) -> None:
        super().__init__(title, total, noun, before)
        self._last = self.start
        if before:
            self._show(earlier=True)
        else:
            _log.info("%s: %d %s", title, total, noun if total != 1 else noun.removesuffix("s"))

    def _show(self, earlier: bool) -> None:
        now = time.monotonic()
        if earlier:
            _log.info("%s: %d of %d %s are done", self.title, self.done, self.total, self.noun)
        elif self.done >= self.total or now - self._last >= LOG_INTERVAL:
            self._last = now
            _log.info("%s: %d of %d %s, %s", self.title, self.done, self.total, self.noun, self._speed())

    def _retitle(self) -> None:
        _log.info("%s", self.title)
