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

from benchmarks.twin.pipelines import make_twin
from benchmarks.twin.table import Judged, markdown, summary
from benchmarks.twin.truth import Truth, fault, machine_of, taken, write_bench
from discrepancy.records.conditions import Conditions
from indexer_env import Signal
from indexer_env.effects import Effect
from indexer_env.motion_law.choose import motion_law
from twin.answer import answer_of
from twin.diagnosis import NOT_COMPARABLE, UNKNOWN
from twin.faults import FAULTS
from twin.twin import Twin

DEFAULTS = {
    "machines": 20, "records": 160, "physics": 8, "at_size": 40, "seed": 5, "noise": 0.015, "spread": 0.1,
    "simulated": 12000, "epochs": 25, "out": "benchmarks/twin/out", "methods": "twin",
}  # fmt: skip
"""Machines, records of each, those that physics judges too, those with a fault of the stated smallest size, seed,
noise over signal, spread of the drawing, the twin's sizes, folder, methods joined by commas."""

NETWORKS, REFINED, PHYSICS = "networks", "networks and synthesis", "networks, synthesis and physics"
"""Ways to judge a record."""

OTHER_LAWS = ("modified_trapezoid", "cycloidal", "polynomial_345")
"""Of tables of another make."""

NAMES = ("crack", "loose_base", "reducer_play")
SPEEDS, LOADS = (1200.0, 1500.0), (2.0, 20.0)
_STRANGERS = 0.1
"""Share of the records that have a fault of no table."""


def drawn(truth: Truth, rng: np.random.Generator) -> tuple[Truth, dict[str, float], tuple[Effect, ...], bool]:
    """The machine, sizes of its faults, their effects, and whether it is a stranger: a fault of no table, or a table of
    another make."""
    if rng.random() < _STRANGERS:
        if rng.random() < 0.5:
            law = motion_law(OTHER_LAWS[int(rng.integers(len(OTHER_LAWS)))])
            return dataclasses.replace(truth, machine=dataclasses.replace(truth.machine, motion_law=law)), {}, (), True
        height, centre = rng.uniform(4e-4, 1.2e-3), rng.uniform(0.1, 0.4)
        return truth, {}, (fault("cam.profile_error", height=height, centre=centre, half_width=0.06),), True
    there = [name for name in NAMES if rng.random() < 0.5]
    sizes = {name: float(rng.uniform(0.0, 1.0)) for name in there}
    return truth, sizes, effects_of(truth, sizes), False


def effects_of(truth: Truth, sizes: dict[str, float]) -> tuple[Effect, ...]:
    """Faults of these sizes."""
    return tuple(
        fault(FAULTS[name].effect, **{FAULTS[name].parameter: FAULTS[name].value(size, truth.machine)})
        for name, size in sizes.items()
    )


def judged(twin: Twin, truth: Truth, seed: int, records: int, by_physics: int, at_size: int) -> dict[str, list[Judged]]:
    """Records of a machine, judged by the networks alone, by networks and synthesis, and some with physics; further
    ones with a fault of the stated smallest size."""
    rng = np.random.default_rng(seed)
    ways = {NETWORKS: dataclasses.replace(twin, synthesis=None), REFINED: twin}
    ways = ways if twin.synthesis is not None else {NETWORKS: twin}
    rows: dict[str, list[Judged]] = {name: [] for name in (*ways, PHYSICS)}
    for number in range(records):
        real, sizes, effects, stranger = drawn(truth, rng)
        signal, stated = measured(real, rng.uniform(*SPEEDS), rng.uniform(*LOADS), effects, number, rng)
        above = all(size >= twin.matters.get(name, 1.0) for name, size in sizes.items())
        told = {name: FAULTS[name].told(size, truth.machine) for name, size in sizes.items()}
        seen = {name: way.diagnose_turn(signal, stated) for name, way in ways.items()}
        for name, one in seen.items():
            refused = one.verdict in (UNKNOWN, NOT_COMPARABLE)
            rows[name].append(row_of(sizes, told, one.faults, refused, above, stranger))
        last = list(seen.values())[-1]
        if number < by_physics and last.verdict != NOT_COMPARABLE:
            answer = answer_of(last, twin.explain([(signal, stated)]), twin.machine, twin.matters)
            refused = answer.verdict in (UNKNOWN, NOT_COMPARABLE)
            rows[PHYSICS].append(row_of(sizes, told, answer.faults, refused, above, stranger))
    stated_sizes = [one for one in twin.seen if one.size is not None]
    for number in range(at_size if stated_sizes else 0):
        one = stated_sizes[int(rng.integers(len(stated_sizes)))]
        sizes = {one.fault: float(one.size or 0.0)}
        signal, stated = measured(truth, one.motor_speed_rpm, one.load_torque, effects_of(truth, sizes), number, rng)
        alarm = ways[NETWORKS].diagnose_turn(signal, stated).alarm > 0.0
        none = frozenset()
        rows[NETWORKS].append(Judged(frozenset(sizes), none, none, False, True, at_size=alarm))
    return rows


def measured(
    truth: Truth, rpm: float, load: float, effects: tuple[Effect, ...], number: int, rng: np.random.Generator
) -> tuple[Signal, Conditions]:
    """A record and what is stated of it."""
    values, point = taken(truth, rpm, load, 1.1, rng, effects)
    signal = Signal(values, 1000.0, unit="rad/s^2", source=f"record {number}")
    return signal, Conditions(point.motor_speed, load, start_angle=point.start_angle, noise=truth.noise)


def row_of(
    sizes: dict[str, float], told: dict[str, float], faults: Sequence[Any], refused: bool, above: bool, stranger: bool
) -> Judged:
    """What is counted of a record."""
    held = tuple(one.low <= told[one.name] <= one.high for one in faults if one.name in told)
    named = frozenset(one.name for one in faults)
    large = frozenset(one.name for one in faults if one.matters)
    return Judged(frozenset(sizes), named, large, refused, above, held, stranger)


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
            found = judged(
                twin, truth, settings["seed"] + number, settings["records"], settings["physics"], settings["at_size"]
            )
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
                        **{**r, **{k: frozenset(r[k]) for k in ("true", "named", "large")}, "held": tuple(r["held"])}
                    )
                    for r in rows
                ]
                table.setdefault((f"{key.split()[1]}, {name}", one["kind"]), []).append(summary(given))
    return dict(sorted(table.items()))


if __name__ == "__main__":
    main(sys.argv[1:])
