"""Turns per second of the simulator, beside a vmapped JAX scan of the same scheme in the same session."""

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
    what = f"the same ÷ a vmapped JAX scan of RK4, {STEPS_PER_SAMPLE} steps per ms, in the same session"
    required = "≥ 10 ×"
    if version(peers.DISTRIBUTIONS["jax"]) is None:
        return Row(what, required, "jax is not installed (extra [bench])")
    from benchmarks.peers.jax_peer import scan, split_over_cores

    function = scan(1000.0, samples, STEPS_PER_SAMPLE)
    everything = np.stack([peers.parameters(machine, cases.OPERATING_POINT) for machine in machines])
    share = samples / cases.TURN_SAMPLES
    alone, split = {}, {}
    for size in (size for size in JAX_BATCHES if size <= len(everything)):
        for found, p in ((alone, everything[:size]), (split, split_over_cores(everything[:size]))):
            times = median_time(lambda p=p: np.asarray(function(p)), repeats)
            found[size] = tuple(share * size / duration for duration in times)
    (best, _), (best_split, _) = max(alone.values()), max(split.values())
    best_processor = max(processor for _, processor in (*alone.values(), *split.values()))
    ratios = own["turns_per_s"] / np.array([best, best_split])
    per_core = own["turns_per_processor_s"] / best_processor
    return Row(
        what,
        required,
        f"{ratios[0]:.1f} × (scan: {number(best)} turns/s); {ratios[1]:.1f} × when its batch is split over the {CORES} "
        f"cores by hand ({number(best_split)}); {per_core:.1f} × per second of one core's time "
        f"({number(best_processor)})",
        bool(ratios[0] >= 10.0),
        {
            "ratio": float(ratios[0]), "ratio_split": float(ratios[1]), "ratio_per_processor_s": per_core,
            "turns_per_wall_and_processor_s": {"alone": alone, "split": split},
        },
    )  # fmt: skip
