"""Environment steps per second, beside Gymnasium's own environments in the same session."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import NamedTuple

import gymnasium
import numpy as np

import indexer_env  # noqa: F401 (registers the environment)
from benchmarks.report import Row, number
from benchmarks.session import CORES

ID = "indexer_env/Indexer-v1"
DIAGNOSIS = "indexer_env/IndexerDiagnosis-v1"
PEERS = ("CartPole-v1", "Pendulum-v1")
PERIOD = 0.01
"""Control period that is measured [s]."""

MANY = 1024
SIZES = (64, 256, 1024, 4096, 16384)
SYNC = 64
"""Machines in the loop: its cost per machine does not depend on their number."""

DIAGNOSED, DIAGNOSED_SYNC = 256, 8
"""Machines diagnosed in the native batch and in the loop."""

SECONDS = 1.0
"""Wall time of one repeat, about."""


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` takes short repeats and small fleets."""
    seconds, repeats = (0.1, 1) if quick else (SECONDS, 5)
    sizes = tuple(size for size in SIZES if size <= MANY) if quick else SIZES
    native = {size: _native(size, seconds, repeats) for size in sizes}
    return [
        _single(seconds, repeats),
        _beside_sync(native[MANY], seconds, repeats),
        *_growth(native),
        _diagnosis(seconds, repeats),
    ]


class Rate(NamedTuple):
    """Calls or steps per second of the clock and of one core's time."""

    by_clock: float
    per_core: float

    def times(self, size: int) -> Rate:
        return Rate(size * self.by_clock, size * self.per_core)


def _rate(step: Callable[[], object], seconds: float, repeats: int) -> Rate:
    """Calls per second, the medians of repeats; the first call is not counted."""
    step()
    begin = time.perf_counter()
    step()
    calls = max(3, int(seconds / max(time.perf_counter() - begin, 1e-6)))
    rates = []
    for _ in range(repeats):
        begin, processor = time.perf_counter(), time.process_time()
        for _ in range(calls):
            step()
        rates.append((calls / (time.perf_counter() - begin), calls / (time.process_time() - processor)))
    return Rate(*np.median(rates, axis=0).tolist())


def _stepper(name: str) -> Callable[[], None]:
    """Steps an environment as `gymnasium.make` gives it, under one sampled action; resets it where it ends."""
    env = gymnasium.make(name, **({"period": PERIOD} if name == ID else {}))
    env.reset(seed=0)
    env.action_space.seed(0)
    action = env.action_space.sample()

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    return step


def _single(seconds: float, repeats: int) -> Row:
    rates = {name: _rate(_stepper(name), seconds, repeats).by_clock for name in (ID, *PEERS)}
    peers = ", ".join(f"{name} {number(rates[name])}" for name in PEERS)
    return Row(
        "steps per second of one environment, control period 10 ms (40 RK4 steps), beside Gymnasium's own",
        "≥ 40 000",
        f"{number(rates[ID])} ({peers})",
        rates[ID] >= 40_000.0,
        {"steps_per_s": rates},
    )


def _native(size: int, seconds: float, repeats: int) -> Rate:
    """Environment steps per second of the native batch."""
    env = gymnasium.make_vec(ID, num_envs=size, vectorization_mode="vector_entry_point", period=PERIOD)
    env.reset(seed=0)
    actions = np.full((size, 1), 0.9, dtype=np.float32)
    return _rate(lambda: env.step(actions), seconds, repeats).times(size)


def _beside_sync(native: Rate, seconds: float, repeats: int) -> Row:
    env = gymnasium.make_vec(ID, num_envs=SYNC, vectorization_mode="sync", period=PERIOD)
    env.reset(seed=0)
    actions = np.full((SYNC, 1), 0.9, dtype=np.float32)
    loop = _rate(lambda: env.step(actions), seconds, repeats).times(SYNC)
    return Row(
        f"environment steps per second of the native batch, {MANY} machines, {CORES} cores; ÷ SyncVectorEnv",
        "≥ 500 000; ≥ 5 × per core",
        f"{number(native.by_clock)}; {native.per_core / loop.per_core:.1f} × ({number(native.per_core)} and, in the "
        f"loop, {number(loop.per_core)} per second of one core's time)",
        native.by_clock >= 500_000.0 and native.per_core >= 5.0 * loop.per_core,
        {"native_steps_per_s": native.by_clock, "sync_steps_per_s": loop.by_clock,
         "native_steps_per_processor_s": native.per_core, "sync_steps_per_processor_s": loop.per_core},
    )  # fmt: skip


def _diagnosis(seconds: float, repeats: int) -> Row:
    """Any action, each as likely: a third of the steps run a turn, a third give a name, a third start an episode."""
    native, loop = (
        _rate(_diagnosing(size, mode), seconds, repeats).times(size)
        for size, mode in ((DIAGNOSED, "vector_entry_point"), (DIAGNOSED_SYNC, "sync"))
    )
    return Row(
        f"environment steps per second of the diagnosis environment, {DIAGNOSED} machines, {CORES} cores; "
        "÷ SyncVectorEnv, per core",
        "≥ 3 000",
        f"{number(native.by_clock)}; {native.per_core / loop.per_core:.1f} × ({number(native.per_core)} and, in the "
        f"loop, {number(loop.per_core)} per second of one core's time)",
        native.by_clock >= 3_000.0,
        {"native_steps_per_s": native.by_clock, "sync_steps_per_s": loop.by_clock},
    )


def _diagnosing(size: int, mode: str) -> Callable[[], None]:
    env = gymnasium.make_vec(DIAGNOSIS, num_envs=size, vectorization_mode=mode)
    env.reset(seed=0)
    env.action_space.seed(0)

    def step() -> None:
        env.step(env.action_space.sample())

    return step


def _growth(native: dict[int, Rate]) -> list[Row]:
    costs = {size: 1e6 / rate.per_core for size, rate in native.items()}
    first, last = min(costs), max(costs)
    listed = ", ".join(f"{size}: {number(cost)}" for size, cost in costs.items())
    sizes = (last // 4, last // 2, last)
    memory = [_memory(size) for size in sizes]
    slopes = [(memory[1] - memory[0]) / (sizes[1] - sizes[0]), (memory[2] - memory[1]) / (sizes[2] - sizes[1])]
    return [
        Row(
            f"cost per machine and step from {first} to {last} machines, µs of one core's time",
            "not growing",
            listed,
            max(costs.values()) <= 1.25 * costs[first],
            {"microseconds": {str(size): cost for size, cost in costs.items()}},
        ),
        Row(
            f"memory per machine, from {sizes[0]} to {sizes[1]} and from {sizes[1]} to {sizes[2]} machines",
            "linear",
            f"{number(slopes[0] / 1024)} and {number(slopes[1] / 1024)} KiB",
            slopes[1] <= 1.5 * slopes[0],
            {"bytes_per_machine": slopes},
        ),
    ]


def _memory(size: int) -> float:
    """Peak of the memory that Python and NumPy hold [bytes] to make and step so many machines, in a fresh process."""
    program = (
        "import tracemalloc, gymnasium, numpy, indexer_env; "
        "make = lambda n: gymnasium.make_vec("
        f"{ID!r}, num_envs=n, vectorization_mode='vector_entry_point', period={PERIOD}); "
        "small = make(2); small.reset(seed=0); small.step(numpy.ones((2, 1))); tracemalloc.start(); "
        f"env = make({size}); env.reset(seed=0); [env.step(numpy.ones(({size}, 1))) for _ in range(3)]; "
        "print(tracemalloc.get_traced_memory()[1])"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return float(result.stdout)
