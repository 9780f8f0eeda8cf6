"""What is committed is there once; what is told goes out; a database that breaks off costs time and nothing else."""

import queue
import random
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import select
from sqlalchemy.exc import TimeoutError as PoolTimeout

from indexer_env.errors import ParameterError
from monitor.engine import Arrival, Engine
from monitor.intake.arrivals import Batches
from monitor.outputs.outbox import forget_others
from monitor.sources.replay import ReplaySource
from monitor.store import Store, StoreDown
from monitor.store.schema import RAW
from monitor.store.store import StoreError
from tests.monitor.fakes import PLAN, FakeDiagnoser, block
from tests.patience import PATIENCE


@pytest.fixture
def url(tmp_path):
    return f"sqlite:///{tmp_path}/monitor.sqlite"


def make(url, **more):
    store = Store(url, Path(url.removeprefix("sqlite:///")).parent)
    engine = Engine(store, FakeDiagnoser(), PLAN, **more)
    engine.start()
    return store, engine


def wait_for(condition):
    until = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < until, "it has not come about"
        time.sleep(0.01)


def numbers(store, machine="m"):
    return sorted(turn["number"] for turn in store.turns(machine, count=1000))


def send(engine, first, last, **more):
    kept = []
    for place in range(first, last, 50):
        assert engine.offer(
            Arrival(block(place, **more), kept=lambda place=place: kept.append(place)), timeout=PATIENCE
        )
    wait_for(lambda: len(kept) == len(range(first, last, 50)))


def test_turns_events_and_samples_are_committed(url):
    store, engine = make(url, channels=("webhook",))
    for second in range(12):
        send(engine, 100 * second, 100 * second + 100, level=1.0 + second)
    engine.stop()
    assert numbers(store) == list(range(1, 13))
    assert [event["level"] for event in reversed(store.events())] == ["alert", "alarm"]
    assert [message["level"] for _, message in store.outbox("webhook")] == ["alert", "alarm"]
    assert store.summary("m")["level"] == "alarm"
    record, rate, unit = store.raw("m", 3)
    assert record.size == 100 and (rate, unit) == (100.0, "m/s^2")
    assert store.reference("m", "60 rpm", 1) == 1
    assert store.counts()["block"] <= 8, "samples that are used up are forgotten"
    store.close()


def test_batches_are_as_long_as_others_may_wait_for_the_store():
    """A twin may take seconds for a turn: 256 of them in one transaction would lock the page and the physics out."""
    waiting = queue.Queue()
    batches = Batches(waiting)
    for number in range(600):
        waiting.put(number)
    assert len(batches.next()) == 16
    batches.took(0.1)
    assert len(batches.next()) == 32
    for _ in range(5):
        batches.took(0.1)
    assert len(batches.next()) == 256
    for size in (128, 64):
        batches.took(3.0)
        assert len(batches.next()) == size
    for _ in range(9):
        batches.took(3.0)
    assert len(batches.next()) == 1


def test_the_engine_tells_how_long_a_batch_took(url, monkeypatch):
    monkeypatch.setattr("monitor.intake.arrivals._LONG_S", 0.0)
    store, engine = make(url)
    send(engine, 0, 500)
    engine.stop()
    assert engine._batches.size < 16 and numbers(store) == [1, 2, 3, 4, 5]
    store.close()


def test_no_two_alarms_have_the_same_delivery_number(url):
    store, engine = make(url, channels=("webhook", "mqtt"))
    seen = []
    for second in range(12):
        send(engine, 100 * second, 100 * second + 100, level=1.0 + second)
        for channel in ("webhook", "mqtt"):
            for row, message in store.outbox(channel):
                seen.append((channel, message["delivery"]))
                store.delivered([row])
    engine.stop()
    assert len(seen) == len(set(seen)) == 4
    assert {number for _, number in seen} == {event["id"] for event in store.events()}
    store.close()


def test_a_store_that_is_away_is_not_said_to_be_back_before_it_answers(url, monkeypatch):
    """Nothing comes, the machine becomes stale, and what must be written cannot be."""
    store, engine = make(url, stale_s=0.2)
    send(engine, 0, 300)
    asked, away, machines = [], threading.Event(), store.machines

    def gone(*_):
        raise StoreDown("no route")

    def listed():
        asked.append(True)
        return gone() if away.is_set() else machines()

    away.set()
    monkeypatch.setattr("monitor.engine._RETRY_S", 0.01)
    monkeypatch.setattr(store, "machines", listed)
    transaction = store.transaction
    monkeypatch.setattr(store, "transaction", gone)
    wait_for(lambda: len(asked) >= 3)
    assert "no route" in engine.trouble
    with pytest.raises(StoreDown):
        engine.command("m", "crack", lambda pipeline: pytest.fail("there is none"))
    monkeypatch.setattr(store, "transaction", transaction)
    away.clear()
    wait_for(lambda: engine.trouble is None)
    assert "stale" in store.summary("m")["active_states"]
    engine.stop()
    store.close()


def test_an_event_tells_the_turn_that_raised_it_where_a_block_holds_several(url):
    store, engine = make(url, channels=("webhook",))
    send(engine, 0, 400)
    kept = threading.Event()
    assert engine.offer(Arrival(block(400, 1000, level=5.0), kept=kept.set), timeout=PATIENCE) and kept.wait(PATIENCE)
    engine.stop()
    (event,) = store.events()
    turns = {turn["number"]: turn for turn in store.turns("m")}
    cause = turns[event["turn"]]
    assert (event["kind"], max(turns)) == ("raised", 14) and event["turn"] < 14
    assert event["time_ns"] == cause["start_ns"] + round(cause["duration"] * 1e9)
    assert [message["turn"] for _, message in store.outbox("webhook")] == [event["turn"]]
    with store.transaction() as connection:
        kept_for_good = connection.execute(select(RAW.c.number).where(RAW.c.keep == "alarm")).scalars().all()
    assert kept_for_good == [event["turn"]]
    store.close()


def test_a_new_engine_goes_on_where_the_last_was(url):
    store, engine = make(url)
    send(engine, 0, 330)
    engine.stop()
    store.close()
    store, engine = make(url)
    send(engine, 200, 700)
    engine.stop()
    assert numbers(store) == list(range(1, 8))
    states = store.summary("m")["states"]
    assert states["double"]["count"] == 3 and "gap" not in states
    store.close()


class Breaking(Store):
    """Breaks off at every fourth transaction or so, before or after the commit."""

    def __init__(self, url):
        self.dice, self.breaks = random.Random(4), False
        super().__init__(url)

    def transaction(self):
        return _Broken(self, super().transaction()) if self.breaks else super().transaction()


class _Broken:
    def __init__(self, store, inner):
        self.store, self.inner = store, inner

    def __enter__(self):
        return self.inner.__enter__()

    def __exit__(self, *error):
        dice = self.store.dice.random()
        if dice < 0.12:
            self.inner.__exit__(StoreDown, StoreDown("gone"), None)
            raise StoreDown("before the commit")
        done = self.inner.__exit__(*error)
        if dice > 0.88:
            raise StoreDown("after the commit")
        return done


def test_a_database_that_breaks_off_before_or_after_a_commit_loses_and_doubles_nothing(url, monkeypatch):
    monkeypatch.setattr("monitor.engine._RETRY_S", 0.01)
    store = Breaking(url)
    engine = Engine(store, FakeDiagnoser(), PLAN)
    engine.start()
    store.breaks = True
    for second in range(20):
        send(engine, 100 * second, 100 * second + 100, level=1.0 + second / 2)
    store.breaks = False
    engine.stop()
    assert engine.failure is None and engine.retries >= 5
    assert numbers(store) == list(range(1, 21))
    turns = store.turns("m", count=100)
    assert len({turn["start_ns"] for turn in turns}) == 20
    assert [event["level"] for event in reversed(store.events())] == ["alert", "alarm"]


def test_a_silent_machine_is_stale_and_one_whose_replay_ended_is_not(url):
    store, engine = make(url, stale_s=0.2)
    send(engine, 0, 200)
    wait_for(lambda: "stale" in store.summary("m")["active_states"])
    send(engine, 200, 400)
    wait_for(lambda: "stale" not in store.summary("m")["active_states"])
    engine.ended("m")
    count = store.summary("m")["states"]["stale"]["count"]
    time.sleep(1.2)
    assert store.summary("m")["states"]["stale"]["count"] == count
    engine.stop()


def test_a_full_queue_holds_the_source_up(url):
    store = Store(url)
    engine = Engine(store, FakeDiagnoser(), PLAN, queue_blocks=2)
    assert engine.offer(Arrival(block(0)), timeout=0.01) and engine.offer(Arrival(block(50)), timeout=0.01)
    assert not engine.offer(Arrival(block(100)), timeout=0.01)


def test_an_operator_s_act_is_committed_with_his_name(url):
    store, engine = make(url)
    send(engine, 0, 1000, level=5.0)
    act = lambda pipeline: pipeline.conditions["backlash_deg"].acknowledge(1, "eve", "seen")  # noqa: E731
    engine.command("m", "backlash_deg", act)
    with pytest.raises(ParameterError, match="acknowledge"):
        engine.command("m", "backlash_deg", act)
    with pytest.raises(ParameterError, match="machine"):
        engine.command("nobody", "backlash_deg", act)
    engine.stop()
    newest = store.events()[0]
    assert (newest["kind"], newest["user"], newest["note"]) == ("acknowledged", "eve", "seen")
    assert store.summary("m")["alarms"]["backlash_deg"]["acknowledged"]


def test_a_store_that_cannot_be_used_says_why_without_its_password(tmp_path):
    for url, word in (
        ("mysql://u:geheim@h/x", "sqlite"), ("nonsense", "sqlite"), ("sqlite://", "file"),
        ("postgresql://u@h:54x/n", "sqlite"), ("postgresql://u:a@b:geheim@h/n", "sqlite"),
    ):  # fmt: skip
        with pytest.raises(StoreError, match=word) as caught:
            Store(url)
        assert "geheim" not in str(caught.value)


def test_readers_and_the_writer_do_not_wait_for_each_other(url):
    store, engine = make(url)
    seen, stop = [], threading.Event()

    def read():
        while not stop.is_set():
            seen.append(len(store.turns("m")))

    reader = threading.Thread(target=read)
    reader.start()
    send(engine, 0, 3000)
    stop.set()
    reader.join()
    engine.stop()
    assert seen == sorted(seen) and engine.retries == 0


def test_a_replay_has_ended_once_its_last_block_is_kept(url, monkeypatch):
    """And not when it was handed over, after which blocks that still wait in the queue would begin it anew."""
    blocks = [block(place, start_ns=place * 10_000_000) for place in range(0, 600, 50)]
    monkeypatch.setattr("monitor.sources.replay.blocks_of", lambda folder: blocks)
    source = ReplaySource(Path("set"), 1e9)
    store = Store(url)
    engine = Engine(store, FakeDiagnoser(), PLAN)
    source.run(engine)
    assert "m" not in engine._ended, "nothing is kept yet"
    engine.start()
    wait_for(lambda: engine.blocks == len(blocks))
    wait_for(lambda: "m" in engine._ended)
    engine.stop()


def test_a_replay_goes_on_behind_the_last_row_that_was_kept(url, monkeypatch):
    blocks = [block(place, 100, start_ns=place * 10_000_000, begins=True) for place in range(0, 1000, 100)]
    monkeypatch.setattr("monitor.sources.replay.blocks_of", lambda folder: blocks)
    for rows, kept in ((4, 4), (6, 10), (6, 10)):
        store, engine = make(url)
        source, offer, offered = ReplaySource(Path("set"), 1e9), engine.offer, []

        def broken_off(arrival, timeout=None, rows=rows, source=source, offer=offer, offered=offered):
            if len(offered) == rows:
                source.stopping.set()
                return False
            offered.append(arrival)
            return offer(arrival, timeout)

        monkeypatch.setattr(engine, "offer", broken_off)
        source.run(engine)
        wait_for(lambda kept=kept, store=store: len(numbers(store)) >= kept - 1)
        wait_for(
            lambda kept=kept, store=store, source=source: store.positions(source.name)["rows"].endswith(f" {kept}")
        )
        engine.stop()
        starts = sorted(turn["start_ns"] for turn in store.turns("m"))
        store.close()
    assert not offered and "replayed to its end" in source.trouble and "m" in engine._ended
    assert len(starts) == len(set(starts)) and starts[-1] - starts[0] <= 9 * 10**9


def test_a_shelf_runs_out_while_no_turn_comes(url):
    store, engine = make(url, channels=("webhook",))
    send(engine, 0, 1000, level=5.0)
    shelve = lambda pipeline: pipeline.conditions["backlash_deg"].shelve(pipeline.time_at(time.time_ns()), 1e-5, "eve")  # noqa: E731
    engine.command("m", "backlash_deg", shelve)
    wait_for(lambda: store.events()[0]["kind"] == "unshelved")
    assert not store.summary("m")["alarms"]["backlash_deg"]["shelved"]
    engine.stop()
    assert [message["kind"] for _, message in store.outbox("webhook")] == ["raised", "unshelved"]
    store.close()


def test_an_alarm_of_what_is_watched_no_longer_ends_in_the_log(url):
    store, engine = make(url)
    send(engine, 0, 1000, level=5.0)
    engine.stop()
    for _ in range(2):
        engine = Engine(store, FakeDiagnoser(), replace(PLAN, limits={"crack": PLAN.limits["crack"]}))
        engine.start()
        wait_for(lambda: store.events()[0]["kind"] == "ended")
        time.sleep(0.6)
        engine.stop()
    assert [event["kind"] for event in store.events()] == ["ended", "raised"]
    assert "not watched" in store.events()[0]["note"] and store.summary("m")["level"] == "normal"
    store.close()


def test_silence_is_told_with_the_time_of_the_last_samples(url):
    """A duration would not be renewed."""
    store, engine = make(url, stale_s=0.2)
    send(engine, 0, 200)
    wait_for(lambda: "stale" in store.summary("m")["active_states"])
    engine.stop()
    assert store.summary("m")["states"]["stale"]["text"] == "no samples have come since 2027-01-15 08:00:02 UTC"
    store.close()


def test_a_repair_that_could_not_be_stored_has_not_been(url, monkeypatch):
    store, engine = make(url)
    send(engine, 0, 1000, level=5.0)
    engine.stop()
    pipeline = engine._fleet.pipelines["m"]
    before = pipeline.to_dict()
    repair = lambda pipeline: pipeline.watch.repair("backlash_deg", 1, "eve")  # noqa: E731

    def gone():
        raise StoreDown("no route")

    with monkeypatch.context() as broken, pytest.raises(StoreDown):
        broken.setattr(store, "transaction", gone)
        engine.command("m", "backlash_deg", repair)
    assert pipeline.to_dict() == before
    assert engine.command("m", "backlash_deg", repair).kind == "repaired"
    assert "backlash_deg" not in store.machine("m")[0]["trends"]["60 rpm"]
    store.close()


def test_a_database_without_a_free_connection_is_tried_again(url, monkeypatch):
    store = Store(url)

    def none_free():
        raise PoolTimeout("QueuePool limit of size 5 overflow 10 reached, connection timed out")

    monkeypatch.setattr(store._engine, "begin", none_free)
    with pytest.raises(StoreDown, match="QueuePool"):
        store.machines()


def test_what_waits_for_a_channel_that_is_switched_off_is_forgotten(url, caplog):
    store, engine = make(url, channels=("webhook", "mqtt"))
    send(engine, 0, 1000, level=5.0)
    engine.stop()
    with caplog.at_level("WARNING"):
        forget_others(store, ("mqtt",))
        forget_others(store, ("mqtt",))
    assert store.outbox("webhook") == [] and len(store.outbox("mqtt")) == 1
    assert caplog.text.count("are forgotten: 1") == 1
    forget_others(store, ())
    assert store.outbox("mqtt") == []
    store.close()
