"""The generator of data sets end to end, beside the bare simulator: speed, memory, start, disk, and a Ray cluster."""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.dataset
import pyarrow.parquet as pq

from benchmarks.processes import GIB, child
from benchmarks.report import Row, number
from benchmarks.session import CORES, version
from datagen.campaign import Base, build
from datagen.campaigns import make_campaign
from datagen.make_shard import make_shard
from datagen.order import Order
from datagen.schema import RECORD
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_yaml
from indexer_env.simulate import simulate_batch

BATCH, COUNT, RAY_COUNT = 1152, 100_000, 11_520
LEVEL = 22
"""The highest of zstd."""


@dataclass(frozen=True)
class Cost:
    """Turns of table2, warm-up included, per second of the clock and of one core's time."""

    per_second: float
    per_processor_second: float


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` takes small counts and one repeat."""
    count, repeats = (600, 1) if quick else (COUNT, 5)
    order = table2(64 if quick else BATCH)
    bare, shards = costs(order, repeats)
    with tempfile.TemporaryDirectory() as folder:
        done = child(["-m", "datagen", "campaign=table2", f"count={count}", f"out={folder}/set"])
        turns = simulated_turns(Path(folder) / "set")
        first, both = first_shard(Path(folder), 1 if quick else 3)
        size, best = sizes(Path(folder) / "two-0" / "data" / "shard-00000.parquet")
    share, processor_share = (
        turns / done.duration / bare.per_second,
        shards.per_processor_second / bare.per_processor_second,
    )
    minutes = done.duration / 60.0 * COUNT / count
    return [
        Row(
            f"end to end, {count} records of table2 simulated, sensed, written and checksummed, {CORES} cores, start "
            "of Python included, as a share of the bare simulator's turns/s",
            "≥ 80 %",
            f"{share:.0%} ({number(turns / done.duration)} of {number(bare.per_second)} turns/s); "
            f"{processor_share:.0%} by processor time",
            share >= 0.8,
            {"share": share, "share_of_processor_time": processor_share, "turns_per_s": turns / done.duration},
        ),
        Row(
            f"100 000 records{'' if count == COUNT else f', from {count}'}",
            "≤ 2.5 min", f"{minutes:.1f} min", minutes <= 2.5, {"duration_s": 60.0 * minutes},
        ),
        Row(
            f"peak memory of the generator, {count} records",
            "< 1 GiB", f"{done.peak_memory / GIB:.2f} GiB", done.peak_memory < GIB, {"bytes": done.peak_memory},
        ),
        Row(
            "new process to the first shard of 576 records in its place, warm cache",
            "< 3 s", f"{first:.1f} s; {both:.1f} s to the finished data set of two, with card and pictures",
            first < 3.0, {"duration_s": first, "finished_s": both},
        ),
        Row(
            f"disk for a record of 8200 samples, over the same at zstd's level {LEVEL}",
            "≤ 1.10", f"{size:.0f} bytes, {size / best:.3f} × ({best:.0f})", size <= 1.1 * best,
            {"bytes": size, "best_bytes": best},
        ),
        beside_ray(1024 if quick else RAY_COUNT),
    ]  # fmt: skip


def first_shard(folder: Path, repeats: int) -> tuple[float, float]:
    """Time from a new process to its first shard in its place, and to its finished data set of two [s]; medians."""
    first, both = [], []
    for place in (folder / f"two-{repeat}" for repeat in range(repeats)):
        begin = time.time()
        done = child(["-m", "datagen", "campaign=table2", "count=1152", f"out={place}"])
        first.append((place / "data" / "shard-00000.parquet").stat().st_mtime - begin)
        both.append(done.duration)
    return statistics.median(first), statistics.median(both)


def table2(count: int) -> Order:
    """The campaign of the measurements, in shards of the default size."""
    base = Base(load_machine("reference"), OperatingPoint())
    return Order(make_campaign(load_yaml("campaign", "table2")), base, count=count, seed=1)


def costs(order: Order, repeats: int) -> tuple[Cost, Cost]:
    """The bare simulator on all cores, and shards made one after the other by one thread; the best of turn and turn
    about, since others may be at work."""
    cases = [build(order.campaign.item(index, order.base, order.seed), order.base) for index in range(order.count)]
    machines, points = [case.machine for case in cases], [case.operating_point for case in cases]
    simulate_batch(machines[:32], points[:32], order.run)
    bare, shards = [], []
    for _ in range(repeats):
        begin, processor = time.perf_counter(), time.process_time()
        batch = simulate_batch(machines, points, order.run)
        turns = int((batch.warmup_turns + 1).sum())
        bare.append((turns / (time.perf_counter() - begin), turns / (time.process_time() - processor)))
        begin, processor = time.perf_counter(), time.process_time()
        for shard in range(order.shards):
            make_shard(order, shard)
        shards.append((turns / (time.perf_counter() - begin), turns / (time.process_time() - processor)))
    bare_best, shards_best = (Cost(*map(max, zip(*found, strict=True))) for found in (bare, shards))
    return bare_best, shards_best


def simulated_turns(folder: Path) -> int:
    """Turns behind the records of a data set, those of the warm-up included."""
    warmup = pyarrow.dataset.dataset(folder / "data").to_table(columns=["warmup_turns"]).column(0).to_numpy()
    return int(warmup.sum()) + len(warmup)


def sizes(shard: Path) -> tuple[float, float]:
    """Bytes a record of a shard, and of the same table at zstd's highest level."""
    table, sink = pq.read_table(shard), pa.BufferOutputStream()
    pq.write_table(
        table, sink, version="2.6", compression="zstd", compression_level=LEVEL,
        use_dictionary=[name for name in table.column_names if name != RECORD],  # pyright: ignore[reportArgumentType]
        column_encoding={f"{RECORD}.list.element": "BYTE_STREAM_SPLIT"}, row_group_size=len(table),
    )  # fmt: skip
    return shard.stat().st_size / len(table), len(sink.getvalue()) / len(table)


def beside_ray(count: int) -> Row:
    """A cluster of two nodes of one core each beside two threads of one process."""
    what, required = "Ray, 2 nodes of one core, as a share of executor=local", "≥ 85 %"
    if version("ray") is None:
        return Row(what, required, "ray is not installed (extra [ray])")
    found = json.loads(child(["-m", "benchmarks.ray_cluster", str(count)]).output.splitlines()[-1])
    share = found["local_s"] / found["ray_s"]
    return Row(
        what, required, f"{share:.0%} ({found['ray_s']:.1f} s against {found['local_s']:.1f} s for {count} records)",
        share >= 0.85, found,
    )  # fmt: skip
