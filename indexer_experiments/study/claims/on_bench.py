"""What the claims about the bench share: its records, trainings on some backlashes, answers on all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from classifier.style import COLOURS
from indexer_env.units import DEGREE
from indexer_experiments.recipes import Labelled, column, masks, read
from indexer_experiments.study.claims.base import Rows
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import OnBench
from indexer_experiments.study.trials import misclassified

STEP_DEG = 5.0
"""Between the backlashes of the bench [degrees at the motor shaft]."""

NODES = ("roller", "screws", "backlash")


@dataclass(frozen=True, eq=False)
class BenchRecords:
    """Records of the bench: targets as §5.1 codes them, and the number (n,) of each record's backlash, from 0."""

    labelled: Labelled
    level: np.ndarray

    @classmethod
    def read(cls, folder: Path, setting: OnBench) -> BenchRecords:
        """From a data set of ``campaign=bench``."""
        records, table, rate = read(folder)
        level = np.rint(column(table, "fault_backlash") / DEGREE / STEP_DEG).astype(int)
        faulty = [column(table, name) > 0 for name in ("fault_roller_crack", "fault_screw_looseness")]
        targets = np.column_stack([*faulty, np.array(setting.targets)[level]]).astype(float)
        subsets = masks(table)
        if setting.judge_stops:
            teach = subsets["calibration"] | subsets["control"]
            subsets = {"calibration": teach, "control": subsets["validation"], "validation": subsets["validation"]}
        return cls(Labelled(records, targets, subsets, rate), level)

    def taught(self, levels: Sequence[int]) -> Labelled:
        """The same where only some backlashes are calibration and control records."""
        known = np.isin(self.level, levels)
        subsets = {name: rows if name == "validation" else rows & known for name, rows in self.labelled.subsets.items()}
        return Labelled(self.labelled.records, self.labelled.targets, subsets, self.labelled.sample_rate)


def answers(lab: Lab, setting: OnBench, cases: dict[str, tuple[int, ...]]) -> Rows:
    """A row for each case and validation record: what the network with the lowest control error says of it, and how all
    networks do.
    """
    rows: Rows = []
    for seed in lab.seeds:
        bench = BenchRecords.read(lab.place(setting.recipe, seed), setting)
        judged = bench.labelled.subsets["validation"]
        targets, level = bench.labelled.targets[judged], bench.level[judged]
        for case, levels in cases.items():
            trained = lab.train(bench.taught(levels), lab.variant(setting, case), seed)
            outputs = trained.outputs(bench.labelled.records[judged])
            wrong = misclassified(outputs, targets)
            kept = trained.training.best
            rows += lab.told(setting, seed, (
                {
                    "variant": case,
                    "roller": int(targets[i, 0]),
                    "screws": int(targets[i, 1]),
                    "level": int(level[i]),
                    "taught": int(level[i]) in levels,
                    **{f"target_{node}": float(targets[i, place]) for place, node in enumerate(NODES)},
                    **{f"output_{node}": float(outputs[kept, i, place]) for place, node in enumerate(NODES)},
                    "wrong": bool(wrong[kept, i]),
                    "wrong_share_of_networks": float(wrong[:, i].mean()),
                    "backlash_error_of_networks": float(np.abs(outputs[:, i, 2] - targets[i, 2]).mean()),
                }
                for i in range(len(targets))
            ))  # fmt: skip
    return rows


def draw_answers(ax: Axes, rows: Rows, case: str) -> None:
    """Outputs for a cracked roller and tight screws on the first data set, as the paper's figs. 12 to 15 show them:
    circles are records, lines join their means, dotted is what is expected; crosses are backlashes not taught.
    """
    first = min(row["data_seed"] for row in rows)
    shown = [row for row in rows if (row["data_seed"], row["variant"]) == (first, case)]
    shown = [row for row in shown if (row["roller"], row["screws"]) == (1, 0)]
    levels = sorted({row["level"] for row in shown})
    degrees = [STEP_DEG * level for level in levels]
    for node, colour in zip(NODES, (0, 2, 4), strict=True):
        for taught, marker in ((True, "o"), (False, "x")):
            dots = [(STEP_DEG * row["level"], row[f"output_{node}"]) for row in shown if row["taught"] is taught]
            if dots:
                ax.plot(*zip(*dots, strict=True), marker, color=COLOURS[colour], fillstyle="none", markersize=5)
        means, wanted = (
            [np.mean([row[f"{what}_{node}"] for row in shown if row["level"] == level]) for level in levels]
            for what in ("output", "target")
        )
        ax.plot(degrees, means, "-", color=COLOURS[colour], label=node)
        ax.plot(degrees, wanted, ":", color=COLOURS[colour])
    ax.set_xticks(degrees)
    ax.set(xlabel="backlash at the motor shaft [degrees]", ylabel="output of each node", ylim=(-0.1, 1.25))
    ax.legend(ncols=3, loc="upper center")
