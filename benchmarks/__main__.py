"""`python -m benchmarks [SECTION|all] [--quick]`: measure, print and write the results of a section of `report`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import logging
from collections.abc import Sequence
from pathlib import Path

from benchmarks import report, session

SECTIONS = tuple(name for name in report.SECTIONS if name != "kernel")
"""What needs no other checkout (benchmarks/kernel.py)."""

POINTS = Path(__file__).parent / "work_precision.json"


def main() -> None:
    """Run the sections asked for; a quick run prints only, since its numbers are not those of the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("section", nargs="?", default="all", choices=("all", *SECTIONS))
    parser.add_argument("--quick", action="store_true", help="small sizes, a look whether all runs; nothing is written")
    parser.add_argument("--only", nargs="+", default=(), metavar="SOLVER", help="solvers of `peers` to measure anew")
    arguments = parser.parse_args()
    if arguments.only and arguments.section != "peers":
        parser.error(f"--only is for the section peers, not for {arguments.section}.")
    session.keep_to_cores()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    for name in ("jax", "numba.cuda"):
        logging.getLogger(name).setLevel(logging.WARNING)
    if arguments.only:
        _check_only(parser, arguments.only)
    sections = SECTIONS if arguments.section == "all" else (arguments.section,)
    for name in sections:
        about = session.description()
        rows = _measure(name, quick=arguments.quick, only=arguments.only)
        _print(name, rows)
        if not arguments.quick:
            report.store(name, rows, about, part=bool(arguments.only))


def _check_only(parser: argparse.ArgumentParser, solvers: Sequence[str]) -> None:
    """Stop at a solver that cannot be measured, before anything is."""
    from benchmarks import work_precision
    from indexer_env.errors import ParameterError

    try:
        work_precision.check_solvers(solvers)
    except ParameterError as error:
        parser.error(str(error))


def _measure(name: str, *, quick: bool, only: Sequence[str]) -> list[report.Row]:
    print(f"measuring {name} …", flush=True)
    if name == "accuracy":
        from benchmarks import accuracy

        return accuracy.measure(quick=quick)
    if name == "speed":
        from benchmarks import speed

        return speed.measure(quick=quick)
    if name == "environment":
        from benchmarks import environment

        return environment.measure(quick=quick)
    if name == "gpu":
        from benchmarks import gpu

        return gpu.measure(quick=quick)
    if name == "datagen":
        from benchmarks import data_sets

        return data_sets.measure(quick=quick)
    if name == "training":
        from benchmarks import training

        return training.measure(quick=quick)
    if name == "diagnosing":
        from benchmarks import diagnosing

        return diagnosing.measure(quick=quick)
    if name == "growth":
        from benchmarks import growth

        return growth.measure(quick=quick)
    if name == "parquet":
        from benchmarks import parquet

        return parquet.measure(quick=quick)
    if name == "reading":
        from benchmarks import reading

        return reading.measure(quick=quick)
    from benchmarks import picture, work_precision

    stored = [work_precision.Point(**point) for point in json.loads(POINTS.read_text(encoding="utf-8"))] if only else []
    rows, points = work_precision.measure(quick=quick, only=only, stored=stored)
    if not quick:
        listed = [dataclasses.asdict(point) for point in points]
        POINTS.write_text(json.dumps(listed, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        picture.draw(points)
    return rows


def _print(name: str, rows: list[report.Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=name, title_justify="left")
    for column in ("what", "required", "measured", "verdict"):
        table.add_column(column)
    for row in rows:
        table.add_row(row.what, row.required, row.measured, row.verdict.strip("*"))
    Console(highlight=False).print(table)


if __name__ == "__main__":
    main()
