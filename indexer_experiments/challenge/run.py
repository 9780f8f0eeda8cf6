"""All cases of a challenge, each in a file of its own, so that a run that was stopped goes on where it was."""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from datagen.executors import RayExecutor
from datagen.progress import progress
from indexer_cli.places.local import check_place, whole_file
from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import IndexerError, refuse
from indexer_experiments.challenge.case import solve_case
from indexer_experiments.challenge.draw import Order
from indexer_experiments.challenge.messy.case import solve_messy
from indexer_experiments.challenge.messy.draw import MessyOrder
from indexer_experiments.challenge.messy.score import messy_tables
from indexer_experiments.challenge.plan import Task, interleaved
from indexer_experiments.challenge.score import summary

EXECUTORS = ("local", "ray")
_CASES, _TABLE, _PARQUET, _MESSY_PARQUET = "cases", "table.md", "cases.parquet", "messy.parquet"

_KEYS = {
    "kind", "play", "hidden", "verdict", "names", "outcome", "gap", "closed_share", "intervals", "cpu_s", "wall_s",
    "truth_s",
}  # fmt: skip
"""What the tables need of a case."""

_MESSY_KEYS = {"half", "hidden", "disturbances", "disturbed", "machine", "records", "answer"}
"""The same of a messy one."""

Map = Callable[[Callable[[int], Any], Iterable[int]], Iterable[Any]]


def run_challenge(
    orders: Sequence[Order | MessyOrder],
    folder: Path,
    executor: str = "local",
    processes: int = 1,
    address: str | None = None,
) -> str:
    """Solve the cases that have no file yet, all orders in turns, and write the table of all; the table.

    Parameters
    ----------
    orders : sequence of Order or MessyOrder
    folder : Path
        Holds cases/*.json, each named after its order and number, table.md, cases.parquet and for messy cases
        messy.parquet; orders may share it.
    executor : str
        "local", or "ray" for one task a case on a cluster.
    processes : int
        Cases solved side by side under "local"; 1 solves them in this process.
    address : str, optional
        Of the cluster under "ray", as `RayExecutor` takes it; "auto" where not given.

    Raises
    ------
    IndexerError
        Before any work: a folder that is none or holds something else; a file among the cases that is no answer.
        After all others: a case whose records could not be made.
    """
    check_choice("challenge", "executor", executor, EXECUTORS)
    check_integer("challenge", "processes", processes, low=1)
    if executor == "ray" and processes != 1:
        raise refuse("challenge", "processes", "1 with executor=ray", processes, "the cluster's cores decide")
    if executor == "local" and address is not None:
        raise refuse("challenge", "address", "left out with executor=local", address, "it is of a Ray cluster")
    _check_folder(folder)
    asked = interleaved(orders)
    waiting = [task for task in asked if not _file(task, folder).is_file()]
    failed: list[IndexerError] = []
    with progress("challenge", len(asked), "cases", done=len(asked) - len(waiting)) as advance:
        solved = _mapped(executor, processes, address)(partial(_solved, waiting), range(len(waiting)))
        for index, case in solved:
            if isinstance(case, IndexerError):
                failed.append(case)
            else:
                with whole_file(_file(waiting[index], folder)) as temporary:
                    temporary.write_text(json.dumps(case, indent=1), encoding="utf-8")
            advance(1)
    table = "" if failed and len(failed) == len(asked) else conclude(folder)
    if failed:
        raise type(failed[0])(f"{len(failed)} of {len(asked)} cases have no answer, the first by this: {failed[0]}")
    return table


def conclude(folder: Path) -> str:
    """Write table.md and the Parquet files from the cases that a folder holds; the table."""
    cases = _cases(folder)
    if not cases:
        raise refuse("challenge", "out", "a folder with solved cases", str(folder), "take cases=own or cases=full")
    messy = [case for case in cases if case.keys() >= _MESSY_KEYS]
    clean = [case for case in cases if case not in messy]
    table = "\n".join(text for text in (summary(clean) if clean else "", messy_tables(messy)) if text)
    with whole_file(folder / _TABLE) as temporary:
        temporary.write_text(table, encoding="utf-8")
    for rows, name in ((clean, _PARQUET), (messy, _MESSY_PARQUET)):
        if rows:
            flat = [{key: _plain(value) for key, value in case.items()} for case in rows]
            with whole_file(folder / name) as temporary:
                pyarrow.parquet.write_table(pa.Table.from_pylist(flat), temporary)
    return table


def _check_folder(folder: Path) -> None:
    """Refuse a place for the cases that cannot be written to or that holds anything but a challenge."""
    check_place(folder)
    if folder.exists() and any(folder.iterdir()) and not (folder / _CASES).is_dir():
        raise refuse("challenge", "out", "a new folder, or one of a challenge", str(folder), "it holds other files")
    _cases(folder)


def _cases(folder: Path) -> list[dict[str, Any]]:
    """The answers that a folder holds."""
    cases = []
    for path in sorted((folder / _CASES).glob("*.json")):
        try:
            case = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            case = None
        if not isinstance(case, dict) or not (case.keys() >= _KEYS or case.keys() >= _MESSY_KEYS):
            rule = f"a folder whose {_CASES}/*.json are answers of a challenge"
            raise refuse("challenge", "out", rule, str(path), "take that file out, and its case is solved again")
        cases.append(case)
    return cases


def _plain(value: Any) -> Any:
    """Nested values as JSON text: their shapes differ from case to case."""
    return json.dumps(value) if isinstance(value, list | dict) else value


def _file(task: Task, folder: Path) -> Path:
    order = task.order
    if isinstance(order, MessyOrder):
        limit = "free" if order.limit is None else f"{order.limit:g}"
        return folder / _CASES / f"messy-{order.half}-{limit}-{order.seed}-{task.number:04d}.json"
    size = f"{order.gap[0]:g}-{order.gap[1]:g}"
    name = f"{order.kind}-{order.play}-{size}-{order.turns:g}-{order.seed}-{task.number:04d}.json"
    return folder / _CASES / name


def _solved(tasks: Sequence[Task], index: int) -> tuple[int, dict[str, Any] | IndexerError]:
    """A case with its place among the tasks, or why there is none: one case must not keep the others from an answer."""
    order, number = tasks[index].order, tasks[index].number
    try:
        return index, solve_messy(order, number) if isinstance(order, MessyOrder) else solve_case(order, number)
    except IndexerError as error:
        kind = "messy" if isinstance(order, MessyOrder) else order.kind
        return index, type(error)(f"Case {number} of the challenge ({kind}): {error}")


def _mapped(executor: str, processes: int, address: str | None) -> Map:
    if executor == "ray":
        return RayExecutor(address or "auto").map
    return map if processes == 1 else partial(side_by_side, processes)


def side_by_side(processes: int, task: Callable[[int], Any], numbers: Iterable[int]) -> Generator[Any]:
    """The answers as they come from processes of their own, each on one core where the system lets it choose."""
    # spawned: a forked child would share the kernel's threads
    context = multiprocessing.get_context("spawn")
    cores = context.SimpleQueue()
    available = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    for k in range(processes):
        cores.put(available[k % len(available)] if available else None)
    with ProcessPoolExecutor(processes, context, _on_one_core, (cores,)) as pool:
        futures = [pool.submit(task, number) for number in numbers]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _on_one_core(cores: Any) -> None:
    """Keep this process on the next core: with the threads of several kernels on each, all wait for each other."""
    core = cores.get()
    if core is not None:
        os.sched_setaffinity(0, {core})
