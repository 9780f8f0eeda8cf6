"""Fine-tuning beside the twin: a network taught on machines of the drawing goes on learning from a few labelled records
of the machine itself, as `indexer transfer` does it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.twin.records import LOADS, NAMES, SPEEDS, Recorded, effects_of
from benchmarks.twin.table import Judged
from benchmarks.twin.truth import RATE, Truth
from classifier.codes import CodeBook
from classifier.dataset import SUBSETS, Dataset
from classifier.features import Psd, Scaling
from classifier.model import Model
from classifier.train import train
from classifier.trainers.traingdx import TrainGdx
from classifier.transfer import AS_IT_IS, FINE_TUNED, Learner, in_turns
from datagen.labels import FAULT_CLASSES
from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from indexer_env import OperatingPoint, Run, load_machine, simulate_batch
from indexer_env.effects import MachineEffect
from indexer_env.units import RPM

COUNTS = (8, 32)
"""Labelled records: one of each class, and four."""

TAUGHT = 3000
"""Simulated records that the network is taught on first."""

_SAMPLES = 7200
"""Samples of a record, fewer than the shortest one has: a turn at the highest speed."""

_CODES = tuple(f"{number:03b}" for number in range(len(FAULT_CLASSES)))
_BOOK = CodeBook(tuple(range(1, len(_CODES) + 1)), FAULT_CLASSES, _CODES)


def transferred(
    truth: Truth, records: Sequence[Recorded], seed: int, rng: np.random.Generator
) -> dict[str, list[Judged]]:
    """Known records of a machine judged by the network as it is, and after it has learnt from `COUNTS` others; `rng`
    draws what it is taught on, `seed` begins the training."""
    model = train(_of_drawing(truth, rng), Psd(scale="log"), TrainGdx(), seed=seed, restarts=3, parts=()).model
    known = [record for record in records if not record.stranger]
    given = _dataset([record.signal.values for record in known], [record.sizes for record in known])
    order = in_turns(given, np.arange(len(known)))
    few, rest = order[: max(COUNTS)], order[max(COUNTS) :]
    learner = Learner.of(model, given, TrainGdx())
    found = {AS_IT_IS: _judged(model, known, rest)}
    for count in COUNTS:
        scaling = Scaling.fit(learner.values[few[:count]])
        learnt = learner.learn(model.parameters[None], scaling.apply(learner.values), few[:count], few[:count])
        tuned = dataclasses.replace(model, scaling=scaling, parameters=learnt)
        found[f"{FINE_TUNED} on {count} records"] = _judged(tuned, known, rest)
    return found


def _judged(model: Model, known: Sequence[Recorded], rows: np.ndarray) -> list[Judged]:
    outputs = model.outputs(np.array([known[row].signal.values[:_SAMPLES] for row in rows], dtype=np.float32))
    found = []
    for row, output in zip(rows, outputs, strict=True):
        named = frozenset(name for name, bit in zip(NAMES, output, strict=True) if bit > 0.5)
        found.append(Judged(frozenset(known[row].sizes), named, named, False, False, sizes=dict(known[row].sizes)))
    return found


def _of_drawing(truth: Truth, rng: np.random.Generator) -> Dataset:
    """Simulated records of machines of the drawing, every parameter ±10 %, with the faults, speeds, loads and noise of
    the machine's records."""
    drawing = load_machine("reference")
    machines, points, sizes = [], [], []
    for _ in range(TAUGHT):
        values = {name: read(drawing, name) * (1.0 + 0.1 * rng.uniform(-1.0, 1.0)) for name in UNCERTAINTY}
        there = {name: float(rng.uniform(0.0, 1.0)) for name in NAMES if rng.random() < 0.5}
        effects = [effect for effect in effects_of(truth, there) if isinstance(effect, MachineEffect)]
        machines.append(changed(drawing, values).with_effects(*effects))
        points.append(OperatingPoint(rng.uniform(*SPEEDS) * RPM, rng.uniform(*LOADS)))
        sizes.append(there)
    run = Run(sample_rate=RATE, samples=_SAMPLES, channels=("table_acceleration",))
    batch = simulate_batch(machines, points, run)
    kept = [k for k in range(TAUGHT) if k not in batch.rejected]
    values = [batch.table_acceleration[k] + truth.noise * rng.standard_normal(_SAMPLES) for k in kept]
    return _dataset(values, [sizes[k] for k in kept])


def _dataset(values: Sequence[np.ndarray], sizes: Sequence[Mapping[str, float]]) -> Dataset:
    """Labelled records; of each class six, two and two of every ten in the subsets."""
    classes = np.array([1 + int("".join("1" if name in one else "0" for name in NAMES), 2) for one in sizes])
    subsets = np.empty(len(classes), dtype=object)
    of_ten = np.repeat(SUBSETS, (6, 2, 2))[[0, 6, 8, 1, 7, 9, 2, 3, 4, 5]]
    for label in _BOOK.classes:
        rows = np.flatnonzero(classes == label)
        subsets[rows] = np.resize(of_ten, len(rows))
    return Dataset(
        np.array([one[:_SAMPLES] for one in values], dtype=np.float32), classes, subsets.astype(str), _BOOK, RATE,
        "table_acceleration", "rad/s^2", {},
    )  # fmt: skip
