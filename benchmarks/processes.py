"""What only a fresh process shows: import, first call with compilation, later starts, peak memory."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.report import Row, number

ROOT = Path(__file__).parent.parent
GIB = 2**30

_IMPORT = "import time; t = time.perf_counter(); import indexer_env.simulate; print(time.perf_counter() - t)"
_RECORD = "from indexer_env import load_machine, simulate; simulate(load_machine('reference'))"

_WATCH = """
import os, subprocess, sys, time
begin = time.perf_counter()
process = subprocess.Popen(sys.argv[1:])
_, status, usage = os.wait4(process.pid, 0)
duration = time.perf_counter() - begin
print(f"\\n{duration} {usage.ru_maxrss}")
sys.exit(os.waitstatus_to_exitcode(status))
"""
"""Waits for a process from a small one between: Linux counts the memory of whoever starts a process as the peak of
the process started, and the one that measures here may be large."""

_WORD = "compiling"
"""Part of the line that tells the user why the first call takes long (indexer_env.compiled)."""


@dataclass(frozen=True)
class Finished:
    """A process that has ended: its wall time [s], peak resident memory [bytes] and what it said."""

    duration: float
    peak_memory: int
    output: str
    messages: str


def child(arguments: list[str], **environment: str) -> Finished:
    """Run Python with these arguments in the project's root and wait for it.

    Raises
    ------
    ChildProcessError
        It ended with an error; with its last line on stderr.
    """
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as messages:
        process = subprocess.run(
            [sys.executable, "-c", _WATCH, sys.executable, *arguments],
            cwd=ROOT, env=os.environ | environment, stdout=output, stderr=messages, check=False,
        )  # fmt: skip
        output.seek(0)
        messages.seek(0)
        said, told = output.read(), messages.read()
    said, _, watched = said.rstrip("\n").rpartition("\n")
    if process.returncode != 0:
        last = (told.strip().splitlines() or ["no message"])[-1]
        raise ChildProcessError(f"python {' '.join(arguments)} ended with code {process.returncode}: {last}")
    duration, peak = watched.split()
    unit = 1 if sys.platform == "darwin" else 1024  # ru_maxrss is in KiB on Linux
    return Finished(float(duration), int(peak) * unit, said, told)


def memory(count: int) -> Row:
    """Peak memory of the generator that streams `count` one-turn records to disk."""
    with tempfile.TemporaryDirectory() as folder:
        done = child(["-m", "datagen", "campaign=table2", f"count={count}", f"out={folder}/table2"])
    return Row(
        f"peak memory for {count} turns streamed to disk (indexer generate campaign=table2)",
        "< 1 GiB",
        f"{done.peak_memory / GIB:.2f} GiB, in {number(done.duration)} s with two turns of warm-up each",
        done.peak_memory < GIB,
        {"bytes": done.peak_memory, "duration_s": done.duration},
    )


def start(repeats: int) -> list[Row]:
    """Import, first call on a fresh machine and later starts."""
    child(["-c", _IMPORT])  # once before, so that the files are in the system's cache
    importing = statistics.median(float(child(["-c", _IMPORT]).output) for _ in range(repeats))
    with tempfile.TemporaryDirectory() as cache:
        first = child(["-c", _RECORD], NUMBA_CACHE_DIR=cache)
        later = statistics.median(child(["-c", _RECORD], NUMBA_CACHE_DIR=cache).duration for _ in range(repeats))
    said = _WORD in first.messages
    return [
        Row("import of the package", "< 1 s", f"{importing:.2f} s", importing < 1.0, {"duration_s": importing}),
        Row(
            "new process to the first record on a fresh machine, compilation included",
            "< 30 s with a progress line",
            f"{first.duration:.1f} s, {'with' if said else 'without'} a progress line",
            first.duration < 30.0 and said,
            {"duration_s": first.duration},
        ),
        Row(
            "new process to the first record, later starts",
            "< 2 s", f"{later:.2f} s", later < 2.0, {"duration_s": later},
        ),
    ]  # fmt: skip
