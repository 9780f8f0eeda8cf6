"""Simulate one machine or a batch: warm-up by criterion, one record each, the faulty ones apart.

`simulate` raises where `simulate_batch` rejects the item, with the same sentence. An item's numbers do not depend on
its batch: the kernel's lanes are independent, and what an item's neighbours have it has in the size 0.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from indexer_env.checks import check_integer
from indexer_env.coefficients import Coefficients, coefficients
from indexer_env.device import CPU, cuda_of
from indexer_env.engine import cores, prepare_kernel
from indexer_env.errors import ParameterError, SimulationError, refuse
from indexer_env.kernels.layout import LANES, USES_SLIP
from indexer_env.machine import Machine
from indexer_env.modes import coarse_step, steps_of
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.trajectory import Batch, Trajectory, WarmupReport
from indexer_env.turns import OnCores, Sink, TurnGroup

if TYPE_CHECKING:
    from indexer_env.cuda.turns import OnCuda

__all__ = ["Run", "simulate", "simulate_batch"]

_GROUP = 2 * int(LANES)
"""Items run together: whole blocks, few enough that two turns of each stay in the cache while they are compared; no
more than a core's share of them, in blocks."""

_ON_CORES = OnCores()

_PART = 8192
"""Items prepared at once, some 2 KiB each: so memory does not grow with their number, and no thread waits long for the
last group of a part."""


def simulate(machine: Machine, operating_point: OperatingPoint | None = None, run: Run | None = None) -> Trajectory:
    """Simulate one machine.

    Parameters
    ----------
    machine : Machine
    operating_point : OperatingPoint, optional
        The reference one where not given.
    run : Run, optional
        One turn at 1 kHz after warm-up where not given.

    Returns
    -------
    Trajectory
        Channels (n,) in SI units and radians; the record begins at cam angle `start_angle` of a table turn.

    Raises
    ------
    ParameterError
        An effect that does not fit the machine, or a step that cannot resolve its fastest mode.
    SimulationError
        The run became non-finite or left the physical range; names machine, time and state.
    """
    point, run = operating_point or OperatingPoint(), run or Run()
    _check_kinds("simulate", [machine], [point], run)
    batch = _run_batch([machine], [point], run, None, reject=False)
    channels = {name: values[0] for name, values in batch.channels.items()}
    report = WarmupReport(int(batch.warmup_turns[0]), bool(batch.settled[0]), float(batch.warmup_difference[0]))
    return Trajectory(run.sample_rate, channels, report)


def simulate_batch(
    machines: Sequence[Machine],
    operating_points: Sequence[OperatingPoint] | OperatingPoint | None = None,
    run: Run | None = None,
    *,
    threads: int | None = None,
    sink: Sink | None = None,
    device: str = CPU,
) -> Batch:
    """Simulate many machines at once, each with its own parameters, effects and operating point.

    Parameters
    ----------
    machines : sequence of Machine
    operating_points : sequence of OperatingPoint, or one for all
        The reference one where not given.
    run : Run, optional
        `run.samples` must be given where the turns' durations differ.
    threads : int, optional
        All cores where not given; the results do not depend on it. A GPU takes none.
    sink : callable, optional
        sink(items, channels) is called with the numbers of finished items (k,) and their channels (k, n_samples), some
        tens of items at a time while they are still in the cache, from several threads at once and in no set order.
        The batch then keeps no channels, so memory does not grow with the records. What it raises ends the run.
    device : str
        "cpu"; or "cuda" or "cuda:N" for a GPU (extra [cuda]), from which channels come as torch tensors that stay
        there, and where a sink gets thousands of items at a time.

    Returns
    -------
    Batch
        Channels (n_items, n_samples); items that could not be run are in `rejected` with their reason.

    Raises
    ------
    ParameterError
        Numbers of machines and operating points differ, the records would differ in length, or there is no such device.
    """
    cuda = cuda_of("simulate_batch", device)
    if cuda and threads is not None:
        raise refuse("simulate_batch", "threads", f"left out (None) with device={device}", threads)
    if threads is not None:
        check_integer("simulate_batch", "threads", threads, low=1)
    if not isinstance(machines, Sequence | np.ndarray):
        raise refuse("simulate_batch", "machines", "a sequence of Machine", machines, "put a single one in a list")
    run = run or Run()
    points = operating_points if operating_points is not None else OperatingPoint()
    if isinstance(points, OperatingPoint):
        points = [points] * len(machines)
    if len(points) != len(machines):
        raise ParameterError(
            f"simulate_batch needs one operating point per machine or one for all, got {len(points)} for "
            f"{len(machines)} machines."
        )
    _check_kinds("simulate_batch", machines, points, run)
    runner: OnCores | OnCuda = _ON_CORES
    if cuda:
        from indexer_env.cuda.turns import OnCuda

        runner = OnCuda(cuda)
    return _run_batch(machines, points, run, threads, reject=True, sink=sink, runner=runner)


def _check_kinds(owner: str, machines: Sequence[Any], points: Sequence[Any], run: Any) -> None:
    """Refuse what is no Machine, OperatingPoint or Run."""
    for name, given, kind, remedy in (
        ("machine", machines, Machine, "load_machine gives that of a preset or file"),
        ("operating_point", points, OperatingPoint, "load_operating_point gives that of a preset; a Run is run=…"),
        ("run", [run], Run, "write Run(samples=…), from indexer_env"),
    ):
        for each in given:
            if not isinstance(each, kind):
                raise refuse(owner, name, f"of the class {kind.__name__}", each, remedy)


def _run_batch(
    machines: Sequence[Machine],
    points: Sequence[OperatingPoint],
    run: Run,
    threads: int | None,
    *,
    reject: bool,
    sink: Sink | None = None,
    runner: OnCores | OnCuda = _ON_CORES,
) -> Batch:
    n = len(machines)
    lengths = {run.samples_of(machine.turn_duration(point)) for machine, point in zip(machines, points, strict=True)}
    if len(lengths) > 1:
        raise ParameterError(
            f"Run.samples must be given where turns differ in length, got turns of {min(lengths)} to {max(lengths)} "
            "samples."
        )
    samples = lengths.pop() if lengths else 0
    channels: dict[str, Any] = {} if sink else {name: runner.empty(n, samples) for name in run.channels}
    batch = Batch(
        run.sample_rate, channels,
        np.zeros(n, dtype=int), np.zeros(n, dtype=bool), np.full(n, np.nan),
    )  # fmt: skip
    workers = threads or cores()
    part = _PART if isinstance(runner, OnCores) else runner.most_items(samples, len(run.channels) + 1)
    pool = ThreadPoolExecutor(workers)
    try:
        for first in range(0, n, part):
            items, parts = _prepared(range(first, min(first + part, n)), machines, points, run, batch, reject=reject)
            size = part
            if isinstance(runner, OnCores):
                size = min(_GROUP, -(-max(1, len(items) // workers) // int(LANES)) * int(LANES))
            groups = [
                TurnGroup(members, parts[members[0][0]], machines, points, run, samples, sink, runner)
                for members in _groups(items, parts, size)
            ]
            if groups and isinstance(runner, OnCores):
                prepare_kernel()
            each = pool.map if isinstance(runner, OnCores) else map  # the one queue of a GPU is fed from here
            list(each(lambda group: group.run_into(batch), groups))
    finally:
        pool.shutdown(cancel_futures=True)
    for values in batch.channels.values() if batch.rejected else ():
        values[runner.index(np.array(list(batch.rejected)))] = np.nan
    if batch.rejected and not reject:
        raise SimulationError(batch.rejected[0])
    return dataclasses.replace(batch, rejected=dict(sorted(batch.rejected.items())))


def _prepared(
    indices: range,
    machines: Sequence[Machine],
    points: Sequence[OperatingPoint],
    run: Run,
    batch: Batch,
    *,
    reject: bool,
) -> tuple[dict[int, Coefficients], dict[int, int]]:
    """The coefficients of those of some items that can be run, and their steps in a sampling interval; the others are
    rejected or, without `reject`, raise."""
    items: dict[int, Coefficients] = {}
    # one machine at one point, given many times; both are held, so that no other object gets their identity
    made: dict[tuple[int, int], tuple[Machine, OperatingPoint, Coefficients]] = {}
    for index in indices:
        machine, point = machines[index], points[index]
        key = id(machine), id(point)
        try:
            if key not in made:
                made[key] = machine, point, coefficients(machine, point)
            items[index] = made[key][2]
        except ParameterError as error:
            if not reject:
                raise
            batch.rejected[index] = str(error)
    parts: dict[int, int] = {}
    for model in sorted({item.model for item in items.values()}):
        members = [index for index, item in items.items() if item.model == model]
        alike = [items[index] for index in members]
        largest_of, accurate = steps_of(alike, [points[index] for index in members])
        for index, largest, step in zip(members, largest_of.tolist(), accurate.tolist(), strict=True):
            parts[index] = run.steps_per_sample(step)
            actual = 1.0 / (run.sample_rate * parts[index])
            if actual > largest:
                error = coarse_step("Run", machines[index], items[index], actual)
                if not reject:
                    raise error
                batch.rejected[index] = str(error)
                del items[index]
    return items, parts


def _groups(
    items: dict[int, Coefficients], parts: dict[int, int], size: int
) -> Iterator[list[tuple[int, Coefficients]]]:
    """Items of one model and one step, at most `size` of them.

    They run with the features of all of them, which leaves the numbers as they are, since an effect that an item lacks
    adds exactly nothing; those of like features come together, as each feature costs time. Motors that slip stay among
    themselves, since their turns end later than commanded, and so do dwells that are linear, which take no steps.
    """
    alike: dict[tuple[int, int, int, float], list[tuple[int, Coefficients]]] = {}
    for index, item in sorted(items.items(), key=lambda entry: entry[1].features):
        kind = (item.model, parts[index], item.features & USES_SLIP, item["linear_dwell"])
        alike.setdefault(kind, []).append((index, item))
    for members in alike.values():
        for first in range(0, len(members), size):
            yield members[first : first + size]
