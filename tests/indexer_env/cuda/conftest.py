"""What numba's CUDA simulator makes of the cases, once for all tests: it must be asked for before numba is imported."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
SIMULATOR = {"NUMBA_ENABLE_CUDASIM": "1", "OMP_NUM_THREADS": "1"}


@pytest.fixture(scope="session")
def in_simulator():
    """Run a Python program in numba's CUDA simulator, warnings being errors; its output."""

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, "-W", "error", *arguments],
            env=os.environ | SIMULATOR | {"PYTHONPATH": str(HERE.parents[2])}, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def simulated(in_simulator, tmp_path_factory) -> dict[str, np.ndarray]:
    """Results of all cases by their run and name."""
    path = tmp_path_factory.mktemp("simulated") / "results.npz"
    in_simulator(str(HERE / "cases.py"), str(path))
    with np.load(path) as results:
        return dict(results)
