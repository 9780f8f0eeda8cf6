"""`python -m benchmarks.twin machines=20 records=160`: the twin's table.

For each machine a bench is written, the twin made of it as a user would, and records of all combinations of crack,
loose base and play of any size diagnosed, a few also by physics; further records have a fault that is in no table. The
other rows, methods=twin,oracle,nominal,point,paper: the true machine, machines of the drawing ±10 % without a fit, no
posterior, and the paper's network on the twin's data. Results go to OUT/results.json machine by machine, so that a run
that was stopped goes on.
"""

from __future__ import annotations

import dataclasses
import json
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.twin.pipelines import METHODS, make_twin
from benchmarks.twin.table import Judged, markdown, summary
from benchmarks.twin.truth import Truth, fault, machine_of, taken, write_bench
from discrepancy.records.conditions import Conditions
from indexer_env import Signal
from indexer_env.effects import Effect
from twin.answer import answer_of
from twin.diagnosis import NOT_COMPARABLE, UNKNOWN
from twin.faults import FAULTS
from twin.twin import Twin

DEFAULTS = {
    "machines": 20, "records": 160, "physics": 8, "seed": 5, "noise": 0.015, "spread": 0.1, "simulated": 10000,
    "epochs": 24, "out": "benchmarks/twin/out", "methods": "twin",
}  # fmt: skip
"""Machines, records of each, those that physics judges too, seed, noise over signal, spread of the drawing, the twin's
sizes, folder, methods joined by commas."""

NAMES = ("crack", "loose_base", "reducer_play")
SPEEDS, LOADS = (1200.0, 1500.0), (2.0, 20.0)
_STRANGERS = 0.1
"""Share of the records that have a fault of no table."""


def drawn(truth: Truth, rng: np.random.Generator) -> tuple[dict[str, float], tuple[Effect, ...], bool]:
    """Sizes of faults, their effects, and whether it is a fault of no table."""
    if rng.random() < _STRANGERS:
        height, centre = rng.uniform(4e-4, 1.2e-3), rng.uniform(0.1, 0.4)
        return {}, (fault("cam.profile_error", height=height, centre=centre, half_width=0.06),), True
    there = [name for name in NAMES if rng.random() < 0.5]
    sizes = {name: float(rng.uniform(0.0, 1.0)) for name in there}
    effects = tuple(
        fault(FAULTS[name].effect, **{FAULTS[name].parameter: FAULTS[name].value(size, truth.machine)})
        for name, size in sizes.items()
    )
    return sizes, effects, False


def judged(twin: Twin, truth: Truth, seed: int, records: int, by_physics: int) -> dict[str, list[Judged]]:
    """Records of a machine, judged by the networks, some of them with physics."""
    rng = np.random.default_rng(seed)
    rows: dict[str, list[Judged]] = {"networks": [], "networks and physics": []}
    for number in range(records):
        sizes, effects, stranger = drawn(truth, rng)
        rpm, load = rng.uniform(*SPEEDS), rng.uniform(*LOADS)
        values, point = taken(truth, rpm, load, 1.1, rng, effects)
        signal = Signal(values, 1000.0, unit="rad/s^2", source=f"record {number}")
        stated = Conditions(point.motor_speed, load, point.start_angle, noise=truth.noise)
        seen = twin.diagnose_turn(signal, stated)
        above = all(size >= twin.matters.get(name, 1.0) for name, size in sizes.items())
        held = tuple(
            one.low <= FAULTS[one.name].told(sizes[one.name], truth.machine) <= one.high
            for one in seen.faults
            if one.name in sizes
        )
        named = frozenset(one.name for one in seen.faults)
        refused = seen.verdict in (UNKNOWN, NOT_COMPARABLE)
        rows["networks"].append(Judged(frozenset(sizes), named, refused, above, held, stranger))
        if number < by_physics and seen.verdict != NOT_COMPARABLE:
            answer = answer_of(seen, twin.explain([(signal, stated)]), twin.machine, twin.matters)
            named = frozenset(one.name for one in answer.faults)
            refused = answer.verdict in (UNKNOWN, NOT_COMPARABLE)
            row = Judged(frozenset(sizes), named, refused, above, (), stranger)
            rows["networks and physics"].append(row)
    return rows


def main(arguments: Sequence[str]) -> None:
    """The table of the settings KEY=VALUE."""
    settings: dict[str, Any] = dict(DEFAULTS)
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key not in DEFAULTS:
            raise SystemExit(f"benchmarks.twin: {key} must be one of {', '.join(DEFAULTS)}.")
        settings[key] = type(DEFAULTS[key])(value)
    out = Path(settings["out"])
    out.mkdir(parents=True, exist_ok=True)
    file = out / "results.json"
    done: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    for number in range(settings["machines"]):
        truth = machine_of(number, settings["seed"], settings["noise"], settings["spread"])
        for method in settings["methods"].split(","):
            key = f"{number} {method} {settings['noise']} {settings['spread']}"
            if key in done:
                continue
            begun = time.process_time()
            work = out / "work"
            shutil.rmtree(work, ignore_errors=True)
            write_bench(truth, work / "bench", settings["seed"] + number)
            twin = make_twin(method, truth, work, settings["simulated"], settings["epochs"])
            made = time.process_time() - begun
            found = judged(twin, truth, settings["seed"] + number, settings["records"], settings["physics"])
            done[key] = {
                "kind": truth.kind, "made_cpu_s": made, "headline": twin.about["calibration"]["headline"],
                "trusted": twin.about["check"]["trusted"],
                "rows": {name: [plain(row) for row in rows] for name, rows in found.items()},
            }  # fmt: skip
            file.write_text(json.dumps(done, indent=1))
            shutil.rmtree(work, ignore_errors=True)
            print(key, truth.kind, {name: summary(rows) for name, rows in found.items()}, f"{made:.0f} s", flush=True)
    print(markdown(table_of(done)))


def plain(row: Judged) -> dict[str, Any]:
    """As JSON knows it."""
    return {k: sorted(v) if isinstance(v, frozenset) else v for k, v in dataclasses.asdict(row).items()}


def table_of(done: dict[str, Any]) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Summaries of each machine by method and kind."""
    table: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for key, one in done.items():
        for name, rows in one["rows"].items():
            if rows:
                given = [
                    Judged(
                        **{**r, "true": frozenset(r["true"]), "named": frozenset(r["named"]), "held": tuple(r["held"])}
                    )
                    for r in rows
                ]
                table.setdefault((f"{key.split()[1]}, {name}", one["kind"]), []).append(summary(given))
    return dict(sorted(table.items()))


if __name__ == "__main__":
    assert METHODS
    main(sys.argv[1:])
