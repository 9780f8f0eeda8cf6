"""The simulator on a GPU: turns and environment steps per second, beside those of a core; nothing without a GPU."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch

from benchmarks import cases, flops
from benchmarks.report import Row, number
from datagen.campaign import Base, build
from datagen.campaigns import make_campaign
from indexer_env import OperatingPoint, ParameterError, Run, Sensor, load_machine, simulate_batch
from indexer_env.coefficients import coefficients, pack
from indexer_env.device import cuda_of
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.modes import steps_of
from indexer_env.presets import load_yaml
from indexer_env.vector_env import IndexerVectorEnv

if TYPE_CHECKING:
    from indexer_env.cuda.device import Cuda
    from indexer_env.cuda.turns import OnCuda

TURNS = (
    "turns per second on a GPU with play, classes of table2, 1 kHz, states and samples on the card; its share of the "
    "card's double-precision peak"
)
STEPS = "environment steps per second on a GPU, {} machines, control period 10 ms, actions to observations on the card"
ON_CORE = "for comparison: the same on a CPU, per second of one core's time"

FLEET = 65_536
DISTINCT = 768
"""Machines of the batch that differ, 128 of each class; the rest repeat them."""

CAM_TURN = 1025
"""Samples of a cam turn, of which a table turn has eight alike."""

_PER_CLOCK = {(7, 0): 32, (8, 0): 32, (8, 6): 2, (8, 9): 2, (9, 0): 64, (10, 0): 64, (12, 0): 2}
"""Double-precision multiply-adds per clock and multiprocessor by compute capability (CUDA C++ Programming Guide,
throughput of native arithmetic instructions)."""


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` takes small batches. Without a GPU they say so."""
    try:
        cuda = cuda_of("benchmarks", "cuda")
    except ParameterError as error:
        said = f"not measured ({str(error).partition('needs ')[2].partition(',')[0]} is not here)"
        return [Row(TURNS, "≥ 300 000", said), Row(STEPS.format(FLEET), "≥ 5e7", said)]
    assert cuda is not None
    fleet, samples, distinct = (1024, 500, 48) if quick else (FLEET, cases.TURN_SAMPLES, DISTINCT)
    return [*turn_rows(cuda, fleet, samples, distinct), *step_rows(cuda, fleet, 10 if quick else 200)]


def machines(count: int) -> list[Machine]:
    """Machines of the classes of table2, as many of each."""
    settings = load_yaml("campaign", "table2")
    campaign = make_campaign({str(key): value for key, value in settings.items()})
    base = Base(load_machine("reference"), OperatingPoint(), sensor=Sensor())
    items = np.linspace(0, campaign.size - 1, count).astype(int)
    return [build(campaign.item(int(index), base, 0), base).machine for index in items]


def turn_rows(cuda: Cuda, count: int, samples: int, distinct: int, repeats: int = 3) -> list[Row]:
    """Turns per second of `count` machines, those of a CPU's core, and those of the whole of simulate_batch."""
    drawn = machines(distinct)
    on_card = _turn_rate(cuda, drawn, count, samples, repeats)
    counted = min(samples, CAM_TURN)
    each = [flops.of_a_turn(machine, counted) for machine in drawn[:: max(1, distinct // 6)]]
    operations = float(np.mean(each)) * cases.TURN_SAMPLES / counted
    peak = _peak(cuda)
    share = "share unknown" if peak is None else f"{on_card * operations / peak:.1%} of {peak / 1e12:.3g} TFLOP/s"
    run = Run(samples=samples, warmup_turns=0)

    def batch(device: str, repeated: int) -> float:
        begin, processor = time.perf_counter(), time.process_time()
        simulate_batch(drawn * repeated, run=run, sink=lambda items, channels: None, device=device)
        cuda.wait()
        spent = time.process_time() - processor if device == "cpu" else time.perf_counter() - begin
        return len(drawn) * repeated / spent * samples / cases.TURN_SAMPLES

    batch("cpu", 1), batch("cuda", 1)
    core, whole = batch("cpu", 1), batch("cuda", max(1, count // distinct))
    return [
        Row(
            TURNS, "≥ 300 000",
            f"{number(on_card)} on one {cuda.name}; {share}, at {number(operations / 1e6)} Mflop a turn",
            on_card >= 300_000.0, {"turns_per_s": on_card, "flop_a_turn": operations, "peak": peak},
        ),
        Row(f"{ON_CORE}; and all of simulate_batch on the GPU, its preparation by one core included", "",
            f"{number(core)}; {number(whole)}", None, {"turns_per_core_s": core, "simulate_batch_turns_per_s": whole}),
    ]  # fmt: skip


def _turn_rate(cuda: Cuda, drawn: list[Machine], count: int, samples: int, repeats: int) -> float:
    """Turns of TURN_SAMPLES per second of the kernel, the median of repeats: groups by model and step, each filled up
    to `count`, weighed by their machines."""
    from indexer_env.cuda.turns import OnCuda

    items = [coefficients(machine, cases.OPERATING_POINT) for machine in drawn]
    seconds = 0.0
    for model in {item.model for item in items}:
        alike = [item for item in items if item.model == model]
        _, accurate = steps_of(alike, [cases.OPERATING_POINT] * len(alike))
        parts = np.array([Run().steps_per_sample(step) for step in accurate])
        for part in np.unique(parts):
            chosen = [item for item, own in zip(alike, parts, strict=True) if own == part]
            whole = (chosen * -(-count // len(chosen)))[:count]
            rate = _group_rate(OnCuda(cuda), whole, int(part), samples, repeats)
            seconds += len(chosen) / len(items) / rate
    return samples / cases.TURN_SAMPLES / seconds


def _group_rate(runner: OnCuda, items: list, part: int, samples: int, repeats: int) -> float:
    """Items per second."""
    features = np.array([item.features for item in items])
    rates = []
    size = min(runner.most_items(samples, 1), len(items))
    for _ in range(repeats + 1):
        packed = pack(items[:size], [cases.OPERATING_POINT] * size)
        begin = time.perf_counter()
        runner.advance(
            packed, features[:size], np.full(size, samples * part), np.full(size, 1e-3 / part), np.zeros(size),
            every=part, rows=np.array([layout.TABLE_ACC]), samples=samples,
        )  # fmt: skip
        rates.append(size / (time.perf_counter() - begin))
    return float(np.median(rates[1:]))


def _peak(cuda: Cuda) -> float | None:
    """Double-precision peak of the card [FLOP/s], a multiply-add counted as two; None where it is not known."""
    if cuda.place.type == "cpu":
        return None
    from numba import cuda as driver

    with driver.gpus[cuda.index]:
        gpu = driver.get_current_device()
        each = _PER_CLOCK.get(tuple(gpu.compute_capability))
        return None if each is None else 2.0 * each * gpu.MULTIPROCESSOR_COUNT * gpu.CLOCK_RATE * 1e3


def step_rows(cuda: Cuda, fleet: int, periods: int) -> list[Row]:
    """Environment steps per second of a fleet, and of a CPU's core."""

    def rate(device: str, size: int, clock: Callable[[], float]) -> float:
        env = IndexerVectorEnv(size, device=device, period=0.01, max_episode_steps=10**6)
        env.reset(seed=0)
        actions = np.full((size, 1), 0.9, dtype=np.float32)
        given = torch.from_numpy(actions).to(cuda.place) if device == "cuda" else actions
        env.step(given)
        cuda.wait()
        begin = clock()
        for _ in range(periods):
            env.step(given)
        cuda.wait()
        return size * periods / (clock() - begin)

    on_card, core = rate("cuda", fleet, time.perf_counter), rate("cpu", min(fleet, 1024), time.process_time)
    return [
        Row(STEPS.format(fleet), "≥ 5e7", number(on_card), on_card >= 5e7, {"steps_per_s": on_card}),
        Row(ON_CORE, "", number(core), None, {"steps_per_core_s": core}),
    ]
