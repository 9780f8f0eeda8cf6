"""Many machines at 1 kHz: whether every turn is diagnosed, how long from a turn's last sample to the page, and memory.

All of it as it is used: 1 s blocks as JSON go to Mosquitto, `indexer monitor` fetches them, and a client of the page's
events sees the turns. The time from a turn's last sample is that from the publication of the block that holds it to the
event with the turn's number. Memory is the resident set of the process that listens, once a second; after the run the
store is asked which turns have no diagnosis.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import os
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.monitor.machines import RADIUS_M, WORK, model
from benchmarks.monitor.programs import MOSQUITTO, Process, broker_process, free_port, listening, wait
from monitor.intake.blocks import NANO
from monitor.sources import demo
from monitor.sources.mqtt import Broker
from monitor.store import Store

_BLOCK = 1000
_SETTLING_S = 60.0


class Page:
    """A client of the page's events: when it saw each turn of each machine."""

    def __init__(self, port: int) -> None:
        self.seen: dict[tuple[str, int], float] = {}
        self._connection = http.client.HTTPConnection("127.0.0.1", port)
        self._connection.request("GET", "/events")
        self._answer = self._connection.getresponse()
        self._newest: dict[str, int] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with contextlib.suppress(OSError, http.client.HTTPException, ValueError):
            for line in self._answer:
                if not line.startswith(b'data: {"machine"'):
                    continue
                now, summary = time.monotonic(), json.loads(line[6:])
                for number in range(self._newest.get(summary["machine"], 0) + 1, summary["turns"] + 1):
                    self.seen[(summary["machine"], number)] = now
                self._newest[summary["machine"]] = summary["turns"]


def measure(machines: int, seconds: int) -> dict[str, object]:
    """Send 1 s blocks of so many machines in real time."""
    model()
    turn = demo.records("press-1", 2)[1]
    # What wraps round is the same turn again, so that the record has no seam.
    samples = np.round(np.concatenate([turn] * 10), 3)
    texts = [json.dumps(samples[first : first + _BLOCK].tolist()) for first in range(0, len(samples), _BLOCK)]
    with tempfile.TemporaryDirectory() as work, contextlib.ExitStack() as stack:
        folder, port, page_port = Path(work), free_port(), free_port()
        monitor = Process(
            [
                sys.executable, "-m", "monitor", f"source=mqtt://127.0.0.1:{port}/plant/+/acceleration",
                f"model={(WORK / 'model-3000').resolve()}", f"sensor_radius={RADIUS_M}", f"out={folder}/kept",
                f"port={page_port}",
            ],
            folder, "monitor",
        )  # fmt: skip
        for process in (broker_process(folder, port, kept=False), monitor):
            process.start()
            stack.callback(process.end)
            time.sleep(1.0)
        wait(lambda: listening(page_port), "the page")
        assert monitor.process is not None
        page, pid = Page(page_port), monitor.process.pid
        client = Broker("127.0.0.1", port).client("publisher", keep_session=False)
        Broker("127.0.0.1", port).connect(client, keep_session=False)
        wait(client.is_connected, "the broker")
        handed: dict[tuple[str, int], float] = {}
        used, began, start_ns = _processor_s(pid), time.monotonic(), int(time.time()) * NANO
        memory: list[float] = []
        spent: list[float] = []
        for second in range(seconds):
            done = _BLOCK * (second + 1) // len(turn)
            for number in range(machines):
                # Spread over the second, as machines have their own clocks.
                time.sleep(max(0.0, began + second + number / machines - time.monotonic()))
                name = f"m{number}"
                if done > _BLOCK * second // len(turn):
                    handed[(name, done)] = time.monotonic()
                head = {"time": start_ns / NANO + second, "rate": 1000, "unit": "m/s^2", "sequence": second}
                text = json.dumps(head)[:-1] + ', "values": ' + texts[second % len(texts)] + "}"
                client.publish(f"plant/{name}/acceleration", text, 1)
            memory.append(_memory_mib(pid))
            spent.append(_processor_s(pid))
            if second % 60 == 59:
                print(f"{second + 1} s: {len(page.seen)} turns, {memory[-1]:.0f} MiB", file=sys.stderr, flush=True)
        settled = len(page.seen)
        used, wall = _processor_s(pid) - used, time.monotonic() - began
        expected = machines * (_BLOCK * seconds // len(turn))
        until = time.monotonic() + _SETTLING_S
        while len(page.seen) < expected and time.monotonic() < until:
            time.sleep(0.05)
        client.disconnect()
        client.loop_stop()
        kept = _kept(f"sqlite:///{folder}/kept/monitor.sqlite")
        delays = [page.seen[key] - at for key, at in handed.items() if key in page.seen]
        return {
            "machines": machines,
            "seconds": seconds,
            "turns_expected": expected,
            "turns": len(page.seen),
            **kept,
            "turns_when_the_last_was_sent": settled,
            "processor_share_of_a_core": used / wall,
            "delay_median_ms": 1000 * float(np.median(delays)),
            "delay_99_ms": 1000 * float(np.quantile(delays, 0.99)),
            "processor_share_by_tenths": [float(np.mean(np.diff(part))) for part in np.array_split(spent, 10)],
            "memory_mib_by_tenths": [float(np.median(part)) for part in np.array_split(memory, 10)],
            "memory_mib_most": max(memory),
            "memory_slope_mib_per_h_second_half": _slope_per_h(memory[len(memory) // 2 :]),
        }


def _kept(url: str) -> dict[str, object]:
    """What the store says after the run: turns, those without a diagnosis, and states of the machines."""
    store = Store(url)
    turns = [turn for one in store.machines() for turn in store.turns(one["machine"], count=1_000_000)]
    states: Counter[str] = Counter()
    for one in store.machines():
        states.update({name: state["count"] for name, state in one["states"].items()})
    store.close()
    problems = Counter(turn["problem"] for turn in turns if turn["problem"])
    return {"turns_in_store": len(turns), "not_diagnosed": dict(problems), "states": dict(states)}


def _slope_per_h(memory: list[float]) -> float:
    return 3600.0 * float(np.polyfit(range(len(memory)), memory, 1)[0]) if len(memory) > 1 else float("nan")


def _memory_mib(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def _processor_s(pid: int) -> float:
    """Processor time that a process has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor load")
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seconds", type=int, default=300)
    given = parser.parse_args(arguments)
    if MOSQUITTO is None:
        raise SystemExit("needs Mosquitto: apt-get install mosquitto")
    print(json.dumps(measure(given.machines, given.seconds), indent=1))
