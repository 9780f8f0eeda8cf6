"""Turns per second of the simulator, beside a JAX scan of classical RK4 in the same session, per core."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from benchmarks import cases, peers, processes
from benchmarks.report import Row, number
from benchmarks.session import CORES, version
from indexer_env.machine import Machine
from indexer_env.presets import load_machine
from indexer_env.run import Run
from indexer_env.simulate import simulate_batch

BATCH = 1024
STEPS_PER_SAMPLE = 4
JAX_BATCHES = (32, 128, 512)
"""Machines at once in the scan; the fastest counts."""

STREAMED = 10_000

_JAX = (
    f"the same ÷ a JAX scan of RK4 in structure-of-arrays form, {STEPS_PER_SAMPLE} steps per ms, in the same session",
    "≥ 12 × per core",
)

Rates = dict[str, dict[str, tuple[float, float]]]
"""Turns per second of the clock and of one core's time of the scan as XLA runs it ("alone") and split over the cores
by hand ("split"), by batch size."""


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` takes small batches and one repeat."""
    size, repeats, samples = (64, 1, 1000) if quick else (BATCH, 5, cases.TURN_SAMPLES)
    machines = cases.draws(size)
    own, row = _own(machines, repeats)
    return [
        row,
        _beside_jax(own, machines, samples, 1 if quick else 3),
        _others(size, repeats),
        processes.memory(256 if quick else STREAMED),
        *processes.start(1 if quick else 5),
    ]


def median_time(action: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median wall time and processor time [s] of an action that was done once before."""
    action()
    walls, processor = [], []
    for _ in range(repeats):
        begin, begin_processor = time.perf_counter(), time.process_time()
        action()
        walls.append(time.perf_counter() - begin)
        processor.append(time.process_time() - begin_processor)
    return statistics.median(walls), statistics.median(processor)


def _rates(machines: list[Machine], repeats: int) -> dict[str, float]:
    """Turns per second, per second of processor time, and finished records per second."""
    turns = 0

    def action() -> None:
        nonlocal turns
        batch = simulate_batch(machines, cases.OPERATING_POINT, Run(), threads=CORES)
        if batch.rejected:
            raise ArithmeticError(next(iter(batch.rejected.values())))
        turns = int((batch.warmup_turns + 1).sum())

    wall, processor = median_time(action, repeats)
    return {
        "turns_per_s": turns / wall,
        "turns_per_processor_s": turns / processor,
        "records_per_s": len(machines) / wall,
        "batch": len(machines),
    }


def _own(machines: list[Machine], repeats: int) -> tuple[dict[str, float], Row]:
    rates = _rates(machines, repeats)
    row = Row(
        f"simulated turns per second, Model B with play in both joints, 1 kHz output, {CORES} cores",
        "≥ 2000",
        f"{number(rates['turns_per_s'])} ({number(rates['turns_per_processor_s'])} per second of one core's time); "
        f"{number(rates['records_per_s'])} records/s after their warm-up",
        rates["turns_per_s"] >= 2000.0,
        rates,
    )
    return rates, row


def _others(size: int, repeats: int) -> Row:
    reference = _rates([load_machine("reference")] * size, repeats)
    smooth = _rates([cases.smooth()] * size, repeats)
    return Row(
        "for comparison: the reference machine (0.58 mrad at the input), and the smooth one",
        "",
        f"{number(reference['turns_per_s'])} and {number(smooth['turns_per_s'])} turns/s "
        f"({number(reference['turns_per_processor_s'])} and {number(smooth['turns_per_processor_s'])} "
        "per second of one core's time)",
        None,
        {"reference": reference, "smooth": smooth},
    )


def _beside_jax(own: dict[str, float], machines: list[Machine], samples: int, repeats: int) -> Row:
    if version(peers.DISTRIBUTIONS["jax"]) is None:
        return Row(*_JAX, "jax is not installed (extra [bench])")
    from benchmarks.peers.jax_peer import scan, split_over_cores

    function = scan(1000.0, samples, STEPS_PER_SAMPLE)
    everything = np.stack([peers.parameters(machine, cases.OPERATING_POINT) for machine in machines])
    share = samples / cases.TURN_SAMPLES
    rates: Rates = {"alone": {}, "split": {}}
    for size in (size for size in JAX_BATCHES if size <= len(everything)):
        for how, p in (("alone", everything[:size]), ("split", split_over_cores(everything[:size]))):
            times = median_time(lambda p=p: np.asarray(function(p)), repeats)
            rates[how][str(size)] = tuple(share * size / duration for duration in times)
    return jax_row(own, rates)


def jax_row(own: dict[str, float], rates: Rates) -> Row:
    """Both per second of one core's time; by the clock only where both have all cores."""
    scan = max(processor for found in rates.values() for _, processor in found.values())
    split = max(wall for wall, _ in rates["split"].values())
    per_core, by_clock = own["turns_per_processor_s"] / scan, own["turns_per_s"] / split
    return Row(
        *_JAX,
        f"{per_core:.1f} × ({number(scan)} turns per second of one core's time); by the clock, when the scan's batch "
        f"is split over the {CORES} cores by hand, {by_clock:.1f} × ({number(split)} turns/s)",
        per_core >= 12.0,
        {"ratio_per_core": per_core, "ratio_split": by_clock, "turns_per_wall_and_processor_s": rates},
    )
