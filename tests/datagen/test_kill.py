"""A real `indexer generate` killed with SIGKILL at random instants of its whole life and begun again until it is done
ends with the bytes of a run that nobody stopped (seed 20)."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import datagen

from .test_generate import contents

KILLS, SHARDS = 100, 100
ORDER = ["campaign=table2", "count=300", "shard_items=3", "run.samples=200", "run.warmup_turns=0", "workers=2"]
"""A hundred shards: the run spends most of its time between two files."""


def start(folder: Path) -> subprocess.Popen:
    root = Path(datagen.__file__).parents[1]
    command = [sys.executable, "-m", "datagen", *ORDER, f"out={folder}"]
    keywords = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(command, cwd=folder.parent, env={**os.environ, "PYTHONPATH": str(root)}, **keywords)


def receipts(folder: Path) -> int:
    """Shards that an unfinished data set has."""
    return len(list((folder / "unfinished").glob("shard-*.json")))


def wait_for_the_instant(process: subprocess.Popen, folder: Path, chance: random.Random) -> None:
    """One time in five an instant of the first second, before or while the folder is taken; else some milliseconds
    after up to thirty more shards, however fast the machine is. Where all are there, the end of the run, every other
    time the very end."""
    if chance.random() < 0.2:
        time.sleep(chance.uniform(0.0, 1.0))
        return
    before = receipts(folder)
    if before == SHARDS:
        if chance.random() < 0.5:
            process.wait()
        time.sleep(chance.uniform(0.0, 4.0))
        return
    goal = min(before + chance.randint(1, 30), SHARDS)
    while process.poll() is None and receipts(folder) < goal:
        time.sleep(0.001)
    time.sleep(chance.uniform(0.0, 0.05))


@pytest.mark.slow
def test_killed_at_random_instants(tmp_path):
    chance = random.Random(20)
    with start(tmp_path / "whole") as process:
        assert process.wait() == 0
    reference = contents(tmp_path / "whole")

    kills = in_work = data_sets = 0
    while kills < KILLS:
        data_sets += 1
        folder = tmp_path / f"killed-{data_sets}"
        while True:
            before = receipts(folder)
            with start(folder) as process:
                wait_for_the_instant(process, folder, chance)
                process.send_signal(signal.SIGKILL)
                code = process.wait()
                assert code in (0, -signal.SIGKILL), process.stderr.read().decode()
            if code == 0:
                break
            kills += 1
            in_work += receipts(folder) != before
        assert contents(folder) == reference
    print(f"{kills} kills, {in_work} of them of runs that had made shards, {data_sets} data sets")
    assert in_work > KILLS // 2
