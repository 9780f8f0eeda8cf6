"""What a terminal and what a log are told of a long command."""

import io
import logging

import pytest

from discrepancy.stages import FITS, stages


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def say(stderr: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr("sys.stderr", stderr)
    with stages(("first", "second")) as begin:
        begin("first")
        logging.getLogger(FITS).debug("drive.slip at 1.02 times the noise")
        begin("second")
    return stderr.getvalue()


def test_a_terminal_shows_the_stage_and_the_last_fit(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    shown = say(Terminal(), monkeypatch)
    assert "1 of 2: first (drive.slip at 1.02 times the noise)" in shown and "2 of 2: second" in shown
    assert not caplog.records
    logger = logging.getLogger(FITS)
    assert (logger.level, logger.propagate, logger.handlers) == (logging.NOTSET, True, [])


def test_a_log_has_a_line_for_each_stage_and_none_for_a_fit(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    caplog.set_level(logging.INFO)
    assert say(io.StringIO(), monkeypatch) == ""
    assert caplog.messages == ["1 of 2: first", "2 of 2: second"]
