"""A short run of the environment's benchmark on small fleets; no test asserts a time."""

import math
from types import SimpleNamespace

import pytest

from benchmarks import environment, speed, training


def test_smoke_all_its_rows(monkeypatch):
    monkeypatch.setattr(environment, "SIZES", (2, 4, 8, 16))
    monkeypatch.setattr(environment, "MANY", 8)
    monkeypatch.setattr(environment, "SYNC", 2)
    asked = []
    monkeypatch.setattr(environment, "_memory", lambda size: asked.append(size) or 3e6 + 2048.0 * size)
    monkeypatch.setattr(environment, "DIAGNOSED", 4)
    monkeypatch.setattr(environment, "DIAGNOSED_SYNC", 2)
    single, many, cost, memory, diagnosed = environment.measure(quick=True)
    assert "4 machines" in diagnosed.what
    assert diagnosed.numbers["native_steps_per_s"] > 0.0 and diagnosed.numbers["sync_steps_per_s"] > 0.0
    assert set(single.numbers["steps_per_s"]) == {environment.ID, *environment.PEERS}
    assert all(math.isfinite(rate) and rate > 0.0 for rate in single.numbers["steps_per_s"].values())
    assert "8 machines, 2 cores; ÷ SyncVectorEnv" in many.what
    assert len(many.numbers) == 4 and min(many.numbers.values()) > 0.0
    assert list(cost.numbers["microseconds"]) == ["2", "4", "8"]
    assert asked == [2, 4, 8] and memory.met
    assert memory.numbers["bytes_per_machine"] == [2048.0, 2048.0]
    assert "2 and 2 KiB" in memory.measured


def test_memory_that_grows_faster_than_the_fleet_is_missed(monkeypatch):
    monkeypatch.setattr(environment, "_memory", lambda size: float(size**2))
    assert environment._growth({4: environment.Rate(1e6, 1e6), 16: environment.Rate(2e6, 1e6)})[1].met is False


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

    monkeypatch.setattr(
        environment, "time", SimpleNamespace(perf_counter=lambda: now[0], process_time=lambda: 2.0 * now[0])
    )
    assert environment._rate(step, seconds=5.0, repeats=3) == pytest.approx((1.0, 0.5))
    assert len(calls) == 2 + 3 * 5


def test_what_is_required_is_judged_per_core(monkeypatch):
    """Two cores that do six times a core's work by the clock do three times as much per core."""
    monkeypatch.setattr(environment, "_rate", lambda *_: environment.Rate(1e4, 1e4))
    loop = 1e4 * environment.SYNC
    for per_core, met in ((3.0, False), (6.0, True)):
        row = environment._beside_sync(environment.Rate(6.0 * loop, per_core * loop), 0.1, 1)
        assert row.met is met and f"; {per_core:.1f} × " in row.measured
    own = {"turns_per_s": 3000.0, "turns_per_processor_s": 1500.0}
    for turns, met in ((250.0, False), (120.0, True)):
        row = speed.jax_row(own, {"alone": {"32": (turns, turns)}, "split": {"32": (2.0 * turns, 0.9 * turns)}})
        assert row.met is met and row.measured.startswith(f"{1500.0 / turns:.1f} × ")
    stack = {"processor_s": 10.0, "wall_s": 5.0}
    for processor, met in ((200.0, False), (310.0, True)):
        row = training.beside_row({"processor_s": processor, "epochs": 3.0}, 10, 10, stack)
        assert row.met is met and row.numbers["ratio_per_core"] == processor / 10.0
