"""What must be told on a channel, told until it was taken: at least once, in order."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Any

from monitor.store import Store, StoreDown

_log = logging.getLogger(__name__)

_LOOK_S = 0.5
_LONGEST_WAIT_S = 300.0


_REFUSALS = 3
"""Times that a message is refused before it is set aside."""


_TROUBLE = 3
"""Failures on end after which the page says that alarms are not delivered."""


def _in_words(error: Exception) -> str:
    """What an error says, without the address, which may hold a secret."""
    code = getattr(error, "code", None)
    return f"HTTP {code}" if isinstance(code, int) else type(error).__name__


def forget_others(store: Store, channels: Sequence[str]) -> None:
    """What waits for a channel that is not configured is forgotten: it would be old news once it is switched on again.
    Not for monitors that share a store, since each may have channels of its own."""
    dropped = store.drop_outbox(channels)
    if dropped:
        _log.warning("alarms that waited for a channel that is not configured are forgotten: %d", dropped)


class Refused(OSError):
    """The other side will never take this message, whatever it may take else."""


class Sender:
    """Takes the rows of a channel from the outbox and hands them to `deliver`, oldest first.

    `deliver` raises OSError where the other side did not take it; it is tried again, ever more rarely up to every five
    minutes, also after an error that nobody foresaw, which the log tells in full. A message that is `Refused` some
    times goes into the log, so that the alarms behind it are told. It looks while `may` says so: of several processes
    on one store one tells.
    """

    def __init__(
        self, store: Store, channel: str, deliver: Callable[[dict[str, Any]], None],
        may: Callable[[], bool] = lambda: True,
    ) -> None:  # fmt: skip
        self._store, self._channel, self._deliver, self._may = store, channel, deliver, may
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"sender {channel}", daemon=True)
        self.delivered = self.failures = 0
        self._why = ""
        self._refusals: dict[int, int] = {}

    @property
    def trouble(self) -> str | None:
        """Why alarms are not taken, as a sentence for the page; None: they are, or it is too early to tell."""
        if self.failures < _TROUBLE:
            return None
        return f"alarms cannot be delivered by {self._channel} ({self._why}); they are kept and tried again"

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End; what was not told yet stays in the store."""
        self._stopping.set()
        self._thread.join(timeout=10.0)

    def _run(self) -> None:
        wait = _LOOK_S
        while not self._stopping.wait(wait):
            wait = _LOOK_S
            if not self._may():
                continue
            try:
                for row, message in self._store.outbox(self._channel):
                    told = self._told(message)
                    self._store.delivered([row])
                    self.delivered += told
            except Exception as error:
                self.failures, self._why = self.failures + 1, _in_words(error)
                wait = min(_LONGEST_WAIT_S, _LOOK_S * 2.0 ** min(self.failures, 10))
                expected = isinstance(error, OSError | StoreDown)
                _log.warning(
                    "%s: an alarm was not taken (%s); trying again", self._channel, type(error).__name__,
                    exc_info=not expected,
                )  # fmt: skip
            else:
                self.failures = 0

    def _told(self, message: dict[str, Any]) -> bool:
        """Deliver a message; False where it was refused once too often and stands in the log alone."""
        try:
            self._deliver(message)
        except Refused as error:
            number = message["delivery"]
            self._refusals[number] = self._refusals.get(number, 0) + 1
            if self._refusals[number] < _REFUSALS:
                raise
            _log.error("%s: an alarm was refused (%s) and is told nowhere but here: %s", self._channel, error, message)
            return False
        return True
