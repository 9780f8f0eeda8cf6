"""`python -m benchmarks.twin machines=20 records=160`: the twin's table.

For each machine a bench is written, the twin made of it as a user would, and records of all combinations of crack,
loose base and play of any size diagnosed, a few also by physics; further records have a fault that is in no table. The
paper's network is asked beside, taught on the same turns. Physics is also asked about all records that networks and
synthesis misname: a row of records chosen by that, which tells how many of them it mends and no share of all.

Other rows are asked for by methods=twin,oracle,nominal,point,unextended,transfer: the true machine, machines of the
drawing ±10 % without a fit, no posterior, nothing added that the drawing lacks, and a network of the drawing that goes
on learning from labelled records of the machine.

Records of the truth go to OUT/truth, rows to OUT/rows and counts of them to COUNTS (OUT/counts), a file for each
machine and method; a run that was stopped goes on where it was, and only=0,1 makes a part of it. The table holds all
counts that are there: counts=benchmarks/twin/counts prints the published one and makes what is not in it.
"""

from __future__ import annotations

import json
import math
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.twin.judging import AGAIN, PHYSICS, REFINED, at_stated_size, by_physics, judged, misnamed, ways_of
from benchmarks.twin.pipelines import METHODS, make_twin, of_paper
from benchmarks.twin.records import records_of
from benchmarks.twin.table import Counts, Judged, counts, markdown
from benchmarks.twin.transfer import transferred
from benchmarks.twin.truth import DRAWS, Purpose, Truth, machine_of, rng_of, write_bench
from twin.folder import VERSION
from twin.settings import Settings
from twin.workplace import keep

DEFAULTS = {
    "machines": 20, "only": "", "records": 160, "physics": 8, "at_size": 40, "seed": 5, "noise": 0.015, "spread": 0.1,
    "simulated": Settings().simulated, "out": "benchmarks/twin/out", "counts": "", "methods": "twin",
}  # fmt: skip
"""Machines, numbers of those to be done (all), records of each, those that physics judges too, those with a fault of
the stated smallest size, seed, noise over signal, spread of the drawing, turns that a twin simulates, folders, methods
joined by commas."""

OF_ROWS = ("records", "physics", "at_size", "seed", "simulated")
"""Settings that a row is made with and its file's name does not tell."""

MADE_WITH = "settings.json"
"""File of them in the folder in which rows are made."""

OF_PAPER = "paper's network"
"""Row of the paper's network."""

TRANSFER = "transfer"
"""The method that makes no twin."""


def done(truth: Truth, number: int, method: str, settings: dict[str, Any], out: Path) -> dict[str, Any]:
    """The rows of a machine and a method."""
    name = f"{settings['noise']:g}-{settings['spread']:g}-{number}"
    seed = settings["seed"]
    kept = out / "truth" / f"{name}-{seed}-draws-{DRAWS}.npz"
    records = records_of(truth, settings["records"], rng_of(Purpose.RECORDS, number, seed), kept)
    if method == TRANSFER:
        rows = transferred(truth, records, seed + number, rng_of(Purpose.DRAWING, number, seed))
        return {"kind": truth.kind, "rows": {name: [row.plain() for row in given] for name, given in rows.items()}}
    work = work_of(out, settings, number, method)
    if not work.exists():
        _begin(work, made_with(settings))
    if not (work / "bench").exists():
        write_bench(truth, work / "bench", rng_of(Purpose.BENCH, number, seed))
    fresh, spent = not (work / "twin").exists(), time.process_time()
    twin = make_twin(method, truth, work, simulated=settings["simulated"])
    made = time.process_time() - spent if fresh else None
    ways = ways_of(twin)
    if method == "twin":
        ways[OF_PAPER] = of_paper(twin)
    found = judged(ways, truth, records, work / "rows.jsonl")
    if method == "twin":
        physics = settings["physics"]
        found[PHYSICS] = by_physics(twin, truth, records[:physics])
        if physics and REFINED in found:
            found[AGAIN] = by_physics(twin, truth, misnamed(records, found[REFINED]))
        rng = rng_of(Purpose.AT_SIZE, number, seed)
        found[next(iter(ways))] += at_stated_size(twin, truth, settings["at_size"], rng)
    about = twin.about
    return {
        "kind": truth.kind, "made_cpu_s": made, "headline": about["calibration"]["headline"], "matters": twin.matters,
        "trusted": about["check"]["trusted"], "scores": about["scores"],
        "rows": {name: [row.plain() for row in rows] for name, rows in found.items()},
    }  # fmt: skip


def made_with(settings: dict[str, Any]) -> dict[str, Any]:
    """What rows depend on that their file's name does not tell."""
    return {key: settings[key] for key in OF_ROWS} | {"draws": DRAWS, "twin": VERSION}


def work_of(out: Path, settings: dict[str, Any], number: int, method: str) -> Path:
    """The folder in which the rows of a machine and a method are made."""
    return out / f"work-{settings['noise']:g}-{settings['spread']:g}-{number}-{method}"


def _begin(work: Path, own: dict[str, Any]) -> None:
    """A folder to work in that says what is made there."""
    fresh = work.with_name(f".{work.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    (fresh / MADE_WITH).write_text(json.dumps(own))
    fresh.rename(work)


def main(arguments: Sequence[str]) -> None:
    """The table of the settings KEY=VALUE."""
    settings = settings_of(arguments)
    out = Path(settings["out"])
    counted = Path(settings["counts"] or out / "counts")
    for folder in (out / "rows", counted):
        folder.mkdir(parents=True, exist_ok=True)
    numbers = settings["only"] or range(settings["machines"])
    law = f"{settings['noise']:g}-{settings['spread']:g}"
    own = made_with(settings)
    for key, kept in (("out", out / "rows"), ("counts", counted)):
        for file in sorted(kept.glob(f"{law}-*.json")):
            _check_made_with(file, json.loads(file.read_text()).get("settings"), own, key)
    for folder in sorted(out.glob(f"work-{law}-*")):
        file = folder / MADE_WITH
        _check_made_with(folder, json.loads(file.read_text()) if file.exists() else None, own, "out")
    for number in numbers:
        truth = machine_of(number, settings["seed"], settings["noise"], settings["spread"])
        for method in settings["methods"]:
            name, work = f"{law}-{number}-{method}.json", work_of(out, settings, number, method)
            if not (counted / name).exists():
                rows = out / "rows" / name
                if not rows.exists():
                    made = {**done(truth, number, method, settings, out), "settings": own}
                    keep(rows, json.dumps(made).encode())
                found = counts_of(json.loads(rows.read_text()))
                keep(counted / name, (json.dumps(found, indent=1) + "\n").encode())
                print(number, method, found, flush=True)
            shutil.rmtree(work, ignore_errors=True)
    print(markdown(table_of(sorted(counted.glob(f"{law}-*.json")))))


def counts_of(found: dict[str, Any]) -> dict[str, Any]:
    """What is kept of the rows of a machine and a method: counts, and median and 95 % of a record's processor time."""
    rows = {name: [Judged.restore(row) for row in given] for name, given in found["rows"].items() if given}
    spent = {name: [row.cpu for row in given if row.cpu] for name, given in rows.items()}
    about = {key: found[key] for key in ("kind", "settings", "made_cpu_s", "trusted", "headline") if key in found}
    return {
        **about,
        "cpu_s": {name: np.quantile(given, (0.5, 0.95)).round(3).tolist() for name, given in spent.items() if given},
        "counts": {name: counts(given) for name, given in rows.items()},
    }


def settings_of(arguments: Sequence[str]) -> dict[str, Any]:
    """DEFAULTS with what the command says instead, `only` and `methods` as lists; stops at what makes no sense."""
    settings: dict[str, Any] = dict(DEFAULTS)
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key not in DEFAULTS:
            raise SystemExit(f"benchmarks.twin: {key} must be one of {', '.join(DEFAULTS)}.")
        settings[key] = value if isinstance(DEFAULTS[key], str) else _number(key, value, type(DEFAULTS[key]))
    settings["only"] = [_number("only", each, int) for each in settings["only"].split(",") if each]
    settings["methods"] = settings["methods"].split(",")
    known = (*METHODS, TRANSFER)
    for method in settings["methods"]:
        if method not in known:
            raise SystemExit(f"benchmarks.twin: methods must be some of {', '.join(known)}, got {method!r}.")
    return settings


def _number(key: str, text: str, kind: type[int] | type[float]) -> int | float:
    """A number of this kind, 0 or more."""
    try:
        number = kind(text)
    except ValueError:
        number = math.nan
    if not 0 <= number < math.inf:
        rule = "whole numbers" if key == "only" else "a whole number" if kind is int else "a number"
        raise SystemExit(f"benchmarks.twin: {key} must be {rule} >= 0, got {text!r}.")
    return number


def _check_made_with(path: Path, held: object, own: dict[str, Any], key: str) -> None:
    """Stop at what an earlier run has left with other settings, or without saying with which."""
    if held != own:
        got = "settings that it does not tell" if held is None else held
        raise SystemExit(f"benchmarks.twin: {path} was made with {got}, not {own}; name another {key}.")


def table_of(files: Sequence[Path]) -> dict[tuple[str, str], list[Counts]]:
    """Counts of each machine by method and kind of machine."""
    table: dict[tuple[str, str], list[Counts]] = {}
    for file in files:
        held, method = json.loads(file.read_text()), file.stem.split("-")[-1]
        for name, given in held["counts"].items():
            table.setdefault((f"{method}, {name}", held["kind"]), []).append(given)
    return dict(sorted(table.items()))


if __name__ == "__main__":
    main(sys.argv[1:])
