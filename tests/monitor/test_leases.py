"""Several processes on one store: each machine is one's, none of its turns is lost or doubled when one dies."""

import threading
import time

import pytest

from monitor.engine import Arrival, Engine
from monitor.leases import Leases
from monitor.outputs.outbox import Sender
from monitor.store import Store
from tests.monitor.conftest import WAIT_S
from tests.monitor.fakes import PLAN, FakeDiagnoser, block

MACHINES = tuple(f"m{k}" for k in range(4))
SECONDS = 1.5


class Process:
    """An engine as a process of its own would have it; its death is that it does and gives back nothing any more."""

    def __init__(self, url, name, **more):
        self.store = Store(url)
        self.leases = Leases(self.store, name, SECONDS)
        self.told = []
        self.engine = Engine(self.store, FakeDiagnoser(), PLAN, leases=self.leases, changed=self.told.append, **more)
        self.engine.start()

    @property
    def mine(self):
        return set(self.engine._fleet.pipelines)

    def die(self):
        self.engine.stop()
        self.store.close()


class Plant:
    """Sends the blocks of all machines to every process, as a broker does."""

    def __init__(self, *processes):
        self.processes, self.sent = processes, 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._stop.wait(0.04):
            for machine in MACHINES:
                for process in self.processes:
                    process.engine.offer(Arrival(block(50 * self.sent, machine=machine, sequence=self.sent)), 1.0)
            self.sent += 1

    def stop(self):
        self._stop.set()
        self._thread.join(WAIT_S)


def wait_for(condition):
    until = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def check(store, sent):
    """Every turn of every machine once, and no gap."""
    for machine in MACHINES:
        wait_for(lambda machine=machine: (store.summary(machine) or {}).get("turns") == sent // 2)
        turns = sorted((turn["number"], turn["start_ns"]) for turn in store.turns(machine, count=10_000))
        assert [number for number, _ in turns] == list(range(1, sent // 2 + 1))
        assert len({start for _, start in turns}) == len(turns)
        assert not {"gap", "double", "late"} & set(store.summary(machine)["active_states"])


def lives_and_deaths(url):
    """Two share, one dies, the other takes over, a third comes and gets its share."""
    one, two = Process(url, "one"), Process(url, "two")
    wait_for(lambda: one.leases.share(4) == two.leases.share(4) == 2)
    plant = Plant(one, two)
    wait_for(lambda: len(one.mine) == len(two.mine) == 2 and one.mine | two.mine == set(MACHINES))
    wait_for(lambda: plant.sent > 20)
    plant.processes = (two,)
    one.die()
    wait_for(lambda: two.mine == set(MACHINES))
    three = Process(url, "three")
    plant.processes = (two, three)
    wait_for(lambda: len(two.mine) == len(three.mine) == 2)
    sent = plant.sent
    wait_for(lambda: plant.sent > sent + 20)
    plant.stop()
    check(two.store, plant.sent)
    assert any(not change.own for change in three.told), "what the other does comes to this one's page"
    for process in (two, three):
        assert process.engine.failure is None
        process.die()


def test_a_process_that_dies_costs_no_turn(tmp_path):
    lives_and_deaths(f"sqlite:///{tmp_path}/monitor.sqlite")


def test_one_that_was_away_too_long_writes_nothing_and_begins_from_what_is_stored(tmp_path):
    url = f"sqlite:///{tmp_path}/monitor.sqlite"
    one = Process(url, "one")
    for place in range(10):
        one.engine.offer(Arrival(block(50 * place, machine="m0", sequence=place)))
    wait_for(lambda: (one.store.summary("m0") or {}).get("turns") == 5)
    other = Leases(one.store, "other", SECONDS)
    with one.store.transaction() as connection:
        assert not other.take(connection, "m0") and other.take(connection, "m0", force=True)
        assert not one.leases.keep(connection, "m0")
    for place in range(10, 14):
        one.engine.offer(Arrival(block(50 * place, machine="m0", sequence=place)))
    wait_for(lambda: one.engine.blocks == 14)
    assert one.store.summary("m0")["turns"] == 5 and not one.mine
    other.release(["m0"])
    wait_for(lambda: one.store.summary("m0")["turns"] == 7)
    one.die()


def test_who_acts_on_a_machine_takes_it_over(tmp_path):
    url = f"sqlite:///{tmp_path}/monitor.sqlite"
    one, two = Process(url, "one"), Process(url, "two")
    wait_for(lambda: one.leases.share(2) == two.leases.share(2) == 1)
    for place in range(20):
        one.engine.offer(Arrival(block(50 * place, machine="m0", level=5.0, sequence=place)))
    wait_for(lambda: (one.store.summary("m0") or {}).get("level") == "alert")
    two.engine.command("m0", "backlash_deg", lambda p: p.conditions["backlash_deg"].acknowledge(p.until_ns, "me"))
    assert "m0" in two.mine and two.store.events("m0")[0]["kind"] == "acknowledged"
    one.die()
    two.die()


def test_of_several_processes_one_tells(tmp_path):
    store = Store(f"sqlite:///{tmp_path}/monitor.sqlite")
    one, two = (Leases(store, name, SECONDS) for name in ("one", "two"))
    one.renew([])
    two.renew([])
    assert (one.leads, two.leads) == (True, False)
    one.end()
    two.renew([])
    assert two.leads
    sender = Sender(store, "webhook", lambda message: pytest.fail("told"), lambda: False)
    with store.transaction() as connection:
        from sqlalchemy import insert

        from monitor.store.schema import OUTBOX

        connection.execute(insert(OUTBOX).values(channel="webhook", content="{}"))
    sender.start()
    time.sleep(1.0)
    sender.stop()
    assert len(store.outbox("webhook")) == 1 and sender.failures == 0
    store.close()
