"""Many machines at 1 kHz: whether every turn is diagnosed, how long from a turn's last sample to the page, and memory.

Blocks go into the engine's queue, where those of a broker arrive; the page's end is a client of its events. The
time from a turn's last sample is that from when its block is handed in to when the event with the turn's number comes.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from benchmarks.monitor.machines import model, plan
from monitor.engine import Arrival, Change, Engine
from monitor.intake.blocks import NANO, Block
from monitor.sources import demo
from monitor.store import Store


def measure(machines: int, seconds: float) -> dict[str, float]:
    """Send 1 s blocks of so many machines in real time."""
    diagnoser = model()
    turn = demo.records("press-1", 2)[1].astype(np.float32)
    # What wraps round is the same turn again, so that the record has no seam.
    samples = np.concatenate([turn] * 8)
    handed: dict[tuple[str, int], float] = {}
    delays: list[float] = []

    def changed(change: Change) -> None:
        key = (str(change.summary["machine"]), int(change.summary["turns"]))
        # Written as the page gets it.
        json.dumps(change.summary)
        if key in handed:
            delays.append(time.monotonic() - handed.pop(key))

    with tempfile.TemporaryDirectory() as folder:
        store = Store(f"sqlite:///{Path(folder) / 'monitor.sqlite'}")
        engine = Engine(store, diagnoser, plan(), changed=changed)
        engine.start()
        started, began = time.process_time(), time.monotonic()
        memory: list[float] = []
        start_ns = int(time.time()) * NANO
        for second in range(int(seconds)):
            for number in range(machines):
                # Spread over the second, as machines have their own clocks.
                due = began + second + number / machines
                if (wait := due - time.monotonic()) > 0:
                    time.sleep(wait)
                first = 1000 * second
                values = np.take(samples, np.arange(first, first + 1000), mode="wrap")
                name = f"m{number}"
                done = (first + 1000) // len(turn)
                if done > first // len(turn):
                    handed[(name, done)] = time.monotonic()
                engine.offer(Arrival(Block(name, start_ns + second * NANO, 1000.0, "m/s^2", values, sequence=second)))
            memory.append(_memory_mib())
        until = time.monotonic() + 60.0
        while engine.waiting and time.monotonic() < until:
            time.sleep(0.05)
        time.sleep(0.5)
        used, wall = time.process_time() - started, time.monotonic() - began
        engine.stop()
        expected = machines * (1000 * int(seconds) // len(turn))
        found = engine.turns
        store.close()
    return {
        "machines": machines,
        "seconds": seconds,
        "turns_expected": expected,
        "turns": found,
        "processor_share_of_a_core": used / wall,
        "delay_median_ms": 1000 * float(np.median(delays)),
        "delay_99_ms": 1000 * float(np.quantile(delays, 0.99)),
        "memory_mib_half_way": memory[len(memory) // 2],
        "memory_mib_end": memory[-1],
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "threads": threading.active_count(),
    }


def _memory_mib() -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor load")
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=300.0)
    given = parser.parse_args(arguments)
    print(json.dumps(measure(given.machines, given.seconds), indent=1))
