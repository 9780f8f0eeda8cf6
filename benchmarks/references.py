"""Records of the reference solver: slow, so computed once on all cores and kept until what they depend on changes."""

from __future__ import annotations

import ast
import hashlib
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import numpy as np

import indexer_env
from benchmarks.session import CORES
from datagen.progress import progress
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference import simulate_reference

CACHE = Path(__file__).parent / ".cache"

_SOURCES = ("reference*", "reference/*.py", "motion_law/*.py", "effects/*.py", "machine.py", "operating_point.py")
"""What the reference's numbers depend on; comments and layout do not count."""


def reference_records(
    machines: Sequence[Machine], point: OperatingPoint, *, samples: int, sample_rate: float = 1000.0
) -> np.ndarray:
    """φ̈ [rad/s²] of the machines by the reference solver from the start of motion, (n, samples)."""
    paths = [CACHE / f"{_key(machine, point, samples, sample_rate)}.npy" for machine in machines]
    missing = [index for index, path in enumerate(paths) if not path.is_file()]
    if missing:
        CACHE.mkdir(exist_ok=True)
        context = multiprocessing.get_context("spawn")
        with (
            ProcessPoolExecutor(min(CORES, len(missing)), mp_context=context) as pool,
            progress("reference solver", len(missing), "records") as advance,
        ):
            jobs = {pool.submit(_record, machines[index], point, samples, sample_rate): index for index in missing}
            for job in as_completed(jobs):
                _keep(paths[jobs[job]], job.result())
                advance(1)
    return np.stack([np.load(path) for path in paths])


def _record(machine: Machine, point: OperatingPoint, samples: int, sample_rate: float) -> np.ndarray:
    return simulate_reference(machine, point, sample_rate=sample_rate, samples=samples).table_acceleration


def _keep(path: Path, record: np.ndarray) -> None:
    temporary = path.with_suffix(".part")
    with temporary.open("wb") as file:
        np.save(file, record)
    temporary.replace(path)


def _key(machine: Machine, point: OperatingPoint, samples: int, sample_rate: float) -> str:
    text = f"{machine!r} {point!r} {samples} {sample_rate!r} {_source_digest()}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _source_digest() -> str:
    root = Path(indexer_env.__file__).parent
    digest = hashlib.sha256()
    for path in sorted({path for pattern in _SOURCES for path in root.glob(pattern) if path.is_file()}):
        digest.update(str(path.relative_to(root)).encode())
        digest.update(ast.dump(ast.parse(path.read_text(encoding="utf-8"))).encode())
    return digest.hexdigest()
