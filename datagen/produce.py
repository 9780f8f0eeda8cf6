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
from datagen.rows import case_columns, label_columns, run_columns, sensor_columns, version_columns
from datagen.seeds import Part, stream
from indexer_env.errors import ParameterError
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
            cases.append(build(item, order.base))
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
    # A few at a time, so that the sensor's intermediate results stay in the cache.
    blocks = [kept[first : first + _READ_TOGETHER] for first in range(0, len(kept), _READ_TOGETHER)]
    records = np.concatenate([
        order.sensor.read_batch(
            batch.table_acceleration[block],
            batch.sample_rate,
            [stream(order.seed, noise, cases[place].item.index) for place in block],
        ).astype(np.float32)
        for block in blocks
    ])  # fmt: skip
    common = {
        "kind": "simulated",
        "sample_rate": order.sensor.record_rate(batch.sample_rate),
        "quantity": QUANTITY,
        "unit": order.sensor.unit,
        "campaign": order.campaign.name,
        "seed": order.seed,
        **run_columns(order.run, batch.table_acceleration.shape[1]),
        **sensor_columns(order.sensor),
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


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _rejected(order: Order, item: Item, stage: str, reason: str) -> dict[str, Any]:
    draws = {"machine": item.machine, "faults": item.faults, "operating_point": item.operating_point}
    return {
        "seed": order.seed,
        "item": item.index,
        **label_columns(item.label),
        "stage": stage,
        "reason": reason,
        "draws": json.dumps(draws),
    }
