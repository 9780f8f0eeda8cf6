"""All cases of a challenge, each in a file of its own, so that a run that was stopped goes on where it was."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from datagen.executors import RayExecutor
from datagen.places.local import whole_file
from datagen.progress import progress
from discrepancy.challenge.case import solve_case
from discrepancy.challenge.draw import Order
from discrepancy.challenge.plan import Task, interleaved
from discrepancy.challenge.score import summary
from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import IndexerError, refuse

EXECUTORS = ("local", "ray")
_CASES, _TABLE, _PARQUET = "cases", "table.md", "cases.parquet"

Map = Callable[[Callable[[int], Any], Iterable[int]], Iterable[Any]]


def run_challenge(orders: Sequence[Order], folder: Path, executor: str = "local", processes: int = 1) -> str:
    """Solve the cases that have no file yet, all orders in turns, and write the table of all; the table.

    Parameters
    ----------
    orders : sequence of Order
    folder : Path
        Holds cases/*.json, each named after its order and number, table.md and cases.parquet; orders may share it.
    executor : str
        "local", or "ray" for one task a case on a cluster.
    processes : int
        Cases solved side by side under "local"; 1 solves them in this process.

    Raises
    ------
    IndexerError
        After all others: a case whose records could not be made.
    """
    check_choice("challenge", "executor", executor, EXECUTORS)
    check_integer("challenge", "processes", processes, low=1)
    if executor == "ray" and processes != 1:
        raise refuse("challenge", "processes", "1 with executor=ray", processes, "the cluster's cores decide")
    asked = interleaved(orders)
    waiting = [task for task in asked if not _file(task, folder).is_file()]
    failed: list[IndexerError] = []
    with progress("challenge", len(asked), "cases", done=len(asked) - len(waiting)) as advance:
        solved = _mapped(executor, processes)(partial(_solved, waiting), range(len(waiting)))
        for index, case in solved:
            if isinstance(case, IndexerError):
                failed.append(case)
            else:
                with whole_file(_file(waiting[index], folder)) as temporary:
                    temporary.write_text(json.dumps(case, indent=1), encoding="utf-8")
            advance(1)
    table = conclude(folder)
    if failed:
        raise type(failed[0])(f"{len(failed)} of {len(asked)} cases have no answer, the first by this: {failed[0]}")
    return table


def conclude(folder: Path) -> str:
    """Write table.md and cases.parquet from the cases that a folder holds; the table."""
    cases = [json.loads(path.read_text(encoding="utf-8")) for path in sorted((folder / _CASES).glob("*.json"))]
    if not cases:
        raise refuse("challenge", "out", "a folder with solved cases", str(folder), "take cases=own or cases=full")
    table = summary(cases)
    with whole_file(folder / _TABLE) as temporary:
        temporary.write_text(table, encoding="utf-8")
    flat = [{key: _plain(value) for key, value in case.items()} for case in cases]
    with whole_file(folder / _PARQUET) as temporary:
        pyarrow.parquet.write_table(pa.Table.from_pylist(flat), temporary)
    return table


def _plain(value: Any) -> Any:
    """Nested values as JSON text: their shapes differ from case to case."""
    return json.dumps(value) if isinstance(value, list | dict) else value


def _file(task: Task, folder: Path) -> Path:
    order = task.order
    size = f"{order.gap[0]:g}-{order.gap[1]:g}"
    return folder / _CASES / f"{order.kind}-{order.play}-{size}-{order.seed}-{task.number:04d}.json"


def _solved(tasks: Sequence[Task], index: int) -> tuple[int, dict[str, Any] | IndexerError]:
    """A case with its place among the tasks, or why there is none: one case must not keep the others from an answer."""
    task = tasks[index]
    try:
        return index, solve_case(task.order, task.number)
    except IndexerError as error:
        return index, type(error)(f"Case {task.number} of the challenge ({task.order.kind}): {error}")


def _mapped(executor: str, processes: int) -> Map:
    if executor == "ray":
        return RayExecutor("auto").map
    return map if processes == 1 else partial(side_by_side, processes)


def side_by_side(processes: int, task: Callable[[int], Any], numbers: Iterable[int]) -> Generator[Any]:
    """The answers as they come from processes of their own."""
    # spawned: a forked child would share the kernel's threads
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(task, number) for number in numbers]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            for future in futures:
                future.cancel()
