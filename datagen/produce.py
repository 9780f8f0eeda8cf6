"""Items -> machines -> simulation -> sensor -> rows: the inner step of every data set, without a file in
sight."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from datagen.campaign import Case, Item, build
from datagen.order import QUANTITY, Order
from datagen.quantities import SECTIONS
from datagen.rows import case_columns, device_columns, drive_columns, label_columns, run_columns, version_columns
from datagen.seeds import Part, stream
from indexer_env.device import CPU, on_host
from indexer_env.errors import ParameterError
from indexer_env.sensors import Sensor
from indexer_env.simulate import simulate_batch
from indexer_records.quality import quality_columns

Produced = tuple[list[dict[str, Any]], np.ndarray, list[dict[str, Any]]]
"""Rows without their records, records of shape (n, samples) float32 in the sensor's unit, rows of the rejected
items."""


def produce(order: Order, items: Sequence[Item], noise: Part = Part.SENSOR, threads: int | None = None) -> Produced:
    """Simulate and sense these items together, on all cores where `threads` is not given; a GPU takes no threads.

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
            order.drive_sensors.check_machine(case.machine)
            if case.sensor != order.sensor:
                case.sensor.sections(order.run.sample_rate)
            cases.append(case)
        except ParameterError as error:
            rejected.append(_rejected(order, item, "machine", str(error)))
    if not cases:
        return [], np.empty((0, 0)), rejected
    read = _Reader(order, cases, noise)
    machines, points = [case.machine for case in cases], [case.operating_point for case in cases]
    run = dataclasses.replace(order.run, channels=(QUANTITY, *order.drive_sensors.channels))
    threads = threads if order.device == CPU else None
    batch = simulate_batch(machines, points, run, threads=threads, sink=read, device=order.device)
    rejected += [_rejected(order, cases[place].item, "simulation", reason) for place, reason in batch.rejected.items()]
    rejected.sort(key=lambda row: row["item"])
    kept = [place for place in range(len(cases)) if place not in batch.rejected]
    if not kept:
        return [], np.empty((0, 0)), rejected
    records = read.records[kept] if batch.rejected else read.records
    common = {
        "kind": "simulated",
        "sample_rate": order.sensor.record_rate(batch.sample_rate),
        "quantity": QUANTITY,
        "campaign": order.campaign.name,
        "seed": order.seed,
        **run_columns(order.run),
        **device_columns(order.device),
        **drive_columns(order.drive_sensors),
        **version_columns(),
    }
    rows = [
        {
            **common,
            **quality,
            **case_columns(cases[place]),
            **read.signals[place],
            "warmup_turns": int(batch.warmup_turns[place]),
            "warmup_settled": bool(batch.settled[place]),
            "warmup_difference": _finite_or_none(float(batch.warmup_difference[place])),
        }
        for place, quality in zip(kept, quality_columns(records), strict=True)
    ]
    return rows, records, rejected


class _Reader:
    """Reads accelerations, as the simulation hands them out, each with its own sensor; `records` (n, samples) float32
    are those of the cases in their order, in their sensor's unit, `signals` those of their drives by name."""

    def __init__(self, order: Order, cases: Sequence[Case], noise: Part) -> None:
        self.order, self.cases, self.noise = order, cases, noise
        self.records = np.empty((len(cases), order.record_samples), dtype=np.float32)
        self.signals: list[dict[str, np.ndarray]] = [{} for _ in cases]

    def __call__(self, places: np.ndarray, channels: dict[str, np.ndarray]) -> None:
        """Read the accelerations of the cases at these places; those of one sensor together."""
        channels = {name: on_host(values) for name, values in channels.items()}
        rows: dict[Sensor, list[int]] = {}
        for row, place in enumerate(places):
            rows.setdefault(self.cases[place].sensor, []).append(row)
        for sensor, own in rows.items():
            rngs = None
            if sensor.noisy:
                items = [self.cases[place].item.index for place in places[own]]
                rngs = [stream(self.order.seed, self.noise, item) for item in items]
            accelerations = channels[QUANTITY] if len(own) == len(places) else channels[QUANTITY][own]
            self.records[places[own]] = sensor.read_batch(accelerations, self.order.run.sample_rate, rngs)
        for row, place in enumerate(places if self.order.drive_sensors.signals else ()):
            self._read_drive(place, {name: values[row] for name, values in channels.items()})

    def _read_drive(self, place: int, channels: dict[str, np.ndarray]) -> None:
        sensors, case, seed = self.order.drive_sensors, self.cases[place], self.order.seed
        rng = stream(seed, self.noise.of_drive, case.item.index) if sensors.noisy else None
        self.signals[place] = sensors.read(case.machine, channels, self.order.run.sample_rate, rng)


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
