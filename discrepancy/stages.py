"""Which stage a long command is at: a spinner on a terminal, a log line otherwise."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator, Sequence

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

_log = logging.getLogger(__name__)


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

        def begin(title: str) -> None:
            for task in bars.task_ids:
                bars.update(task, total=1, completed=1)
            bars.add_task(words(title), total=None)

        yield begin
        for task in bars.task_ids:
            bars.update(task, total=1, completed=1)
