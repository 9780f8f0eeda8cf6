"""Threads that outlive what nobody foresaw: they say it in the log and go on."""

import errno
import logging
import urllib.error
from email.message import Message
from types import SimpleNamespace
from typing import Any

import pytest

from monitor.outputs.outbox import Refused, Sender
from monitor.outputs.webhook import WebhookDelivery
from monitor.service import Service
from tests.monitor.test_service import wait_for


def test_an_alarm_is_told_after_an_error_that_nobody_foresaw(monkeypatch, caplog):
    monkeypatch.setattr("monitor.outputs.outbox._LOOK_S", 0.01)
    store: Any = SimpleNamespace(outbox=lambda _: [(1, {})], delivered=lambda _: None)
    errors = [KeyError("machine")]

    def deliver(message):
        if errors:
            raise errors.pop()

    sender = Sender(store, "webhook", deliver)
    with caplog.at_level(logging.WARNING):
        sender.start()
        wait_for(lambda: sender.delivered)
        sender.stop()
    assert "KeyError: 'machine'" in caplog.text


def test_the_page_says_that_alarms_are_not_delivered_and_keeps_the_address_to_itself(monkeypatch):
    monkeypatch.setattr("monitor.outputs.outbox._LOOK_S", 0.001)
    store: Any = SimpleNamespace(outbox=lambda _: [(1, {})], delivered=lambda _: None)
    broken, secret = [True], "https://plant.example/hook/secret"

    def deliver(message):
        if broken:
            raise urllib.error.HTTPError(secret, 404, "Not Found", Message(), None)

    sender = Sender(store, "webhook", deliver)
    assert sender.trouble is None
    sender.start()
    wait_for(lambda: sender.trouble)
    assert sender.trouble == "alarms cannot be delivered by webhook (HTTP 404); they are kept and tried again"
    broken.clear()
    wait_for(lambda: sender.trouble is None)
    sender.stop()


def test_an_alarm_that_is_refused_for_good_does_not_keep_back_the_others(monkeypatch, caplog):
    monkeypatch.setattr("monitor.outputs.outbox._LOOK_S", 0.001)
    left: list[tuple[int, dict]] = [(1, {"delivery": 7, "level": "odd"}), (1, {"delivery": 8, "level": "danger"})]
    store: Any = SimpleNamespace(outbox=lambda _: list(left), delivered=lambda rows: left.remove(left[0]))
    tried, told = [], []

    def deliver(message):
        if message["level"] == "odd":
            tried.append(message)
            raise Refused("HTTP 400 Bad Request")
        told.append(message["delivery"])

    sender = Sender(store, "webhook", deliver)
    with caplog.at_level(logging.WARNING):
        sender.start()
        wait_for(lambda: told)
        sender.stop()
    assert told == [8] and len(tried) == 3 and sender.delivered == 1
    assert (
        "an alarm was refused (HTTP 400 Bad Request) and is told nowhere but here: {'delivery': 7, 'level': 'odd'}"
        in caplog.text
    )


@pytest.mark.parametrize(("code", "refused"), [(400, True), (413, True), (401, False), (404, False), (503, False)])
def test_only_an_answer_about_the_message_itself_refuses_it(monkeypatch, code, refused):
    delivery = WebhookDelivery("http://127.0.0.1:1/", "s" * 16)

    def answer(*_, **__):
        raise urllib.error.HTTPError("http://127.0.0.1:1/", code, "no", Message(), None)

    monkeypatch.setattr(delivery._opener, "open", answer)
    with pytest.raises(OSError) as caught:
        delivery({"delivery": 1})
    assert isinstance(caught.value, Refused) == refused


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
        kept.keep(None, 1.0, 1.0)  # type: ignore[arg-type]
    assert expired
