"""Turns in files, and how long they and their findings are kept."""

import shutil
from dataclasses import replace

import pytest
from sqlalchemy import select, update

from monitor.service import Service
from monitor.settings import settings_of
from monitor.store import Store
from monitor.store.archive import archive, archived, expire, folder_name, forgotten
from monitor.store.schema import ARCHIVE
from monitor.web.views import record_of
from tests.monitor.fakes import PLAN, START_NS, FakeDiagnoser
from tests.monitor.test_engine import make, numbers, send
from tests.monitor.test_service import config


@pytest.fixture
def url(tmp_path):
    return f"sqlite:///{tmp_path}/monitor.sqlite"


def test_turns_move_to_files_whole_and_are_forgotten_in_time(url, tmp_path, caplog):
    store, engine = make(url)
    for second in range(30):
        send(engine, 100 * second, 100 * second + 100, level=1.0 + 3.0 * (second > 20))
    engine.stop()
    before = {number: record_of(store, "m", number)[0] for number in numbers(store)}
    assert archive(store, file_turns=8) == 1
    for number, record in before.items():
        after = record_of(store, "m", number)
        assert after is not None and (after[0] == record).all(), number
    assert store.raw("m", 3) is None and store.raw("m", 1) is not None, "the reference stays"
    (file,) = (tmp_path / "turns").rglob("*.parquet")
    assert archived(file, 999) is None and not caplog.records
    whole = file.read_bytes()
    turned = bytearray(whole)
    turned[len(whole) // 2] ^= 1
    for damaged in (whole[:-20], bytes(turned)):
        file.write_bytes(damaged)
        caplog.clear()
        assert record_of(store, "m", 3) is None and f"cannot be read from {file}" in caplog.text
    later = START_NS + 10**12
    expire(store, later, 10**9, 2 * 10**12)
    assert record_of(store, "m", 3) is None and not file.exists() and numbers(store) == list(range(1, 31))


def test_records_that_are_kept_for_good_keep_their_turns_and_old_machines_what_they_told_last(url):
    """Samples of last year must not be forgotten as soon as they are told: time counts from the newest turn."""
    store, engine = make(url)
    send(engine, 0, 3000)
    engine.stop()
    assert archive(store, file_turns=8) == 1
    expire(store, START_NS + 10**18, 10**12, 10**12)
    assert numbers(store) == list(range(1, 31)) and record_of(store, "m", 3) is not None
    expire(store, START_NS + 10**18, 10**12, 4 * 10**9)
    assert numbers(store) == [1, *range(26, 31)] and store.reference("m", "60 rpm", 30) == 1
    store.close()


def test_records_that_are_in_no_file_yet_are_forgotten_in_time_too(url):
    """One a day would wait a year and more for a file."""
    store, engine = make(url)
    send(engine, 0, 3000)
    engine.stop()
    expire(store, START_NS + 30 * 10**9, 5 * 10**9, 10**12)
    kept = [number for number in numbers(store) if record_of(store, "m", number) is not None]
    assert numbers(store) == list(range(1, 31)) and kept == [1, *range(25, 31)], "the first is the healthy one"
    store.close()


@pytest.mark.parametrize("whole", [False, True], ids=["as now", "as older stores say it"])
def test_a_folder_that_was_copied_or_moved_has_its_own_records_and_no_others(tmp_path, whole):
    store, engine = make(f"sqlite:///{tmp_path}/a/monitor.sqlite")
    send(engine, 0, 3000)
    engine.stop()
    archive(store, file_turns=8)
    if whole:
        with store.transaction() as connection:
            (file,) = connection.execute(select(ARCHIVE.c.file)).scalars()
            connection.execute(update(ARCHIVE).values(file=str(tmp_path / "a" / file)))
    store.close()
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    copy, (own,) = Store(f"sqlite:///{tmp_path}/b/monitor.sqlite", tmp_path / "b"), (tmp_path / "b").rglob("*.parquet")
    expire(copy, START_NS + 10**12, 0, 10**12)
    copy.close()
    assert not own.exists()
    (tmp_path / "a").rename(tmp_path / "c")
    moved = Store(f"sqlite:///{tmp_path}/c/monitor.sqlite", tmp_path / "c")
    assert record_of(moved, "m", 3) is not None
    moved.close()


def test_no_two_machines_share_a_folder():
    names = ["press 1", "press_1", "press.1", "Press 1"]
    assert len({folder_name(name).lower() for name in names}) == len(names)


def test_a_machine_is_forgotten_with_all_that_is_stored_of_it_and_no_other(url, tmp_path):
    store, engine = make(url)
    for machine in ("m", "n"):
        for second in range(30):
            send(engine, 100 * second, 100 * second + 100, machine=machine, level=1.0 + 3.0 * (second > 20))
    engine.stop()
    assert archive(store, file_turns=8) == 2
    assert forgotten(store, "o") == "There is no machine 'o' to forget; known are: m, n."
    before = store.counts()
    assert forgotten(store, "m") == "The machine 'm' is forgotten, with 30 turns."
    assert [one["machine"] for one in store.machines()] == ["n"]
    after = store.counts()
    for table in ("turn", "block", "raw", "event", "archive", "machine"):
        assert after[table] == before[table] / 2 > 0, table
    (file,) = (tmp_path / "turns").rglob("*.parquet")
    assert folder_name("n") in file.parts and record_of(store, "n", 3) is not None
    assert numbers(store) == [] and store.events("m") == []
    store.close()


def test_a_start_forgets_the_machines_that_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.service.diagnoser_of", lambda given: (FakeDiagnoser(), replace(given, plan=PLAN)))
    (tmp_path / "logger").mkdir()
    (tmp_path / "kept").mkdir()
    store, engine = make(f"sqlite:///{tmp_path}/kept/monitor.sqlite")
    send(engine, 0, 200)
    engine.stop()
    store.close()
    given = [f"source=folder:{tmp_path}/logger", "model=m", f"out={tmp_path}/kept", "port=0", "forget=[m,press-9]"]
    said = []
    service = Service(settings_of(config(*given)), say=said.append)
    assert service._store.machines() == [] and not service.engine._fleet.pipelines
    assert said[:2] == [
        "The machine 'm' is forgotten, with 2 turns.",
        "There is no machine 'press-9' to forget; known are: none.",
    ]
    service._closing.close()
