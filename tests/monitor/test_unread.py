"""What cannot be read does not vanish: it is in the log and on the page, whether its machine is known or not."""

import json
import logging
import threading
import urllib.request
from dataclasses import replace

import pytest

from indexer_records.measured import Reading
from monitor.intake.states import States
from monitor.intake.unread import SHOWN, Unread
from monitor.service import Service
from monitor.settings import settings_of
from monitor.sources.folder import FolderSource
from tests.monitor.fakes import PLAN, FakeDiagnoser
from tests.monitor.test_service import config, wait_for

HEAD = "time [s],acceleration [m/s^2]\n"
ROWS = [f"{place / 100:.2f},{place % 7}" for place in range(200)]


@pytest.mark.parametrize(
    "text",
    [
        HEAD + "\n".join([*ROWS[:50], "0.50,nan", *ROWS[51:]]),
        HEAD + "\n".join([*ROWS[:50], "0.50,broken", *ROWS[51:]]),
        "time [s],acceleration\n" + "\n".join(ROWS),
        HEAD + "\n".join(row.replace(",", ";").replace(".", ",") + ",5" for row in ROWS[:3]),
        "",
    ],
    ids=["NaN", "text", "no unit", "decimal comma", "nothing"],
)
def test_a_file_that_cannot_be_read_is_logged_and_told_before_its_machine_is_known(monitor, tmp_path, caplog, text):
    file = tmp_path / "press_1.csv"
    file.write_text(text)
    with caplog.at_level(logging.WARNING, "monitor"):
        source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
        source._read(monitor.engine, file, file.name, "")
    (said,) = monitor.engine.unread.sentences
    assert "press_1.csv" in said and said in caplog.text and "'press'" in caplog.text


def test_what_could_not_be_read_becomes_a_state_of_its_machine_once_this_is_known(monitor):
    monitor.engine.broken("press-1", "a.csv must be finite, got nan.")
    monitor.engine.broken("press-1", "b.csv must be finite, got nan.")
    assert monitor.engine.unread.sentences == ["b.csv must be finite, got nan."]
    monitor.send(2)
    wait_for(lambda: "broken_payload" in monitor.store.summary("press-1")["active_states"])
    state = monitor.store.summary("press-1")["states"]["broken_payload"]
    assert (state["count"], state["text"]) == (2, "b.csv must be finite, got nan.")
    assert monitor.engine.unread.sentences == []
    monitor.engine.broken("press-1", "c.csv must be finite, got nan.")
    wait_for(lambda: monitor.store.summary("press-1")["states"]["broken_payload"]["count"] == 3)


def test_what_could_not_be_read_is_over_once_the_file_is_read(monitor, tmp_path):
    """Of two broken files one is put right, then the other; a message that cannot be read stays one."""
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    first, other = (tmp_path / f"press_20270115T0{hour}0000Z.csv" for hour in (8, 9))

    def look(file, rows, mark):
        file.write_text(HEAD + "\n".join(rows))
        source._read(monitor.engine, file, file.name, mark)

    def told():
        summary = monitor.store.summary("press") or {"active_states": [], "states": {}}
        state = summary["states"].get("broken_payload", {"count": 0, "text": ""})
        return "broken_payload" in summary["active_states"], state["count"], state["text"]

    look(first, [*ROWS[:-1], "1.9"], "part")
    assert len(monitor.engine.unread.sentences) == 1
    look(first, ROWS, "whole")  # its machine is known from here on
    wait_for(lambda: told()[1] == 1)
    assert not told()[0] and monitor.engine.unread.sentences == []
    look(first, [*ROWS, "2.0"], "part")
    look(other, [*ROWS, "2.0"], "part")
    wait_for(lambda: told()[1] == 3)
    assert told()[0] and other.name in told()[2]
    look(other, ROWS, "whole")
    wait_for(lambda: first.name in told()[2])
    assert told()[0], "the first one is not yet read"
    look(first, ROWS, "again")
    wait_for(lambda: not told()[0])
    monitor.engine.broken("press", "the message must have samples, got none.")
    wait_for(lambda: told()[0])
    look(first, ROWS, "once more")
    wait_for(lambda: monitor.engine.positions(source.name).get(first.name) == "once more")
    assert told()[0], "a file that was read says nothing of a message"


def test_of_too_many_broken_files_the_state_ends_by_its_age():
    states = States()
    for place in range(500):
        states.note("broken_payload", place, f"{place}.csv", items={f"{place}.csv": f"{place}.csv"})
    for place in range(500):
        states.right("broken_payload", f"{place}.csv")
    assert states.active == ["broken_payload"] and len(states.to_dict()["broken_payload"]["open"]) <= 100
    states = States(states.to_dict())
    states.age(3601 * 10**9)
    assert states.active == [] and states.to_dict()["broken_payload"]["open"] == {}


def test_the_log_does_not_repeat_itself_and_the_page_tells_the_newest(caplog):
    unread, told = Unread(), []
    unread.told = lambda: told.append(len(unread.sentences))
    with caplog.at_level(logging.WARNING, "monitor"):
        for value in range(50):
            unread.add("m", f"the rate must be > 0 Hz, got {-value}.")
    assert len(caplog.records) == len(told) == 1 and unread.sentences == ["the rate must be > 0 Hz, got -49."]
    for place in range(SHOWN + 1):
        unread.add(f"n{place}", f"{place}.csv")
    assert unread.sentences[:SHOWN] == ["3.csv", "2.csv", "1.csv"] and "2 more" in unread.sentences[SHOWN]
    states = States()
    assert unread.move("m", states, 7) and not unread.move("m", states, 8) and states.count("broken_payload") == 50


def test_the_page_of_a_monitor_is_told_why_no_machine_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.service.diagnoser_of", lambda given: (FakeDiagnoser(), replace(given, plan=PLAN)))
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.05)
    folder = tmp_path / "logger"
    folder.mkdir()
    (folder / "press_1.csv").write_text("")
    given = [f"source=folder:{folder}", "model=m", f"out={tmp_path}/kept", "port=0", "settle=0"]
    service = Service(settings_of(config(*given)), say=lambda _: None)
    thread = threading.Thread(target=service.run, daemon=True)
    thread.start()
    wait_for(lambda: service._server.started)

    def troubles():
        with urllib.request.urlopen(service.url + "api/fleet", timeout=60.0) as answer:
            return json.load(answer)["troubles"]

    wait_for(troubles)
    assert len(troubles()) == 1 and "press_1.csv" in troubles()[0]
    service.stop()
    thread.join(60.0)
