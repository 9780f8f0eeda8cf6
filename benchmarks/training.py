"""Seconds to train many networks as one, beside one after the other in PyTorch."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from benchmarks import natural, processes
from benchmarks.report import Row, number
from benchmarks.session import CORES
from classifier.dataset import load_dataset
from classifier.features import Psd, Scaling
from classifier.network import Mlp
from classifier.trainers import TRAINERS, Examples
from classifier.trainers.traingdx import TrainGdx
from indexer_experiments.study.claims import fig4, fig6, pairs
from indexer_experiments.study.claims.pairs import Fig7, Fig8

NETWORKS = 1000
"""Trainings of the paper's fig. 5."""

ALONE = 20
"""Networks trained one after the other; their time is scaled to NETWORKS."""

PER_RULE = 100

REPEATS = 3
"""Runs of the stack and of those one after the other, of which the fastest counts."""

PAIRS = len(Fig7.networks) + len(Fig8.networks)
TRAININGS = {
    "fig. 4": 100 * (len(fig4.CUTS) + len(fig4.RESOLUTIONS)),
    "fig. 5": NETWORKS,
    "fig. 6": 100 * len(fig6.HIDDEN),
    "figs. 7 and 8": 100 * len(pairs.HIDDEN) * PAIRS,
    "fig. 9": 100 * len(TRAINERS),
}
"""Networks of each figure as `indexer_experiments.study` trains them on one data set: the paper's 100 of each kind."""

PER_CORE = "≥ 30 × per core"

RECORDS = 10_000
"""Records of one turn whose features are timed."""

CONDITIONS = "126 records in thirds, 20 hidden nodes, PSD 1 Hz, early stopping, sensor=bench"


@dataclass(frozen=True)
class Task:
    """Examples of the paper's data set and the network for them."""

    network: Mlp
    calibration: Examples
    control: Examples

    def start(self, networks: int) -> torch.Tensor:
        """Random starts, seed 0, in the precision of the examples."""
        return self.network.initial(networks, torch.Generator().manual_seed(0)).to(self.calibration.inputs)

    def single(self) -> Task:
        """The same in float32, for what trains in the precision of its examples."""
        subsets = (self.calibration, self.control)
        return Task(self.network, *(Examples(*(part.float() for part in subset)) for subset in subsets))


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` trains few networks for a few epochs."""
    many, alone, each = (8, 2, 2) if quick else (NETWORKS, ALONE, PER_RULE)
    numbers: dict[str, Any] = {"epochs": 20} if quick else {}
    task, threads = paper_task(), torch.get_num_threads()
    try:
        torch.set_num_threads(CORES)
        stack, stack_row = _stack(task, TrainGdx(**numbers), many)
        single, _ = _stack(task, TrainGdx(**numbers, precision="float32"), many)
        rules = {kind: _timed(_training(task, rule(**numbers), each)) for kind, rule in TRAINERS.items()}
        torch.set_num_threads(1)
        beside = _beside(task, TrainGdx(**numbers), alone, many, stack)
        single_beside = _beside(task.single(), TrainGdx(**numbers), alone, many, single)
    finally:
        torch.set_num_threads(threads)
    return [
        stack_row,
        beside,
        _single(single, single_beside),
        _rules(rules, each),
        _figures(stack, many, rules, each),
        _features(quick=quick),
    ]


def paper_task() -> Task:
    """The paper's data set (§4.3), made anew with the sensor of the bench; seed 0."""
    with tempfile.TemporaryDirectory() as folder:
        processes.child(["-m", "datagen", "campaign=table2", "sensor=bench", f"out={folder}/table2"])
        dataset = load_dataset(f"{folder}/table2")
    values = Psd().compute(dataset.records, dataset.sample_rate)
    scaled = torch.from_numpy(Scaling.fit(values[dataset.rows("calibration")]).apply(values))
    targets = torch.from_numpy(dataset.codes.targets(dataset.classes))
    subsets = (dataset.rows(subset) for subset in ("calibration", "control"))
    return Task(
        Mlp(scaled.shape[1], 20, dataset.codes.bits), *(Examples(scaled[rows], targets[rows]) for rows in subsets)
    )


def _timed(action: Callable[[], Any], repeats: int = 1) -> dict[str, Any]:
    """Times of the fastest of some runs, since others may be at work."""
    taken = []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        result = action()
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        taken.append({"wall_s": wall, "processor_s": processor, "epochs": result})
    return min(taken, key=lambda one: one["wall_s"])


def _training(task: Task, rule: Any, networks: int) -> Callable[[], float]:
    start = task.start(networks)
    return lambda: float(np.mean(rule.train(task.network, start, task.calibration, task.control).epochs))


def _stack(task: Task, rule: TrainGdx, networks: int) -> tuple[dict[str, Any], Row]:
    _training(task, rule, 2)()  # what the first call loads is not counted
    taken = _timed(_training(task, rule, networks), REPEATS)
    return taken, Row(
        f"{networks} trainings as in the paper's fig. 5 ({CONDITIONS}, traingdx), {CORES} cores",
        "≤ 20 s",
        f"{number(taken['wall_s'])} s ({number(taken['processor_s'])} s of processor time), "
        f"{taken['epochs']:.0f} epochs each",
        taken["wall_s"] <= 20.0,
        taken,
    )


def _beside(task: Task, rule: TrainGdx, alone: int, networks: int, stack: dict[str, Any]) -> Row:
    start = task.start(alone)

    def one_after_the_other() -> float:
        examples = (task.calibration, task.control)
        return float(np.mean([natural.train(task.network, one, *examples, rule)[0] for one in start]))

    return beside_row(_timed(one_after_the_other, REPEATS), alone, networks, stack)


def beside_row(taken: dict[str, Any], alone: int, networks: int, stack: dict[str, Any]) -> Row:
    """By processor time: the stack may use all cores, the loop has one."""
    processor = taken["processor_s"] * networks / alone
    ratio = processor / stack["processor_s"]
    return Row(
        f"the same ÷ one after the other in PyTorch ({alone} of them scaled, one thread), by processor time",
        PER_CORE,
        f"{number(ratio)} × ({number(processor)} s, {taken['epochs']:.0f} epochs each)",
        ratio >= 30.0,
        {"ratio_per_core": ratio, "trained": alone, **taken},
    )


def _single(single: dict[str, Any], beside: Row) -> Row:
    return Row(
        "both in float32 (trainer.precision), which a rule of first order bears",
        PER_CORE,
        f"{number(single['wall_s'])} s ({number(single['processor_s'])} s of processor time), "
        f"{single['epochs']:.0f} epochs each; {beside.measured}",
        beside.met,
        {**single, "beside": beside.numbers},
    )


def _rules(rules: dict[str, dict[str, Any]], networks: int) -> Row:
    told = ", ".join(f"{kind} {number(taken['wall_s'])} ({taken['epochs']:.0f})" for kind, taken in rules.items())
    return Row(f"{networks} trainings by each rule, s (epochs each)", "", told, None, {"rules": rules})


def _figures(stack: dict[str, Any], networks: int, rules: dict[str, dict[str, Any]], each: int) -> Row:
    per_network = stack["wall_s"] / networks
    fig9 = sum(taken["wall_s"] for taken in rules.values()) * 100 / each
    gdx = sum(count for figure, count in TRAININGS.items() if figure != "fig. 9") * per_network
    return Row(
        f"all of figs. 4 to 9, {sum(TRAININGS.values())} trainings, estimated from the rows above",
        "≤ 600 s",
        f"{number(gdx + fig9)} s (fig. 9: {number(fig9)} s)",
        gdx + fig9 <= 600.0,
        {"estimate_s": gdx + fig9, "fig_9_s": fig9, "trainings": TRAININGS},
    )


def _features(*, quick: bool) -> Row:
    """Noise in place of records: what it costs does not depend on what they hold."""
    block, blocks = (10, 2) if quick else (1000, RECORDS // 1000)
    records = np.random.default_rng(0).standard_normal((block, 8200), dtype=np.float32)
    # Again and again the same thousand, as all at once would be memory rather than work.
    taken = _timed(lambda: [Psd().compute(records, 1000.0) for _ in range(blocks)] and None)
    return Row(
        f"features of {block * blocks} records of 8200 samples, PSD 1 Hz",
        "≤ 5 s",
        f"{number(taken['wall_s'])} s ({number(taken['processor_s'])} s of processor time)",
        taken["wall_s"] <= 5.0,
        taken,
    )
