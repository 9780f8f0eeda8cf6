"""A short run of the environment's benchmark on small fleets; no test asserts a time."""

import math
from types import SimpleNamespace

import pytest

from benchmarks import environment


def test_smoke_all_its_rows(monkeypatch):
    monkeypatch.setattr(environment, "SIZES", (2, 4, 8, 16))
    monkeypatch.setattr(environment, "MANY", 8)
    monkeypatch.setattr(environment, "SYNC", 2)
    asked = []
    monkeypatch.setattr(environment, "_memory", lambda size: asked.append(size) or 3e6 + 2048.0 * size)
    monkeypatch.setattr(environment, "DIAGNOSED", 4)
    monkeypatch.setattr(environment, "DIAGNOSED_SYNC", 2)
    single, many, cost, memory, diagnosed = environment.measure(quick=True)
    assert diagnosed.what.endswith("4 machines, and ÷ SyncVectorEnv")
    assert diagnosed.numbers["native_steps_per_s"] > 0.0 and diagnosed.numbers["sync_steps_per_s"] > 0.0
    assert set(single.numbers["steps_per_s"]) == {environment.ID, *environment.PEERS}
    assert all(math.isfinite(rate) and rate > 0.0 for rate in single.numbers["steps_per_s"].values())
    assert many.what.endswith("8 machines, and ÷ SyncVectorEnv")
    assert many.numbers["native_steps_per_s"] > 0.0 and many.numbers["sync_steps_per_s"] > 0.0
    assert list(cost.numbers["microseconds"]) == ["2", "4", "8"]
    assert asked == [2, 4, 8] and memory.met
    assert memory.numbers["bytes_per_machine"] == [2048.0, 2048.0]
    assert "2 and 2 KiB" in memory.measured


def test_memory_that_grows_faster_than_the_fleet_is_missed(monkeypatch):
    monkeypatch.setattr(environment, "_memory", lambda size: float(size**2))
    assert environment._growth({4: 1e6, 16: 1e6})[1].met is False


def test_the_memory_of_a_fleet_is_that_of_its_own_process():
    small, large = environment._memory(2), environment._memory(1026)
    assert 1024 < (large - small) / 1024 < 100 * 1024


def test_a_rate_is_the_median_of_its_repeats_without_the_first_calls(monkeypatch):
    """A clock that goes on by 1 s a call makes every rate 1/s; the first call, slow as a compilation, is not seen."""
    now = [0.0]
    calls = []

    def step() -> None:
        calls.append(now[0])
        now[0] += 100.0 if len(calls) == 1 else 1.0

    monkeypatch.setattr(environment, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    assert environment._rate(step, seconds=5.0, repeats=3) == pytest.approx(1.0)
    assert len(calls) == 2 + 3 * 5
