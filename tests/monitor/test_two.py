"""Two monitors on one folder, and a store that refuses what is written."""

import threading
import urllib.request
from dataclasses import replace

import pytest
from sqlalchemy import text
from starlette.testclient import TestClient

from indexer_cli.places.local import LocalPlace
from indexer_env.errors import IndexerError
from monitor.engine import Arrival
from monitor.service import Service
from monitor.settings import settings_of
from monitor.store import StoreConflict, StoreDown
from tests.monitor.fakes import PLAN, FakeDiagnoser, block
from tests.monitor.test_service import config, wait_for


def started(tmp_path, monkeypatch):
    """The command of a monitor that watches a folder, the monitor, and the thread in which it runs."""
    monkeypatch.setattr("monitor.service.diagnoser_of", lambda given: (FakeDiagnoser(), replace(given, plan=PLAN)))
    (tmp_path / "logger").mkdir()
    given = [f"source=folder:{tmp_path}/logger", "model=m", f"out={tmp_path}/kept", "port=0"]
    service = Service(settings_of(config(*given)), say=lambda _: None)
    thread = threading.Thread(target=service.run, daemon=True)
    thread.start()
    wait_for(lambda: service._server.started)
    return given, service, thread


def test_a_second_monitor_on_the_same_folder_is_refused_until_the_first_has_ended(tmp_path, monkeypatch):
    given, first, thread = started(tmp_path, monkeypatch)
    with pytest.raises(IndexerError, match="no other run is writing to"):
        Service(settings_of(config(*given)))
    assert first._troubles() == []
    first.engine.trouble = "the store cannot be used (disk is full); trying again"
    assert first._troubles() == [first.engine.trouble]
    first.stop()
    thread.join(60.0)
    with LocalPlace(tmp_path / "kept").exclusive():
        pass


def test_the_end_of_the_monitor_lets_go_of_open_pages(tmp_path, monkeypatch, caplog):
    """The stream of a page has no end of its own, and a cancelled one fills the screen."""
    _, service, thread = started(tmp_path, monkeypatch)
    with urllib.request.urlopen(f"{service.url}events", timeout=60.0) as page:
        assert page.readline().startswith(b"retry")
        service.stop()
        thread.join(60.0)
        assert not thread.is_alive()
        page.read()
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_what_another_monitor_has_written_ends_the_monitor_and_is_not_tried_for_ever(monitor, monkeypatch):
    monkeypatch.setattr("monitor.engine._RETRY_S", 0.01)
    monitor.send(1)
    with monitor.store.transaction() as connection:
        connection.execute(
            text("INSERT INTO turn SELECT machine, 2, start_ns, duration, mode, problem, content FROM turn")
        )
    assert monitor.engine.offer(Arrival(block(100, 100, machine="press-1", sequence=100)), timeout=60.0)
    wait_for(lambda: monitor.engine.failure is not None)
    assert isinstance(monitor.engine.failure, StoreConflict)
    assert "another monitor has written to the store" in str(monitor.engine.failure)


def test_a_store_that_refuses_what_is_written_is_told_until_it_takes_it(monitor, monkeypatch):
    monkeypatch.setattr("monitor.engine._RETRY_S", 0.01)
    full, told = threading.Event(), []
    monitor.engine.told = lambda: told.append(monitor.engine.trouble)
    work = monitor.engine._work

    def refused(batch):
        if full.is_set():
            raise StoreDown("database or disk is full")
        work(batch)

    monkeypatch.setattr(monitor.engine, "_work", refused)
    with TestClient(monitor.app, base_url="http://localhost") as client:
        assert client.get("/health").status_code == 200
        full.set()
        assert monitor.engine.offer(Arrival(block(0, 100)), timeout=60.0)
        wait_for(lambda: told)
        assert client.get("/health").status_code == 503 and "disk is full" in told[0]
        full.clear()
        wait_for(lambda: told[1:] == [None])
        assert client.get("/health").text == "ok"
