"""Milliseconds of one diagnosis from a file, once the model is loaded."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from benchmarks.report import Row, number
from benchmarks.stored import data_set
from classifier.dataset import load_dataset
from classifier.diagnose import diagnose, diagnose_turn
from classifier.features import Psd
from classifier.model import Model, load_model, save_model
from classifier.train import train
from classifier.trainers.traingdx import TrainGdx
from indexer_records.conditions import RecordConditions
from indexer_records.measured import Reading, read_recording

RECORDS = 126
REQUIRED = 5e-3
"""Seconds of one diagnosis from a file."""

WARM, REPEATS = 20, 300
KNOWN = RecordConditions(sensor_radius=0.4)


def measure(*, quick: bool) -> list[Row]:
    """One row: the whole way from a CSV file of one turn, and what reading and diagnosing take of it."""
    repeats = 10 if quick else REPEATS
    folder = data_set("bench", RECORDS)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        model, file = _stored_model(folder), folder / "example.csv"
        signal = read_recording(file, Reading()).signal
        (turn,) = diagnose(model, signal, KNOWN)
        assert turn.record is not None
        record = turn.record
        whole = _timed(lambda: diagnose(model, read_recording(file, Reading()).signal, KNOWN), repeats)
        read = _timed(lambda: read_recording(file, Reading()), repeats)
        named = _timed(lambda: diagnose_turn(model, record), repeats)
    finally:
        torch.set_num_threads(threads)
    parts = ", ".join(part.kind for part in model.parts) or "no part"
    return [
        Row(
            f"one diagnosis from a CSV file of one turn (8200 samples), model loaded, with bands, {parts}; one core",
            "≤ 5 ms",
            f"{number(1e3 * whole[1])} ms of processor time ({number(1e3 * whole[0])} ms by the clock): reading "
            f"{number(1e3 * read[1])}, the diagnosis itself {number(1e3 * named[1])}; medians of {repeats}",
            whole[1] <= REQUIRED,
            {
                name: {"wall_s": taken[0], "processor_s": taken[1]}
                for name, taken in (("whole", whole), ("reading", read), ("diagnosis", named))
            },
        )
    ]


def _stored_model(folder: Path) -> Model:
    """The paper's network on a data set, as it comes back from its files."""
    result = train(load_dataset(folder), Psd(), TrainGdx(), hidden=20, seed=0, restarts=2)
    with tempfile.TemporaryDirectory() as place:
        save_model(result.model, Path(place))
        return load_model(place)


def _timed(action: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Medians [s] by the clock and of this thread's processor time."""
    taken = []
    for place in range(WARM + repeats):
        wall, processor = time.perf_counter(), time.thread_time()
        action()
        if place >= WARM:
            taken.append((time.perf_counter() - wall, time.thread_time() - processor))
    wall, processor = np.array(taken).T.tolist()
    return statistics.median(wall), statistics.median(processor)
