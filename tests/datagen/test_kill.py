"""A real `python -m datagen` killed with SIGKILL at random instants of its whole life and begun again until it is done
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

KILLS = 100
ORDER = ["campaign=table2", "count=300", "shard_items=3", "run.samples=200", "run.warmup_turns=0", "workers=2"]
"""A hundred shards: the run spends most of its time between two files."""


def start(folder: Path) -> subprocess.Popen:
    root = Path(datagen.__file__).parents[1]
    command = [sys.executable, "-m", "datagen", *ORDER, f"out={folder}"]
    keywords = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(command, cwd=folder.parent, env={**os.environ, "PYTHONPATH": str(root)}, **keywords)


def progress_made(folder: Path) -> bool:
    return (folder / "unfinished" / "order.json").exists()


@pytest.mark.slow
def test_killed_at_random_instants(tmp_path):
    chance = random.Random(20)
    # The first run may have a kernel to compile; the second takes as long as those that are killed.
    for name in ("whole", "again"):
        begin = time.monotonic()
        assert start(tmp_path / name).wait() == 0
        duration = time.monotonic() - begin
    reference = contents(tmp_path / "whole")

    kills = killed_in_work = data_sets = 0
    while kills < KILLS:
        data_sets += 1
        folder = tmp_path / f"killed-{data_sets}"
        while True:
            process = start(folder)
            try:
                process.wait(timeout=chance.uniform(0.0, 1.1 * duration))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
            code = process.wait()
            assert code in (0, -signal.SIGKILL), process.stderr.read().decode()
            process.stderr.close()
            if code == 0:
                break
            kills += 1
            killed_in_work += progress_made(folder)
        assert contents(folder) == reference
    print(f"{kills} kills, {killed_in_work} of them of a run that had begun to write, {data_sets} data sets")
    assert killed_in_work > KILLS // 10
