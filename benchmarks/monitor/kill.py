"""kill -9 of the monitor, of the broker or of the database at random instants while samples come.

Each machine's samples are 1 s blocks of one endless record, so that its turns must follow each other every 8.2 s. After
the last kill the publisher stops, the monitor works off what is left, and the turns in the store are counted: a turn
that was there before a kill and is not there after it is lost; two of one start are doubled; `holes` are turns that are
missing between two others. Mosquitto confirms a message a moment before it writes it, so a kill may cost the newest
blocks; the publisher sends the last two of each machine again whenever it has been connected anew.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import sys
import tempfile
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.monitor.machines import RADIUS_M, WORK, model
from benchmarks.monitor.programs import (
    MOSQUITTO,
    PATIENCE_S,
    POSTGRES,
    Database,
    Process,
    broker_process,
    free_port,
    listening,
    wait,
)  # fmt: skip
from monitor.intake.blocks import NANO
from monitor.sources import demo
from monitor.sources.mqtt import Broker
from monitor.store import Store, StoreDown

TURN_S = 8.2


class Publisher:
    """Sends 1 s blocks of every machine until it is stopped; a block is sent again until the broker has taken it."""

    def __init__(self, port: int, machines: int, speed: float) -> None:
        self._client = Broker("127.0.0.1", port).client("publisher", keep_session=True)
        self._taken: set[int] = set()
        self._recent: deque[tuple[str, str]] = deque(maxlen=2 * machines)
        self._client.on_connect = lambda *_: self._again()
        self._client.on_publish = lambda _client, _user, mid, *_: self._taken.add(mid)
        Broker("127.0.0.1", port).connect(self._client, keep_session=True)
        turn = demo.records("press-1", 2)[1]
        # Whole turns follow each other, so that the record has no seam.
        self._samples = np.concatenate([turn] * 10)
        self._machines, self._speed = machines, speed
        self.sent, self._stop = 0, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._start = int(time.time()) * NANO

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End with the block at hand."""
        self._stop.set()
        self._thread.join()

    def close(self) -> None:
        """Leave the broker."""
        self._client.disconnect()
        self._client.loop_stop()

    def _again(self) -> None:
        for topic, text in list(self._recent):
            self._client.publish(topic, text, 1)

    def _run(self) -> None:
        began = time.monotonic()
        while not self._stop.wait(max(0.0, began + (self.sent + 1) / self._speed - time.monotonic())):
            first = (1000 * self.sent) % len(self._samples)
            values = np.take(self._samples, range(first, first + 1000), mode="wrap")
            body = {
                "time": (self._start + self.sent * NANO) / NANO,
                "rate": 1000, "unit": "m/s^2", "sequence": self.sent,
                "values": [round(float(value), 3) for value in values],
            }  # fmt: skip
            text = json.dumps(body)
            topics = [f"plant/m{number}/acceleration" for number in range(self._machines)]
            self._recent.extend((topic, text) for topic in topics)
            sent = [self._client.publish(topic, text, 1) for topic in topics]
            # Paho keeps what it could not send and sends it again when the broker is back.
            while not {message.mid for message in sent} <= self._taken:
                time.sleep(0.005)
            self._taken.clear()
            self.sent += 1


def measure(target: str, kills: int, machines: int, speed: float, seed: int) -> dict[str, object]:
    """Kill `target` (monitor, broker or database) so many times; the counts of what was lost, doubled or left out."""
    model()
    with tempfile.TemporaryDirectory() as work, contextlib.ExitStack() as stack:
        folder = Path(work)
        port, page = free_port(), free_port()
        broker = broker_process(folder, port, kept=target == "broker")
        store_url = f"sqlite:///{folder}/kept/monitor.sqlite"
        processes: dict[str, Process | Database] = {}
        if target == "database":
            folder.chmod(0o755)
            processes["database"] = database = Database(folder / "database")
            store_url = database.url
        monitor = Process(
            [
                sys.executable, "-m", "monitor", f"source=mqtt://127.0.0.1:{port}/plant/+/acceleration",
                f"model={(WORK / 'model-3000').resolve()}", f"sensor_radius={RADIUS_M}", f"out={folder}/kept",
                f"store='{store_url}'", f"port={page}",
            ],
            folder, "monitor",
        )  # fmt: skip
        processes |= {"broker": broker, "monitor": monitor}
        for process in processes.values():
            process.start()
            stack.callback(process.end)
            time.sleep(1.0)
        wait(lambda: listening(page), "the page")
        store = Store(store_url)
        stack.callback(store.close)
        publisher = Publisher(port, machines, speed)
        stack.callback(publisher.close)
        publisher.start()
        wait(lambda: len(_turns(store)) >= machines, "the first turns")
        dice, lost = random.Random(seed), 0
        for number in range(kills):
            time.sleep(dice.uniform(0.2, 6.0))
            before = _turns(store)
            processes[target].kill()
            processes[target].start()
            after = _turns(store)
            lost += len(set(before) - set(after))
            if target == "monitor":
                # Killed while it starts now and then, and while it works off what has piled up.
                wait(lambda: listening(page), "the page") if dice.random() < 0.8 else time.sleep(dice.uniform(0, 4))
            print(f"kill {number + 1} of {kills}: {len(after)} turns", file=sys.stderr, flush=True)
        time.sleep(5.0)
        publisher.stop()
        expected = int(publisher.sent / TURN_S) * machines
        with contextlib.suppress(AssertionError):
            wait(lambda: len(_turns(store)) >= expected, "the last turns")
        turns = _turns(store)
        starts = Counter((machine, round(start / 1e8)) for machine, _, start in turns)
        return {
            "target": target,
            "kills": kills,
            "machines": machines,
            "blocks_sent": publisher.sent * machines,
            "turns_expected": expected,
            "turns": len(turns),
            "lost": lost,
            "doubled": sum(count - 1 for count in starts.values()),
            "holes": _holes(turns),
            "states": {m["machine"]: {k: v["count"] for k, v in m["states"].items()} for m in store.machines()},
        }


def _holes(turns: list[tuple[str, int, int]]) -> int:
    holes = 0
    for machine in {turn[0] for turn in turns}:
        starts = sorted(start for name, _, start in turns if name == machine)
        steps = np.diff(starts) / NANO / TURN_S
        holes += int(np.sum(np.maximum(np.round(steps) - 1, 0)))
    return holes


def _turns(store: Store) -> list[tuple[str, int, int]]:
    def read() -> Iterator[tuple[str, int, int]]:
        for one in store.machines():
            for turn in store.turns(one["machine"], count=100_000):
                yield one["machine"], turn["number"], turn["start_ns"]

    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            return list(read())
        except StoreDown:
            assert time.monotonic() < until
            time.sleep(0.2)


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor kill")
    parser.add_argument("--target", choices=("monitor", "broker", "database"), default="monitor")
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--machines", type=int, default=4)
    parser.add_argument("--speed", type=float, default=3.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    if MOSQUITTO is None:
        raise SystemExit("needs Mosquitto: apt-get install mosquitto")
    if given.target == "database" and POSTGRES is None:
        raise SystemExit("needs PostgreSQL: apt-get install postgresql")
    print(json.dumps(measure(given.target, given.kills, given.machines, given.speed, given.seed), indent=1))
