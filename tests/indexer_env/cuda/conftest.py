"""What numba's CUDA simulator makes of the cases, once for all tests: it must be asked for before numba is imported."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
SIMULATOR = {"NUMBA_ENABLE_CUDASIM": "1", "OMP_NUM_THREADS": "1"}


PROCESS = """
import contextlib, io, json, sys, traceback

for line in sys.stdin:
    program, arguments = json.loads(line)
    sys.argv, failure = ["program", *arguments], ""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
        except BaseException:
            failure = traceback.format_exc()
    print(json.dumps([out.getvalue(), failure]), flush=True)
"""
"""Runs the programs that come as lines, one after the other."""


@pytest.fixture(scope="session")
def in_simulator():
    """Run a Python program with its arguments in numba's CUDA simulator, warnings being errors; its output. All run in
    one process, as each loads the same libraries."""
    environment = os.environ | SIMULATOR | {"PYTHONPATH": str(HERE.parents[2])}
    command = [sys.executable, "-W", "error", "-c", PROCESS]
    with subprocess.Popen(command, env=environment, stdin=-1, stdout=-1, text=True) as process:
        assert process.stdin is not None and process.stdout is not None

        def run(program: str, *arguments: str) -> str:
            print(json.dumps([program, arguments]), file=process.stdin, flush=True)
            answer = process.stdout.readline()
            assert answer, "the simulator's process has ended"
            printed, failure = json.loads(answer)
            assert not failure, failure
            return printed

        yield run
        process.stdin.close()


@pytest.fixture(scope="session")
def simulated(in_simulator, tmp_path_factory) -> dict[str, np.ndarray]:
    """Results of all cases by their run and name."""
    path = tmp_path_factory.mktemp("simulated") / "results.npz"
    in_simulator((HERE / "cases.py").read_text(encoding="utf-8"), str(path))
    with np.load(path) as results:
        return dict(results)
