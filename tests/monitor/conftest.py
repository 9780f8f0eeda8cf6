"""A monitor with the fake diagnoser: store, engine and page, as its service puts them together."""

from __future__ import annotations

import socket
import threading
import time
from dataclasses import dataclass

import pytest
import uvicorn

from monitor.engine import Arrival, Engine
from monitor.outputs.metrics import Metrics
from monitor.settings import Access
from monitor.store import Store
from monitor.web.access import Gate
from monitor.web.api import Api
from monitor.web.app import make_app
from monitor.web.hub import Hub
from tests.monitor.fakes import PLAN, FakeDiagnoser, block

WAIT_S = 120.0


@dataclass
class Running:
    """A monitor that runs, and its application."""

    store: Store
    engine: Engine
    app: object
    hub: Hub
    api: Api
    diagnoser: FakeDiagnoser
    sent: int = 0
    considered: int = 0

    def send(self, turns: int, level: float = 1.0, machine: str = "press-1", **more) -> None:
        """So many turns more of a machine; returns when they are committed."""
        done = threading.Event()
        for place in range(turns):
            first = self.sent + 100 * place
            one = block(first, 100, level=level, machine=machine, sequence=first, begins=True, **more)
            assert self.engine.offer(Arrival(one, kept=done.set if place == turns - 1 else None), timeout=WAIT_S)
        self.sent += 100 * turns
        assert done.wait(WAIT_S)


def running(tmp_path, access: Access | None = None, local: bool = True, **more):
    """A monitor in a folder."""
    store, hub, diagnoser = Store(f"sqlite:///{tmp_path}/monitor.sqlite"), Hub(), FakeDiagnoser()
    engine = Engine(store, diagnoser, PLAN, changed=hub.tell, **more)
    api = Api(store, engine, diagnoser, PLAN, hub, Gate(access or Access()))
    engine.start()
    return Running(store, engine, make_app(api, Metrics(engine, store), local, "127.0.0.2"), hub, api, diagnoser)


@pytest.fixture
def monitor(tmp_path):
    one = running(tmp_path)
    yield one
    one.engine.stop()
    one.store.close()


@pytest.fixture
def served(monitor):
    """The monitor, and the address of its page on this host."""
    listener = socket.create_server(("127.0.0.1", 0))
    config = uvicorn.Config(monitor.app, log_level="error", timeout_graceful_shutdown=1, ws="none")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    until = time.monotonic() + WAIT_S
    while not server.started:
        assert time.monotonic() < until
        time.sleep(0.01)
    yield monitor, f"http://127.0.0.1:{listener.getsockname()[1]}"
    server.should_exit = True
    thread.join(WAIT_S)
