"""Threads that outlive what nobody foresaw: they say it in the log and go on."""

import errno
import logging
from types import SimpleNamespace
from typing import Any

import pytest

from monitor.outputs.outbox import Sender
from monitor.service import Service
from tests.monitor.test_service import wait_for


def test_an_alarm_is_told_after_an_error_that_nobody_foresaw(monkeypatch, caplog):
    monkeypatch.setattr("monitor.outputs.outbox._LOOK_S", 0.01)
    store: Any = SimpleNamespace(outbox=lambda _: [(1, {})], delivered=lambda _: None)
    errors = [KeyError("machine")]

    def deliver(row, message):
        if errors:
            raise errors.pop()

    sender = Sender(store, "webhook", deliver)
    with caplog.at_level(logging.WARNING):
        sender.start()
        wait_for(lambda: sender.delivered)
        sender.stop()
    assert "KeyError: 'machine'" in caplog.text


def test_a_full_disk_neither_ends_the_keeping_nor_hides_that_the_engine_has_failed(monkeypatch, caplog, tmp_path):
    tried, stopped = [], []
    service: Any = SimpleNamespace(
        _stopping=SimpleNamespace(wait=lambda _: False), _leads=lambda: True, _store=None,
        _settings=SimpleNamespace(out=tmp_path, raw_days=1.0, turn_days=1.0),
        engine=SimpleNamespace(failure=None), stop=lambda: stopped.append(True),
    )  # fmt: skip

    def full(*_):
        tried.append(True)
        if len(tried) == 2:
            service.engine.failure = RuntimeError()
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr("monitor.service.keep", full)
    Service._keep(service)
    assert len(tried) == 2 and stopped and "no space left" in caplog.text


def test_on_a_full_disk_old_records_are_forgotten(monkeypatch):
    import monitor.store.archive as kept

    expired = []

    def full(*_):
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(kept, "archive", full)
    monkeypatch.setattr(kept, "expire", lambda *_: expired.append(True))
    with pytest.raises(OSError, match="no space"):
        kept.keep(None, None, 1.0, 1.0)  # type: ignore[arg-type]
    assert expired
