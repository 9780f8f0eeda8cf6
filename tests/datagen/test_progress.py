"""What a long command says of its pace."""

import io
import logging
import sys
from types import SimpleNamespace

import pytest

from datagen import progress as module
from datagen.progress import progress


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.5, "work: 3 of 9 cases, 4 cases/s, 0:00:02 left"), (24.0, "work: 3 of 9 cases, 5 cases/min, 0:01:12 left")],
)
def test_the_pace_is_told_in_a_unit_that_shows_it(caplog, monkeypatch, seconds, said):
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(module, "LOG_INTERVAL", 0.0)
    with caplog.at_level(logging.INFO, module.__name__), progress("work", 9, "cases", done=1) as advance:
        now[0] = seconds
        advance(2)
    assert caplog.messages == ["work: 1 of 9 cases are done", said]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_what_is_going_on_from_the_beginning(monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    with progress("work", 9, "cases") as advance:
        shown = [sys.stderr.getvalue()]
        advance(4, earlier=True)
        advance(5)
        advance.now("tidying up")
    shown.append(sys.stderr.getvalue())
    assert "work" in shown[0] and "0/9" in shown[0] and "0:00:0" in shown[0]
    assert "tidying up" in shown[1] and "9/9" in shown[1]


def test_what_was_done_before_is_no_part_of_the_pace(caplog, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with caplog.at_level(logging.INFO, module.__name__), progress("work", 9, "cases") as advance:
        advance(5, earlier=True)
        now[0] = 20.0
        advance(2)
        advance.now("tidying up")
    pace = "work: 7 of 9 cases, 6 cases/min, 0:00:20 left"
    assert caplog.messages == ["work: 9 cases", "work: 5 of 9 cases are done", pace, "tidying up"]


def test_a_single_one_is_counted_in_the_singular(caplog):
    with caplog.at_level(logging.INFO, module.__name__), progress("work", 1, "cases"):
        pass
    assert caplog.messages == ["work: 1 case"]
