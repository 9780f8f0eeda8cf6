"""Simulated turns that the networks learn from: the campaign `own`, as differences from the healthy machine.

The records themselves are not kept, as the order in data.yaml makes each of them again; what is kept is what the
networks see. Shard by shard, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import dataclasses
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file, save_file

from datagen.campaign import Base
from datagen.campaigns.own import Own
from datagen.labels import subset_schedule
from datagen.order import Order
from datagen.produce import produce
from indexer_env import Machine, OperatingPoint, Sensor
from indexer_env.units import RPM
from twin.faults import Fault
from twin.turns import Cells, Healthy, behind_lead_in, lead_in

_log = logging.getLogger(__name__)

HOW_MANY = (0.15, 0.35, 0.3, 0.2)
"""Share of records with none, one, two and three faults: half of them several, which are the hardest to name."""

POINTS = 96
"""Operating points spread over the range (Sobol'); a network sees enough of them to know what lies between."""

_SHARD = 512
"""Records simulated at once, which bounds the memory."""

OWN_LOAD = 0.2
"""Share of a stated load's error that differs from record to record."""

_APART = 1e-10
"""Relative difference of the speeds by which operating points are told apart."""

SPLIT = {"calibration": 3, "control": 1, "validation": 0}
"""Machines of the posterior that networks are taught on, and those that are kept for thresholds."""

_SMALL = 0.25
"""Half of the sizes are drawn up to this share of the largest: what a network gets wrong is small."""


@dataclass(frozen=True, eq=False)
class Turns:
    """Turns as the networks see them, without noise.

    Attributes
    ----------
    x : ndarray (n, stations, cells) float32
        y − ŷ [unit of the sensor].
    point : ndarray (n,) of int
        Row of `points`.
    size : ndarray (n, faults) float32
        Share of the largest; 0 where a fault is absent.
    there : ndarray (n, faults) of bool
    station : ndarray (n,) of int
        Of the single cracked roller, -1 without.
    subset : ndarray (n,) of int
        0 calibration, 1 control.
    points : sequence of OperatingPoint
    reference : ndarray (p, stations, cells)
        ŷ at the points.
    """

    x: np.ndarray
    point: np.ndarray
    size: np.ndarray
    there: np.ndarray
    station: np.ndarray
    subset: np.ndarray
    points: Sequence[OperatingPoint]
    reference: np.ndarray

    def part(self, rows: np.ndarray) -> Turns:
        """Some of the turns."""
        each = ("x", "point", "size", "there", "station", "subset")
        return dataclasses.replace(self, **{name: getattr(self, name)[rows] for name in each})


def points_of(speeds: Sequence[float], loads: Sequence[float], seed: int) -> list[OperatingPoint]:
    """Operating points over a range of motor speeds [rpm] and loads [N m]; one where both are fixed."""
    from scipy.stats import qmc

    free = [low != high for low, high in (speeds, loads)]
    if not any(free):
        return [OperatingPoint(speeds[0] * RPM, loads[0])]
    unit = qmc.Sobol(2, rng=np.random.default_rng(seed)).random(128)[:POINTS]
    rpm, load = (low + (high - low) * u for (low, high), u in zip((speeds, loads), unit.T, strict=True))
    return [OperatingPoint(float(r) * RPM, float(t)) for r, t in zip(rpm, load, strict=True)]


def fault_laws(faults: Sequence[Fault], machine: Machine, smallest: float | None = None) -> dict[str, Any]:
    """The fault table as the campaign `own` reads it; sizes are dense near nothing, or, where the `smallest` is given,
    log-uniform from it to the largest."""
    laws: dict[str, Any] = {}
    for fault in faults:
        largest = fault.simulated * fault.largest(machine)
        lowest = -largest if fault.signed else 0.0
        size: dict[str, Any] = {
            "choice": [{"uniform": [lowest, largest]}, {"uniform": [_SMALL * lowest, _SMALL * largest]}]
        }
        if smallest is not None:
            size = {"log_uniform": [smallest * largest, largest]}
        others = dict(fault.others)
        if fault.effect.endswith("_single"):
            others["station"] = {"choice": list(range(machine.stations))}
        laws[fault.name] = {fault.effect: {fault.parameter: size, **others}}
    return laws


def order_of(
    posterior: Path, faults: Sequence[Fault], points: Sequence[OperatingPoint], machine: Machine, sensor: Sensor,
    cells: Cells, load_uncertainty: float, count: int, seed: int, how_many: Sequence[float] = HOW_MANY,
    smallest: float | None = None,
) -> Order:  # fmt: skip
    """The order of the data: `indexer generate` makes the same records of it."""
    slowest = min(points, key=lambda p: p.motor_speed)
    first, run = lead_in(machine, cells, slowest.motor_speed, slowest.load_torque)
    campaign = Own(
        machines=count,
        posterior=str(posterior),
        faults=fault_laws(faults, machine, smallest),
        how_many=tuple(_trimmed(how_many, len(faults))),
        points=tuple(
            {"motor_speed": p.motor_speed, "load_torque": p.load_torque, "start_angle": first.start_angle}
            for p in _told_apart(points)
        ),
        split=SPLIT,
        drift={"operating_point": {"load_torque": {"around": math.sqrt(3.0) * OWN_LOAD * load_uncertainty}}}
        if any(p.load_torque for p in points)
        else {},
    )
    base = Base(machine, slowest, sensor=sensor)
    return Order(campaign, base, run, count, seed, _SHARD)


def untaught(posterior: Path, into: Path) -> Path:
    """A table of the machines that no network is taught on: healthy turns of others would raise too few alarms. All of
    a posterior of one machine."""
    import pyarrow.parquet as pq

    schedule = subset_schedule(SPLIT, "split")
    table = pq.read_table(posterior)
    kept = [row for row in range(len(table)) if schedule[row % len(schedule)] == "control" or len(table) == 1]
    into.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table.take(kept), into)
    return into


def _trimmed(how_many: Sequence[float], faults: int) -> list[float]:
    kept = list(how_many[: faults + 1])
    return [share / sum(kept) for share in kept]


def made(
    order: Order, faults: Sequence[Fault], healthy: Healthy, points: Sequence[OperatingPoint],
    folder: Path | None = None, advance: Callable[[int], None] = lambda items: None,
) -> Turns:  # fmt: skip
    """The turns of an order; shards that `folder` holds already are read, the others are made and left there."""
    reference = healthy.turns(points)
    parts = []
    for number in range(order.shards):
        file = None if folder is None else folder / f"{number:04d}.safetensors"
        if file is not None and file.exists():
            part = load_file(file)
        else:
            part = _shard(order, number, faults, healthy, points, reference)
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                fresh = file.with_suffix(".part")
                save_file(part, fresh)
                fresh.rename(file)
        parts.append(part)
        advance(len(order.items_of(number)))
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if lacking := sum(len(order.items_of(number)) for number in range(order.shards)) - len(whole["x"]):
        _log.warning("%d simulated turns are left out: their machines cannot be simulated with these faults", lacking)
    return Turns(
        whole["x"].astype(np.float32), whole["point"], whole["size"], whole["size"] != 0.0, whole["station"],
        whole["subset"], points, reference,
    )  # fmt: skip


def _shard(
    order: Order, number: int, faults: Sequence[Fault], healthy: Healthy, points: Sequence[OperatingPoint],
    reference: np.ndarray,
) -> dict[str, np.ndarray]:  # fmt: skip
    items = [order.campaign.item(index, order.base, order.seed) for index in order.items_of(number)]
    rows, records, _ = produce(order, items)
    by_number = {item.index: item for item in items}
    at = {p.motor_speed: k for k, p in enumerate(_told_apart(points))}
    campaign = order.campaign
    assert isinstance(campaign, Own)
    x, point, size, station, subset = [], [], [], [], []
    for row, record in zip(rows, records, strict=True):
        item = by_number[row["item"]]
        speed = item.operating_point["motor_speed"]
        place = at[speed]
        x.append(behind_lead_in(healthy.machine, healthy.cells, record.astype(float), speed) - reference[place])
        point.append(place)
        size.append(sizes_of(item.effects, campaign.row(item.label.machine_draw), faults, order.base.machine))
        single = item.effects.get("roller.crack_single", {}).get("station", -1)
        station.append(int(single) if size[-1][_place(faults, "crack_single")] else -1)
        subset.append(("calibration", "control", "validation").index(item.label.subset))
    return {
        "x": np.array(x, dtype=np.float16), "point": np.array(point), "size": np.array(size, dtype=np.float32),
        "station": np.array(station), "subset": np.array(subset),
    }  # fmt: skip


def _place(faults: Sequence[Fault], name: str) -> int:
    names = [fault.name for fault in faults]
    return names.index(name) if name in names else 0


def _told_apart(points: Sequence[OperatingPoint]) -> list[OperatingPoint]:
    """The points with speeds that differ by nothing that matters, so that a record's speed tells its point: its load is
    not the one stated."""
    return [dataclasses.replace(p, motor_speed=p.motor_speed * (1.0 + _APART * k)) for k, p in enumerate(points)]


def sizes_of(
    effects: Mapping[str, Mapping[str, float]], row: Mapping[str, float], faults: Sequence[Fault], machine: Machine
) -> list[float]:
    """Size t of each fault of an item, beyond what its row of the posterior has."""
    sizes = []
    for fault in faults:
        value = effects.get(fault.effect, {}).get(fault.parameter)
        before = row.get(f"effects.{fault.effect}.{fault.parameter}", 0.0)
        sizes.append(0.0 if value is None else fault.share(value - before, machine))
    return sizes
