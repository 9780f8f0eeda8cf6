"""What a long command says of its pace."""

import logging

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
