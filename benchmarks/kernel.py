"""The simulator beside an older copy of itself: `python -m benchmarks.kernel OTHER_CHECKOUT`.

Every case runs in fresh processes of both checkouts, turn and turn about, each with its own compiled code; processor
time of one thread counts, the best of the rounds, since others may be at work on the machine. Beside them what a start
costs, and the discrepancy workflow on the records of examples/hidden_effect.py. Writes the section `kernel`, of a part
of the cases their rows alone.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.report import Row, number, store
from benchmarks.session import description

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


LEAST = {"smooth": (4.0, 6500.0), "play": (2.5, 0.0), "random": (3.5, 130.0)}
"""Least ratio to commit f72bab9, and least turns (of `random` records) per second of a core."""

HIDDEN_EFFECT = 13.0
"""s of processor time; half of what commit f72bab9 took."""


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


def speeds(other: Path, cases: Sequence[str], rounds: int) -> list[Row]:
    """Rates of both checkouts and their ratio; of effects the time over that of the smooth machine beside them."""
    own, found = Path(__file__).resolve().parents[1], {}
    for case in cases:
        runs = [(checkout, each) for each in _beside(case) for checkout in (other, own)]
        found[case] = [[measured(*one) for one in runs] for _ in range(rounds)]
        print(f"  {case}: {', '.join(number(max(values)) for values in zip(*found[case], strict=True))}", flush=True)
    if "smooth" in found:
        # it also ran beside each effect, and the best of all rounds counts
        found["smooth"] += [one[2:] for case, values in found.items() if len(_beside(case)) == 2 for one in values]
    return [_row(case, *(max(values) for values in zip(*found[case], strict=True))) for case in cases]


def _beside(case: str) -> tuple[str, ...]:
    """The cases that are run in alternation: an effect and none, since the machine's speed changes within minutes."""
    return (case, "smooth") if case in EFFECTS or case == "five effects" else (case,)


def _row(case: str, before: float, now: float, *none: float) -> Row:
    what = f"turns per second of a core, {case}: now, and over an older checkout"
    ratio, text = now / before, f"{number(now)}, {now / before:.2f} × ({number(before)})"
    numbers = {"before": before, "now": now, "ratio": ratio}
    if case == "random":
        what = "records per second of a core, 576 of campaign=random: now, and over an older checkout"
    if case in LEAST:
        least_ratio, least = LEAST[case]
        required = f"≥ {least_ratio:g} ×" + (f", ≥ {least:g}" if least else "")
        return Row(what, required, text, ratio >= least_ratio and now >= least, numbers)
    if not none:
        return Row(what, "", text, None, numbers)
    shares = none[0] / before, none[1] / now
    most = 2.5 if case == "five effects" else 1.5
    return Row(
        f"{what}; time over that of none", f"≤ {most:g} × of none",
        f"{text}; {shares[1]:.2f} × of none ({shares[0]:.2f} × before)",
        shares[1] <= most, numbers | {"over_none": shares[1], "over_none_before": shares[0]},
    )  # fmt: skip


def processor_time(arguments: Sequence[str], **environment: str) -> float:
    """Processor time [s] of Python with these arguments in the project's root, children included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments], check=True, capture_output=True, env=os.environ | environment,
        cwd=Path(__file__).resolve().parents[1],
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def starts(rounds: int) -> list[Row]:
    """Processor time to the first record, with and without compilation."""
    record = ["-c", "from indexer_env import load_machine, simulate; simulate(load_machine('reference'))"]
    spent = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as cache:
            spent.append([processor_time(record, NUMBA_CACHE_DIR=cache) for _ in range(2)])
    first, later = np.min(spent, axis=0).tolist()
    return [
        Row(
            "new process to the first record in a fresh installation, processor time",
            "≤ 20 s", f"{first:.1f} s", first <= 20.0, {"processor_s": first},
        ),
        Row(
            "new process to the first record, later starts, processor time",
            "≤ 1 s", f"{later:.2f} s", later <= 1.0, {"processor_s": later},
        ),
    ]  # fmt: skip


def hidden_effect(rounds: int) -> Row:
    """`indexer explain` on the three records of examples/hidden_effect.py."""
    with tempfile.TemporaryDirectory() as folder:
        processor_time(["examples/hidden_effect.py", f"{folder}/bench"])
        explain = ["-m", "indexer_cli", "explain", f"measured={folder}/bench", "machine=reference"]
        spent = min(processor_time([*explain, f"out={folder}/report{k}"]) for k in range(rounds))
    return Row(
        "examples/hidden_effect.py solved by indexer explain, processor time", f"≤ {HIDDEN_EFFECT:g} s",
        f"{spent:.1f} s", spent <= HIDDEN_EFFECT, {"processor_s": spent},
    )  # fmt: skip


COSTS = {"starts": starts, "hidden effect": lambda rounds: [hidden_effect(rounds)]}
"""What is measured of this checkout alone, by name."""


def main() -> None:
    """Measure what is asked for and write it into the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kernel", description=__doc__)
    every = (*CASES, *COSTS)
    parser.add_argument("other", type=Path, help="another checkout of this repository, to be measured beside this one")
    parser.add_argument("--cases", nargs="+", choices=every, default=every, metavar="CASE", help=", ".join(every))
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    arguments = parser.parse_args()
    about = description()
    rows = speeds(arguments.other.resolve(), [case for case in arguments.cases if case in CASES], arguments.rounds)
    for name in arguments.cases:
        rows += COSTS[name](arguments.rounds) if name in COSTS else []
    store("kernel", rows, about, part=tuple(arguments.cases) != every)


if __name__ == "__main__" and "--child" not in sys.argv:
    main()
