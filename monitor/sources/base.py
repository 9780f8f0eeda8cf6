"""What every source has."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

from monitor.engine import Engine

_log = logging.getLogger(__name__)


class Source(ABC):
    """Hands blocks to the engine until it is stopped.

    Attributes
    ----------
    name : str
        As /metrics and messages call it, without passwords.
    trouble : str or None
        Why no samples can come at present, as a sentence for the page.
    told : callable
        Called when that has changed.
    """

    name: str

    def __init__(self) -> None:
        self.trouble: str | None = None
        self.told: Callable[[], None] = lambda: None
        self.stopping = threading.Event()
        self.failure: BaseException | None = None
        self._thread: threading.Thread | None = None

    def start(self, engine: Engine) -> None:
        """Begin; returns at once."""
        self._thread = threading.Thread(target=self._guarded, args=(engine,), name=self.name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self.stopping.set()
        if self._thread is not None:
            self._thread.join(timeout=10.0)

    @abstractmethod
    def run(self, engine: Engine) -> None:
        """Hand over blocks until `stopping` is set or there are no more."""

    def tell(self, trouble: str | None) -> None:
        """What keeps samples from coming, in the log and on the page; None: nothing any more."""
        if trouble == self.trouble or self.stopping.is_set():
            return
        self.trouble = trouble
        if trouble is not None:
            _log.warning("%s", trouble)
        self.told()

    def _guarded(self, engine: Engine) -> None:
        try:
            self.run(engine)
        except BaseException as error:
            self.failure = error
            _log.exception("the source %s has stopped", self.name)
            self.tell(f"the source {self.name} has stopped: {error}")
