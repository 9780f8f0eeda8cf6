"""The built-in broker (amqtt): MQTT 3.1.1 on this host alone, so that a first try needs no other program."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading

from indexer_env.errors import refuse

HOST = "127.0.0.1"


class BuiltInBroker:
    """Listens on localhost from `start` to `stop`, at any port that is free where `port` is 0."""

    def __init__(self, port: int) -> None:
        self.port = port or _free_port()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._stop = asyncio.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="broker", daemon=True)

    def start(self) -> None:
        """Begin; raises ParameterError where the port is taken."""
        # A port that is taken is told below; its own words for it are a traceback.
        _listen_to_it(logging.CRITICAL)
        self._thread.start()
        self._ready.wait(timeout=30.0)
        if self._failure is not None:
            raise refuse("monitor", "broker_port", "a free port of this host", self.port, "choose another") from None
        _listen_to_it(logging.ERROR)

    def stop(self) -> None:
        """End."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(timeout=10.0)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except BaseException as error:
            self._failure = error
        finally:
            self._ready.set()
            self._loop.close()

    async def _serve(self) -> None:
        from amqtt.broker import Broker

        class Closing(Broker):
            """Closes each connection, also one that was reset or said nothing, which amqtt leaves open."""

            async def stream_connected(
                self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, listener_name: str
            ) -> None:
                try:
                    await super().stream_connected(reader, writer, listener_name)
                finally:
                    writer.close()

        broker = Closing(
            {
                "listeners": {"default": {"type": "tcp", "bind": f"{HOST}:{self.port}"}},
                "plugins": {"amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}},
            }
        )
        await broker.start()
        self._ready.set()
        await self._stop.wait()
        await broker.shutdown()
        # What still waits for a client would be left pending, with an open socket, when the loop closes.
        waiting = asyncio.all_tasks() - {asyncio.current_task()}
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)


def _listen_to_it(level: int) -> None:
    for name in ("amqtt", "transitions"):
        logging.getLogger(name).setLevel(level)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]
