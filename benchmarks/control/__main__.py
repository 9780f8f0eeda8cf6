"""`python -m benchmarks.control [--steps N] [--seeds 0 1 2] [--processes 1] [--quick]`: train, measure, write."""

from __future__ import annotations

import argparse
import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.control import page
from benchmarks.control.baselines import best_constant, random, returns
from benchmarks.control.scripts import SCRIPTS, STEPS, trained
from benchmarks.report import with_table

QUICK = 4096


def main() -> None:
    """Run; a quick run prints only, since its numbers are not those of the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.control", description=__doc__)
    parser.add_argument("--steps", type=int, help="control periods of a training; left out: as each script has them")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="one training of each script for each")
    parser.add_argument("--processes", type=int, default=1, help="trainings at the same time, each in one thread")
    parser.add_argument("--quick", action="store_true", help="a look whether all runs; nothing is written")
    given = parser.parse_args()
    asked = QUICK if given.quick else given.steps
    share, found = best_constant()
    results = {
        "constant": {"share": share, "returns": found.tolist()},
        "random": {"returns": np.concatenate([returns(random(seed)) for seed in given.seeds]).tolist()},
        "trainings": [],
    }
    print(page.table(results), flush=True)
    with ProcessPoolExecutor(given.processes, multiprocessing.get_context("spawn")) as pool:
        waiting = [
            pool.submit(trained, script, asked or STEPS[script], seed) for script in SCRIPTS for seed in given.seeds
        ]
        for each in waiting:
            results["trainings"].append(each.result())
    print(page.table(results))
    if given.quick:
        return
    page.RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    page.PAGE.write_text(with_table(page.PAGE.read_text(encoding="utf-8"), page.table(results)), encoding="utf-8")


if __name__ == "__main__":
    main()
