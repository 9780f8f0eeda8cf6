"""Items -> machines -> simulation -> sensor -> rows: the inner step of every data set, without a file in
sight."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from datagen.campaign import Case, Item, build
from datagen.order import QUANTITY, Order
from datagen.quality import quality_columns
from datagen.quantities import SECTIONS
from datagen.rows import case_columns, label_columns, run_columns, version_columns
from datagen.seeds import Part, stream
from indexer_env.errors import ParameterError
from indexer_env.sensors import Sensor
from indexer_env.simulate import simulate_batch

Produced = tuple[list[dict[str, Any]], np.ndarray, list[dict[str, Any]]]
"""Rows without their records, records of shape (n, samples) float32 in the sensor's unit, rows of the rejected
items."""

_READ_TOGETHER = 32


def produce(order: Order, items: Sequence[Item], noise: Part = Part.SENSOR, threads: int | None = None) -> Produced:
    """Simulate and sense these items together, on all cores where `threads` is not given.

    Raises
    ------
    ParameterError
        The run or the sensor does not suit the items as a whole; an item that fails alone is in the third
        part.
    """
    cases: list[Case] = []
    rejected: list[dict[str, Any]] = []
    for item in items:
        try:
            case = build(item, order.base)
            if case.sensor != order.sensor:
                case.sensor.sections(order.run.sample_rate)
            cases.append(case)
        except ParameterError as error:
            rejected.append(_rejected(order, item, "machine", str(error)))
    if not cases:
        return [], np.empty((0, 0)), rejected
    machines, points = [case.machine for case in cases], [case.operating_point for case in cases]
    batch = simulate_batch(machines, points, order.run, threads=threads)
    rejected += [_rejected(order, cases[place].item, "simulation", reason) for place, reason in batch.rejected.items()]
    rejected.sort(key=lambda row: row["item"])
    kept = [place for place in range(len(cases)) if place not in batch.rejected]
    if not kept:
        return [], np.empty((0, 0)), rejected
    accelerations = batch.table_acceleration[kept]
    noises = [stream(order.seed, noise, cases[place].item.index) for place in kept]
    records = _read([cases[place].sensor for place in kept], accelerations, batch.sample_rate, noises)
    common = {
        "kind": "simulated",
        "sample_rate": order.sensor.record_rate(batch.sample_rate),
        "quantity": QUANTITY,
        "campaign": order.campaign.name,
        "seed": order.seed,
        **run_columns(order.run, accelerations.shape[1]),
        **version_columns(),
    }
    rows = [
        {
            **common,
            **quality,
            **case_columns(cases[place]),
            "warmup_turns": int(batch.warmup_turns[place]),
            "warmup_settled": bool(batch.settled[place]),
            "warmup_difference": _finite_or_none(float(batch.warmup_difference[place])),
        }
        for place, quality in zip(kept, quality_columns(records), strict=True)
    ]
    return rows, records, rejected


def _read(
    sensors: Sequence[Sensor], accelerations: np.ndarray, sample_rate: float, noises: Sequence[np.random.Generator]
) -> np.ndarray:
    """Each acceleration as its own sensor reads it, as it is stored; those of one sensor together, a few at a time so
    that the intermediate results stay in the cache."""
    rows: dict[Sensor, list[int]] = {}
    for row, sensor in enumerate(sensors):
        rows.setdefault(sensor, []).append(row)
    records: list[np.ndarray] = [np.empty(0)] * len(sensors)
    for sensor, own in rows.items():
        for block in (own[first : first + _READ_TOGETHER] for first in range(0, len(own), _READ_TOGETHER)):
            read = sensor.read_batch(accelerations[block], sample_rate, [noises[row] for row in block])
            for row, record in zip(block, read.astype(np.float32), strict=True):
                records[row] = record
    return np.stack(records)


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _rejected(order: Order, item: Item, stage: str, reason: str) -> dict[str, Any]:
    draws = {section: getattr(item, section) for section in SECTIONS}
    return {
        "seed": order.seed,
        "item": item.index,
        **label_columns(item.label),
        "stage": stage,
        "reason": reason,
        "draws": json.dumps(draws),
    }
