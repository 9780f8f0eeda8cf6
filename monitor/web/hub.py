"""What changed -> every open page, by server-sent events."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from indexer_cli.json_values import finite
from monitor.plan import Change

MOST_PAGES = 100
_WAITING = 200
_ALIVE_S = 15.0
_AGAIN = "event: again\ndata: {}\n\n"


class Hub:
    """Hands each change to all pages; one that does not keep up is told to load anew."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._pages: set[asyncio.Queue[str | None]] = set()

    def open(self) -> None:
        """Begin, in the loop of the server."""
        self._loop = asyncio.get_running_loop()

    def close(self) -> None:
        """End all streams."""
        for page in self._pages:
            _put(page, None)

    @property
    def pages(self) -> int:
        """Pages that listen."""
        return len(self._pages)

    def tell(self, change: Change) -> None:
        """A change, from any thread."""
        if self._loop is not None and not self._loop.is_closed() and self._pages:
            text = _event("machine", change.summary)
            self._loop.call_soon_threadsafe(self._spread, text)

    def _spread(self, text: str) -> None:
        for page in self._pages:
            _put(page, text)

    def again(self) -> None:
        """Something beside the machines has changed, from any thread: all pages load anew."""
        if self._loop is not None and not self._loop.is_closed() and self._pages:
            self._loop.call_soon_threadsafe(self._spread, _AGAIN)

    async def listen(self) -> AsyncIterator[str]:
        """The stream of one page."""
        page: asyncio.Queue[str | None] = asyncio.Queue(_WAITING)
        self._pages.add(page)
        try:
            yield "retry: 1000\nevent: hello\ndata: {}\n\n"
            while True:
                try:
                    text = await asyncio.wait_for(page.get(), _ALIVE_S)
                except TimeoutError:
                    text = ": alive\n\n"
                if text is None:
                    return
                yield text
        finally:
            self._pages.discard(page)


def _put(page: asyncio.Queue[str | None], text: str | None) -> None:
    if page.full():
        while not page.empty():
            page.get_nowait()
        page.put_nowait(_AGAIN)
    page.put_nowait(text)


def _event(name: str, body: dict[str, Any]) -> str:
    return f"event: {name}\ndata: {json.dumps(finite(body), separators=(',', ':'))}\n\n"
