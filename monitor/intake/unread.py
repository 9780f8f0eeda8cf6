"""Messages and files that cannot be read: in the log, and on the page with their machine or, as long as it is unknown,
in its place."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from monitor.intake.states import States, joined_items

if TYPE_CHECKING:
    from monitor.pipeline import Pipeline

_log = logging.getLogger(__name__)

SHOWN = 3
"""Machines of which the page tells what cannot be read before any of their samples has come."""

_MACHINES = 1000
_AGAIN_S = 3600.0
"""For how long the log does not repeat what it has said of a machine: a sender may break a rule many times a second."""


class Unread:
    """What of each machine could not be read and is not told by its pipeline yet; may be used from any thread.

    Attributes
    ----------
    told : callable
        Called when `sentences` may have changed.
    """

    def __init__(self) -> None:
        self.told: Callable[[], None] = lambda: None
        self._lock = threading.Lock()
        self._waiting: dict[str, tuple[int, dict[str, str]]] = {}
        self._logged: dict[tuple[str, str], float] = {}

    def add(self, machine: str, sentence: str, item: str = "") -> None:
        """A message or file could not be read, for the reason in the sentence; `item` names a file."""
        with self._lock:
            count, items = self._waiting.pop(machine, (0, {}))
            self._waiting[machine] = count + 1, joined_items(items, {item: sentence})
            if len(self._waiting) > _MACHINES:
                del self._waiting[next(iter(self._waiting))]
            news = self._is_news(machine, sentence)
        if news:
            _log.warning("what has come from the machine %r cannot be read: %s", machine, sentence)
            self.told()

    def move(self, machine: str, states: States, now_ns: int) -> bool:
        """Hand over to the states of a machine, now that there are some, by the time of its samples; False: there was
        nothing."""
        with self._lock:
            count, items = self._waiting.pop(machine, (0, {}))
        if count:
            states.note("broken_payload", now_ns, list(items.values())[-1], count, items)
            self.told()
        return count > 0

    def read(self, pipeline: Pipeline, item: str) -> None:
        """A file of a machine has been read: that it could not be before is over."""
        self.move(pipeline.machine, pipeline.states, pipeline.time_at(time.time_ns()))
        pipeline.states.right("broken_payload", item)

    @property
    def sentences(self) -> list[str]:
        """For the page: the last one of each machine that is unknown, newest first, and how many more there are."""
        with self._lock:
            newest = [list(items.values())[-1] for _, items in reversed(self._waiting.values())]
        more = len(newest) - SHOWN
        return [*newest[:SHOWN], *([f"so it is with {more} more machines; the log names them"] if more > 0 else [])]

    def _is_news(self, machine: str, sentence: str) -> bool:
        """Whether the log has not said so within the hour, apart from the value got."""
        key, now = (machine, sentence.partition(", got ")[0]), time.monotonic()
        if now - self._logged.get(key, -_AGAIN_S) < _AGAIN_S:
            return False
        if len(self._logged) >= _MACHINES:
            self._logged.clear()
        self._logged[key] = now
        return True
