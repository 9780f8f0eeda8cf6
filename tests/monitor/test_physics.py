"""Physics behind the networks: when it is asked, that nothing waits for it, and what is kept of its answers."""

import threading
import time
from typing import ClassVar

import numpy as np
import pytest
from pyarrow.lib import ArrowInvalid

import monitor.physics as physics
from monitor.engine import Arrival
from monitor.physics import Physics, Question, answer_to
from monitor.store import Store
from tests.monitor.conftest import WAIT_S, running
from tests.monitor.fakes import FAST, block
from tests.monitor.twins import LOAD, RATE, turns, twin_folder


class FakeWorker:
    """Answers once it may; `asked` holds its questions."""

    asked: ClassVar[list[Question]] = []
    may = threading.Event()
    answers = True

    def ask(self, question):
        self.asked.append(question)
        self.may.wait(WAIT_S)
        return {"headline": "Faulty: play."} if self.answers else None

    def end(self):
        self.may.set()


@pytest.fixture
def watched(tmp_path, monkeypatch):
    """A monitor whose changes go to physics with a fake process."""
    monkeypatch.setattr(physics, "_Worker", FakeWorker)
    FakeWorker.asked, FakeWorker.answers = [], True
    FakeWorker.may.set()
    told = []
    one = running(tmp_path)

    def make(every_h=1000.0):
        made = Physics(one.store, tmp_path, LOAD, (FAST,), every_h, 0.5, None, told.append)
        made.start()

        def consider(change):
            made.consider(change)
            one.considered = change.summary["turns"]

        one.engine._changed = consider
        return made

    yield one, make, told
    one.engine.stop()
    one.store.close()


def wait_for(condition):
    until = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.parametrize(("pulse", "stated"), [(True, 0.3), (False, None)])
def test_turns_that_a_pulse_cut_begin_at_its_angle(watched, pulse, stated):
    monitor, make, _ = watched
    one = make()
    one._pulse_angle = 0.3
    for first in range(0, 600, 50):
        assert monitor.engine.offer(Arrival(block(first, machine="press-1", pulse=pulse)), timeout=WAIT_S)
    wait_for(lambda: one.answers == 1)
    assert FakeWorker.asked[0].start_angles == (stated,) * 3


def test_a_machine_is_looked_at_at_first_and_when_an_alarm_is_raised(watched):
    monitor, make, told = watched
    one = make()
    monitor.send(4, 1.0)
    wait_for(lambda: one.answers == 1)
    monitor.send(3, 1.0)
    wait_for(lambda: monitor.considered == 7)
    assert len(FakeWorker.asked) == 1 and not one.waiting, "nothing has moved"
    monitor.send(6, 5.0)
    wait_for(lambda: one.answers == 2)
    question = FakeWorker.asked[-1]
    assert len(question.records) == physics.TURNS and question.rate == FAST.rate and question.load_torque == LOAD
    assert np.sqrt(np.mean(question.records[0] ** 2)) == pytest.approx(5.0, rel=0.01), "the newest turns"
    kept = monitor.store.explanations("press-1")
    assert [answer["headline"] for answer in kept] == ["Faulty: play."] * 2 and kept[0]["turn"] > kept[1]["turn"]
    assert told[-1].summary["machine"] == "press-1"
    one.stop()


def test_it_is_asked_again_after_its_time_and_remembers_when_that_was(watched, tmp_path):
    monitor, make, _ = watched
    one = make(every_h=1e-9)
    monitor.send(3, 1.0)
    wait_for(lambda: one.answers >= 1)
    monitor.send(1, 1.0)
    wait_for(lambda: one.answers >= 2)
    one.stop()
    again = make(every_h=1000.0)
    asked = len(FakeWorker.asked)
    monitor.send(3, 1.0)
    time.sleep(0.3)
    assert len(FakeWorker.asked) == asked, "the store knows that it was looked at just now"
    again.stop()


def test_a_record_that_cannot_be_read_ends_nothing(watched, monkeypatch):
    monitor, make, _ = watched
    tried = []

    def truncated(*_):
        tried.append(True)
        raise ArrowInvalid("Parquet magic bytes not found in footer")

    one = make()
    with monkeypatch.context() as patched:
        patched.setattr(physics, "record_of", truncated)
        monitor.send(4, 1.0)
        wait_for(lambda: tried)
    monitor.send(6, 5.0)
    wait_for(lambda: one.answers == 1)
    one.stop()


def test_the_stream_does_not_wait_and_what_waits_is_bounded(watched):
    monitor, make, _ = watched
    one = make(every_h=1e-9)
    FakeWorker.may.clear()
    monitor.send(100, 1.0)
    monitor.send(100, 1.0, machine="press-2")
    assert monitor.store.summary("press-1")["turns"] == monitor.store.summary("press-2")["turns"] == 100
    assert len(FakeWorker.asked) <= 1 and one.waiting <= 2
    FakeWorker.may.set()
    wait_for(lambda: one.answers >= 2)
    one.stop()


def test_a_process_that_ended_is_told_and_replaced(watched):
    monitor, make, _ = watched
    one = make()
    FakeWorker.answers = False
    monitor.send(4, 1.0)
    wait_for(lambda: one.answers == 1)
    assert "has ended" in monitor.store.explanations("press-1")[0]["problem"]
    FakeWorker.answers = True
    monitor.send(6, 5.0)
    wait_for(lambda: one.answers == 2)
    assert monitor.store.explanations("press-1")[0]["headline"]
    one.stop()


def test_a_dead_sensor_is_nothing_for_physics(watched):
    monitor, make, _ = watched
    one = make()
    monitor.send(8, 0.0)
    time.sleep(0.3)
    assert not FakeWorker.asked
    one.stop()


def test_answers_are_forgotten_with_the_findings_of_turns(tmp_path):
    from monitor.store.archive import expire

    store = Store(f"sqlite:///{tmp_path}/monitor.sqlite")
    for time_ns in (10, 20):
        store.write_explanation("m", 1, time_ns, {"level": float("inf")})
    expire(store, 15, 0, 0)
    (kept,) = store.explanations("m")
    assert kept["time_ns"] == 20 and kept["level"] is None and store.explained() == {"m": 20}
    store.close()


def test_records_that_are_none_get_a_sentence(tmp_path):
    folder = twin_folder(tmp_path / "twin")
    noise = np.random.default_rng(0).standard_normal(4100)
    told = answer_to(Question(folder, LOAD, (157.08,) * 2, RATE, "rad/s^2", None, (None, None), (noise, noise)))
    assert "Not comparable" in told["headline"]
    assert (
        "twin.yaml"
        in answer_to(Question(tmp_path, LOAD, (157.08,), RATE, "rad/s^2", None, (None,), (noise,)))["problem"]
    )


def test_physics_sees_a_record_as_at_the_radius_of_the_twins_sensor(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr("twin.diagnose.diagnosed", lambda twin, records, physics: seen.extend(records) or 1 / 0)
    noise = np.random.default_rng(0).standard_normal(4100)
    with pytest.raises(ZeroDivisionError):
        answer_to(Question(twin_folder(tmp_path / "twin"), LOAD, (157.08,), RATE, "m/s^2", 0.5, (None,), (noise,)))
    assert [record.conditions.sensor_radius for record in seen] == [0.5]


@pytest.mark.slow
def test_a_process_of_its_own_names_the_play_and_its_kill_is_survived(tmp_path):
    record = turns(3, "reducer_play", 0.25)
    folder = twin_folder(tmp_path / "twin")
    pieces = tuple(record.values.reshape(3, -1))
    question = Question(folder, LOAD, (1500.0 * np.pi / 30.0,) * 3, RATE, "rad/s^2", None, (None,) * 3, pieces)
    worker = physics._Worker()
    told = worker.ask(question)
    assert told is not None and told["verdict"] == "faulty"
    (play,) = [fault for fault in told["faults"] if fault["name"] == "reducer_play"]
    assert play["size"] == pytest.approx(5.0, abs=0.3) and "play in the reducer" in told["headline"]
    worker._process.kill()
    assert worker.ask(question) is None
    worker.end()


def test_a_machine_that_was_looked_at_in_vain_is_looked_at_again(watched):
    """Three turns are there, of which physics can use two: it was silent for its whole time then."""
    monitor, make, _ = watched
    one = make()
    monitor.send(1, 0.0)
    monitor.send(2, 1.0)
    wait_for(lambda: monitor.considered == 3 and not one.waiting)
    assert FakeWorker.asked == []
    monitor.send(1, 1.0)
    wait_for(lambda: one.answers == 1)
    one.stop()


def test_while_physics_looks_at_a_machine_this_is_not_asked_for_again(watched):
    monitor, make, _ = watched
    FakeWorker.may.clear()
    one = make()
    monitor.send(3, 1.0)
    wait_for(lambda: FakeWorker.asked)
    monitor.send(2, 1.0)
    wait_for(lambda: monitor.considered == 5)
    assert not one.waiting
    FakeWorker.may.set()
    one.stop()
