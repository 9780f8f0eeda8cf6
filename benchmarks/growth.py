"""How the cost of a simulated turn grows with items, threads, length of the record and number of effects."""

from __future__ import annotations

import dataclasses
import resource
import sys
import time
from collections.abc import Sequence

from benchmarks import cases
from benchmarks.kernel import EFFECTS
from benchmarks.processes import GIB
from benchmarks.report import Row, number
from indexer_env.effects import make_effect
from indexer_env.machine import Machine
from indexer_env.run import Run
from indexer_env.simulate import simulate_batch

ITEMS = (1, 32, 1_000, 10_000, 100_000, 1_000_000)
TURNS = (0.5, 1.0, 2.0, 4.0)
BATCH = 128
REPEATS = 3


def measure(*, quick: bool) -> list[Row]:
    """All rows; `quick` takes few items."""
    items = ITEMS[:3] if quick else ITEMS
    batch = cases.draws(BATCH)
    simulate_batch(batch[:2], cases.OPERATING_POINT, Run(samples=10, warmup_turns=0), threads=1)
    by_items = [cost((batch * (n // BATCH + 1))[:n], repeats=REPEATS if n <= 1_000 else 1) for n in items]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    by_threads = [cost(batch * 4, threads=n) for n in (1, 2)]
    by_length = [cost(batch, turns=turns) for turns in TURNS]
    counts = range(len(EFFECTS) + 1)
    by_effects = [cost([with_effects(n)] * BATCH) for n in counts]
    return [
        _row("items", items, by_items),
        Row(
            f"peak memory of the process that ran these {items[-1]} items",
            "",
            f"{memory / GIB:.2f} GiB",
            None,
            {"bytes": memory},
        ),
        _row("threads", (1, 2), by_threads),
        _row("turns in a record", TURNS, by_length),
        _row("effects, smooth machine", counts, by_effects),
    ]


def with_effects(count: int) -> Machine:
    """The smooth machine with the first effects of benchmarks/kernel.py."""
    effects = tuple(make_effect(name, size) for name, size in list(EFFECTS.items())[:count])
    return dataclasses.replace(cases.smooth(), effects=effects)


def cost(machines: Sequence[Machine], *, threads: int = 1, turns: float = 1.0, repeats: int = REPEATS) -> float:
    """Processor time of a turn [s], warm-up left out, records dropped as soon as they are made; the best of some."""
    run = Run(samples=round(turns * cases.TURN_SAMPLES), warmup_turns=0)
    spent = []
    for _ in range(repeats):
        begin = time.process_time()
        simulate_batch(machines, cases.OPERATING_POINT, run, threads=threads, sink=lambda items, channels: None)
        spent.append(time.process_time() - begin)
    return min(spent) / (len(machines) * turns)


def _row(what: str, values: Sequence[float], costs: Sequence[float]) -> Row:
    text = ", ".join(f"{value:g}: {number(1e6 * spent)}" for value, spent in zip(values, costs, strict=True))
    return Row(
        f"processor time of a turn, µs, by number of {what}", "", text, None,
        {"values": list(values), "seconds": list(costs)},
    )  # fmt: skip
