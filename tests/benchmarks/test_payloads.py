"""What becomes of broken payloads; `python -m benchmarks.monitor payloads` tries 100 000."""

from __future__ import annotations

import json
import random

from benchmarks.monitor import payloads


def test_broken_payloads_are_refused_or_read_and_make_no_turn():
    """Seed 1, as the page has it."""
    found = payloads.measure(3000, 1)
    assert found["payloads"] == found["refused_with_a_sentence"] + found["still_a_message"] == 3000
    assert found["still_a_message"] > 0 and found["turns"] == 0


def test_turns_that_arise_are_counted(monkeypatch):
    """A whole record in blocks of a second: 25 s hold three turns of 8.2 s."""
    seconds = iter(range(25))

    def whole(dice: random.Random) -> tuple[bytes, None]:
        body = {"time": 1_800_000_000 + next(seconds), "rate": 1000, "unit": "m/s^2", "values": [0.5] * 1000}
        return json.dumps(body).encode(), None

    monkeypatch.setattr(payloads, "broken", whole)
    assert payloads.measure(25, 1) == {
        "payloads": 25, "refused_with_a_sentence": 0, "still_a_message": 25, "turns": 3,
    }  # fmt: skip
