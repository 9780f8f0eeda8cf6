"""The monitor's tutorial: its first command shows machines wearing, its second takes what a logger sends."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.docs.lessons import ROOT, blocks
from tests.patience import PATIENCE


@contextlib.contextmanager
def monitor(folder: Path, *keys: str) -> Iterator[tuple[Callable[[str], Any], int]]:
    """`indexer monitor` with these keys on free ports: what a path of its interface answers, and its broker's port."""
    ports = []
    for _ in range(2):
        with socket.create_server(("127.0.0.1", 0)) as one:
            ports.append(one.getsockname()[1])
    command = [sys.executable, "-m", "monitor", f"port={ports[0]}", f"broker_port={ports[1]}", *keys]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    running = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL)

    def ask(path: str) -> Any:
        assert running.poll() is None, "the monitor has ended"
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{ports[0]}{path}", timeout=60) as answer:
                return json.load(answer)
        except (urllib.error.URLError, ConnectionError, TimeoutError):
            return None

    try:
        yield ask, ports[1]
    finally:
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE) in (0, 130)


def test_the_lesson_waits_for_an_alarm_and_not_for_the_page() -> None:
    pattern = re.search(r"grep -Eq '(.+?)'", "".join(text for _, text in blocks("tutorials/monitor.md")))
    assert pattern is not None
    begun = "# HELP machine_alarm_level 0 normal, 1 alert, 2 alarm, 3 danger\n# TYPE machine_alarm_level gauge\n"
    alarmed = re.compile(pattern[1], re.MULTILINE)
    assert not alarmed.search(begun + 'machine_alarm_level{machine="press-1"} 0.0\n')
    assert alarmed.search(begun + 'machine_alarm_level{machine="press-1"} 1.0\n')


def wait_for(what: Callable[[], bool]) -> None:
    until = time.monotonic() + PATIENCE
    while not what():
        assert time.monotonic() < until
        time.sleep(0.5)


def trend_of(ask: Callable[[str], Any], machine: str) -> list[float]:
    """Backlashes told of a machine so far [degrees]."""
    told = ask(f"/api/machines/{machine}/trends") or {"modes": {}}
    return [value for mode in told["modes"].values() for value in mode.get("backlash_deg", {}).get("value", [])]


def level_of(ask: Callable[[str], Any], machine: str) -> str:
    """Level of the alarm of a machine's reducer."""
    machines = (ask("/api/fleet") or {"machines": []})["machines"]
    alarms = {one["machine"]: one["alarms"] for one in machines}
    return alarms.get(machine, {}).get("backlash_deg", {}).get("level_name", "normal")


@pytest.mark.slow
def test_the_monitor_s_tutorial(tmp_path: Path) -> None:
    shell = "\n".join(text for language, text in blocks("tutorials/monitor.md") if language == "sh")
    assert re.search(r"^indexer monitor$", shell, re.MULTILINE)
    with monitor(tmp_path) as (ask, _):
        wait_for(lambda: all(f"press-{number}" in json.dumps(ask("/api/fleet")) for number in (1, 2, 3)))
        wait_for(lambda: max(trend_of(ask, "press-2"), default=0.0) > 3.0)
        wait_for(lambda: level_of(ask, "press-2") != "normal")

    (line,) = re.findall(r"^indexer monitor (source=broker .*) out=first$", shell, re.MULTILINE)
    with monitor(tmp_path, *line.split(), "out=first") as (ask, port):
        wait_for(lambda: ask("/api/fleet") is not None)
        sender = [sys.executable, str(ROOT / "examples" / "send_turns.py"), "127.0.0.1", str(port)]
        subprocess.run(sender, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True)
        wait_for(lambda: level_of(ask, "press-9") in ("alarm", "danger"))
        wait_for(lambda: max(trend_of(ask, "press-9"), default=0.0) > 8.0)
