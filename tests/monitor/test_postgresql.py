"""PostgreSQL as the store, and its kill -9 while samples come."""

import random
import tempfile
import time
from pathlib import Path

import pytest
from sqlalchemy import insert

from benchmarks.monitor.programs import INITDB, POSTGRES, Database
from monitor.engine import Arrival, Engine
from monitor.store import Store
from monitor.store.schema import EVENT
from monitor.store.store import write_position
from tests.monitor.conftest import WAIT_S
from tests.monitor.fakes import PLAN, FakeDiagnoser, block
from tests.monitor.test_leases import lives_and_deaths

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(INITDB is None or POSTGRES is None, reason="needs PostgreSQL: apt-get install postgresql"),
]


@pytest.fixture
def database():
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        one = Database(Path(folder))
        one.start()
        yield one
        one.end()


def reached(url) -> Store:
    until = time.monotonic() + WAIT_S
    while True:
        try:
            return Store(url)
        except Exception:
            assert time.monotonic() < until
            time.sleep(0.2)


def test_several_processes_share_its_machines_and_one_may_die(database):
    reached(database.url).close()
    lives_and_deaths(database.url)


def test_kills_of_the_database_lose_and_double_no_turn(database, monkeypatch):
    monkeypatch.setattr("monitor.engine._RETRY_S", 0.1)
    store, kills = reached(database.url), 8
    engine = Engine(store, FakeDiagnoser(), PLAN)
    engine.start()
    dice, kept, sent = random.Random(2), [], 0

    def offered(number: int) -> int:
        arrival = Arrival(block(50 * number, level=1 + number / 100, sequence=number), kept=lambda: kept.append(1))
        assert engine.offer(arrival, timeout=WAIT_S)
        return number + 1

    for _ in range(kills):
        before, until, patience = len(kept), time.monotonic() + dice.uniform(0.1, 0.6), time.monotonic() + WAIT_S
        # Some blocks are always on their way, and some have come through since the kill before.
        while time.monotonic() < until or len(kept) == before:
            assert time.monotonic() < patience
            if sent - len(kept) < 20:
                sent = offered(sent)
            time.sleep(0.005)
        database.kill()
        # and some come while it is down, however fast the others were kept
        sent = offered(sent)
        database.start()
    until = time.monotonic() + WAIT_S
    while len(kept) < sent:
        assert time.monotonic() < until and engine.failure is None
        time.sleep(0.05)
    engine.stop()
    turns = sorted((turn["number"], turn["start_ns"]) for turn in store.turns("m", count=100_000))
    assert [number for number, _ in turns] == list(range(1, sent // 2 + 1))
    assert len({start for _, start in turns}) == len(turns)
    assert engine.retries > 0
    store.close()


def test_what_users_name_may_be_of_any_length(database):
    """PostgreSQL refuses what is longer than its column, and the monitor would try for ever."""
    store, item = reached(database.url), "logger/" + "sub/" * 200 + "turn.csv"
    with store.transaction() as connection:
        write_position(connection, "folder:" + "x" * 300, item, "done")
        connection.execute(
            insert(EVENT).values(
                machine="m", time_ns=0, turn=1, quantity="worn " * 30, kind="raised", level="alarm", content="{}"
            )
        )
    assert store.positions("folder:" + "x" * 300) == {item: "done"} and len(store.events("m")) == 1
    store.close()
