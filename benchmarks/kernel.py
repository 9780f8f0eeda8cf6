"""The simulator beside an older copy of itself: `python -m benchmarks.kernel OTHER_CHECKOUT`.

Every case runs in fresh processes of both checkouts, turn and turn about, each with its own compiled code; processor
time of one thread counts, the best of the rounds, since others may be at work on the machine. Prints a table.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

ROUNDS, REPEATS = 3, 3
"""Processes of a case, and batches in each."""

BATCH = 128
"""Machines of a case: full blocks."""

EFFECTS = {
    "friction.coulomb": {"torque": 5.0}, "load.imbalance": {"torque": 10.0}, "drive.speed_ripple": {"depth": 5e-3},
    "drive.transmission_error": {"amplitude": 1e-4}, "cam.profile_error": {"height": 1e-4},
}  # fmt: skip
"""One of each kind, of a size that shows."""

CASES = ("smooth", "play", "reference", *EFFECTS, "five effects", "random")


def rate(case: str) -> float:
    """Turns, of `random` records, per second of one core's time, by this checkout's simulator at its default step."""
    from benchmarks import cases
    from indexer_env import Run, load_machine, make_effect, simulate_batch

    run, points = Run(), cases.OPERATING_POINT
    if case == "random":
        from benchmarks.data_sets import Base, Order, build, make_campaign
        from indexer_env.presets import load_yaml

        base = Base(load_machine("reference"), points)
        order = Order(make_campaign(load_yaml("campaign", "random")), base, count=576, seed=1)
        items = [build(order.campaign.item(index, base, order.seed), base) for index in range(order.count)]
        machines, points, run = [i.machine for i in items], [i.operating_point for i in items], order.run
    elif case == "play":
        machines = cases.draws(BATCH)
    elif case == "reference":
        machines = [load_machine("reference")] * BATCH
    else:
        chosen = {"smooth": (), "five effects": tuple(EFFECTS)}.get(case, (case,))
        effects = tuple(make_effect(name, EFFECTS[name]) for name in chosen)
        machines = [dataclasses.replace(cases.smooth(), effects=effects)] * BATCH
    few = points if not isinstance(points, list) else points[:2]
    simulate_batch(machines[:2], few, Run(samples=10, warmup_turns=0), threads=1)
    best = 0.0
    for _ in range(REPEATS):
        begin = time.process_time()
        batch = simulate_batch(machines, points, run, threads=1)
        duration = time.process_time() - begin
        if batch.rejected:
            raise ArithmeticError(next(iter(batch.rejected.values())))
        best = max(best, (len(machines) if case == "random" else int((batch.warmup_turns + 1).sum())) / duration)
    return best


def measured(checkout: Path, case: str) -> float:
    """The rate of a case in a process of its own, whose packages are those of a checkout."""
    environment = os.environ | {
        "PYTHONPATH": str(checkout),
        "NUMBA_CACHE_DIR": str(checkout / "benchmarks/.cache/numba"),
    }
    source = Path(__file__).read_text(encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", f"{source}\nprint(json.dumps(rate({case!r})))", "--child"],
        env=environment, cwd=checkout, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return float(json.loads(done.stdout.splitlines()[-1]))


def table(others: Path, cases: Sequence[str], rounds: int) -> None:
    """Print, line by line, rates of both checkouts, their ratio, and the time of an effect over that of none."""
    own = Path(__file__).resolve().parents[1]
    print("| case | before | now | ratio | time over none: before | now |\n|---|---|---|---|---|---|", flush=True)
    none: list[float] = []
    for case in cases:
        found = [[measured(checkout, case) for checkout in (others, own)] for _ in range(rounds)]
        best = [max(values) for values in zip(*found, strict=True)]
        none = best if case == "smooth" else none
        shares = ["", ""]
        if none and (case in EFFECTS or case == "five effects"):
            shares = [f"{at_none / value:.2f}" for at_none, value in zip(none, best, strict=True)]
        rates = f"{best[0]:.0f} | {best[1]:.0f} | {best[1] / best[0]:.2f}"
        print(f"| {case} | {rates} | {shares[0]} | {shares[1]} |", flush=True)


def main() -> None:
    """Measure the cases asked for and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kernel", description=__doc__)
    parser.add_argument("other", type=Path, help="another checkout of this repository, to be measured beside this one")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES, metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    arguments = parser.parse_args()
    table(arguments.other.resolve(), arguments.cases, arguments.rounds)


if __name__ == "__main__" and "--child" not in sys.argv:
    main()
