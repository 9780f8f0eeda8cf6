"""What run.json, the card and the terminal say of the time that a data set took."""

import json
import logging
from dataclasses import replace
from types import SimpleNamespace

from datagen.executors import LocalExecutor
from datagen.generate import generate
from datagen.make_shard import MakeShard


def test_the_clock_runs_and_something_is_shown_from_the_first_shard_on(tiny, tmp_path, monkeypatch, caplog):
    """By a clock that shows 30 s more after each of three shards: what comes before the folder is taken counts too."""
    now, said = [100.0], []

    def slow(self, number, call=MakeShard.__call__):
        said.append(list(caplog.messages))
        now[0] += 30.0
        return call(self, number)

    monkeypatch.setattr(MakeShard, "__call__", slow)
    monkeypatch.setattr("datagen.generate.time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr("datagen.run_log.time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr("datagen.progress.time", SimpleNamespace(monotonic=lambda: now[0]))
    with caplog.at_level(logging.INFO, "datagen.progress"):
        generate(replace(tiny, shard_items=1), tmp_path / "set", executor=LocalExecutor(1))
    run = json.loads((tmp_path / "set" / "run.json").read_text())
    assert run["seconds"] == run["sessions"][0]["seconds"] == 90.0
    assert "90.0 s in all, interrupted 0 times" in (tmp_path / "set" / "README.md").read_text()
    assert said[0] == ["simulating: 3 records"]
    assert said[1][1:] == ["simulating: 1 of 3 records, 2 records/min, 0:01:00 left"]
    assert caplog.messages[-2:] == ["simulating: 3 of 3 records, 2 records/min", "writing the example and the card"]
