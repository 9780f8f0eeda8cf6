"""Shuffled PyTorch batches from the shards, and the check of a data set: records a second."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from torch.utils.data import DataLoader

from benchmarks.report import Row, number
from benchmarks.session import CORES
from benchmarks.stored import data_set
from datagen.batches import RecordStream
from datagen.check import check

BATCH = 256
RECORDS = 8_192
EPOCHS = 3
REQUIRED = 20_000.0


def measure(*, quick: bool) -> list[Row]:
    """A row for records without noise, one for those of the bench's sensor, one for the check."""
    count = 512 if quick else RECORDS
    return [*(_batches(sensor, count, 1 if quick else EPOCHS) for sensor in ("ideal", "bench")), _check(count)]


def _batches(sensor: str, count: int, epochs: int) -> Row:
    stream = RecordStream(data_set(sensor, count), ("code",), batch_size=BATCH, threads=CORES)
    rates, processor, by_processes = [], [], []
    for epoch in range(epochs):
        stream.set_epoch(epoch)
        before = _processor_time()
        rates.append(_rate(stream))
        processor.append(count / (_processor_time() - before))
        by_processes.append(_rate(DataLoader(stream, batch_size=None, num_workers=CORES)))
    rate, per_core = max(rates), max(processor)
    return Row(
        f"shuffled batches of {BATCH} records of 8200 samples, {CORES} worker threads, sensor {sensor}",
        f"≥ {number(REQUIRED)} records/s",
        f"{number(rate)} records/s ({number(per_core)} per second of one core's time); "
        f"{number(max(by_processes))} with {CORES} worker processes started anew",
        rate >= REQUIRED,
        {
            "records_per_s": rate,
            "records_per_processor_s": per_core,
            "records_per_s_by_processes": max(by_processes),
            "records": count,
        },
    )


def _rate(batches: Iterable[dict[str, Any]]) -> float:
    """Records a second of one epoch."""
    begin = time.perf_counter()
    records = sum(len(batch["record"]) for batch in batches)
    return records / (time.perf_counter() - begin)


def _processor_time() -> float:
    """Of this process and of those that it has waited for [s]."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def _check(count: int) -> Row:
    folder: Path = data_set("bench", count)
    begin, before = time.perf_counter(), _processor_time()
    verdict = check(folder)
    wall, processor = time.perf_counter() - begin, _processor_time() - before
    if verdict.faults:
        raise ValueError(verdict.faults[0])
    return Row(
        "indexer check, every row of it",
        "",
        f"{number(count / wall)} records/s ({number(count / processor)} per second of one core's time)",
        None,
        {"records_per_s": count / wall, "records_per_processor_s": count / processor},
    )
