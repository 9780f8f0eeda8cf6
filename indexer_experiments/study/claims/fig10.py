"""Fig. 10: a measured record given to a network trained on simulated ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from classifier.style import COLOURS, DARK
from datagen.changes import with_changes
from indexer_env.faults import STATES, Faults
from indexer_env.operating_point import OperatingPoint
from indexer_env.units import DEGREE
from indexer_experiments.recipes import labelled_by_code
from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.measured import drawn, measured
from indexer_experiments.study.settings import RAW, SCALED, Setting, Training
from indexer_experiments.study.trials import nearest
from indexer_experiments.study.verdicts import Interval, Line

CRACKED, INTACT = (STATES["roller"][1][state] for state in ("cracked", "intact"))

MOST = 0.5
"""Share of the data sets from which on what the paper saw on its one record is what most would show."""

NODES = 5

STREAM = 10
"""Tells the machines' random numbers from others of the same seed."""


@dataclass(frozen=True)
class Diagnosed(Setting):
    """The machine that is measured and the training of §4.3.

    code             of Table 2 that the machine calls for
    backlash_deg     backlash of the reducer [degrees at the motor shaft]
    crack            loss of stiffness of joint 2 in one sense [-]
    output_backlash  of joint 2 [rad]
    """

    code: str = "11100"
    backlash_deg: float = 20.0
    crack: float = CRACKED
    output_backlash: float = 0.0
    training: Training = SCALED

    def commands(self, seed: int) -> tuple[str, ...]:
        """The training's."""
        return self.training.commands(seed)


class Fig10(Claim):
    """From simulation to a machine."""

    key: ClassVar[str] = "fig10"
    where: ClassVar[str] = "§4.3, fig. 10"
    title: ClassVar[str] = "A network trained on simulations names a measured machine"
    says: ClassVar[str] = (
        "A measured record of a machine with a cracked roller and much play in the speed reducer is given to the "
        "network trained on simulations. It answers 1 1 1 0 0: Model B, joint 2 bilinear with backlash."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "No measured record is published. “Measured” is here a machine with parameters of its own, simulated by "
        "another solver (indexer_env.reference) and read by the bench's accelerometer: kinder than a real one.",
        "The machine has the cracked roller of the bench and 20° of play in the reducer, which no class of Table 2 "
        "has; joint 2 itself has none. The paper takes the answer “with backlash” for right, and so does the rule.",
        "Asked is the network with the lowest control error of each data set, with one machine for each.",
        "The paper prints the answer with six outputs and a code of five.",
    )
    settings: ClassVar[tuple[Diagnosed, ...]] = (
        Diagnosed("20° of play", "cracked roller, 20° of play in the reducer"),
        Diagnosed("10° of play", "cracked roller, 10° of play in the reducer", backlash_deg=10.0),
        Diagnosed("raw inputs", "the same as the first, raw inputs", training=RAW),
        Diagnosed(
            "as taught",
            "cracked roller, 1 mrad of play in joint 2: class 6 itself",
            backlash_deg=0.0,
            output_backlash=1e-3,
        ),
        Diagnosed("play alone", "20° of play in the reducer, rollers intact: should be 11110", "11110", crack=INTACT),
        Diagnosed("intact", "an intact machine: should be 11111", "11111", backlash_deg=0.0, crack=INTACT),
    )

    def collect(self, lab: Lab, setting: Diagnosed) -> Rows:
        """A row for each data set: what its best network answers."""
        variant, rows = lab.variant(setting.training, "paper's network"), []
        for seed in lab.seeds:
            data = labelled_by_code(lab.place(setting.training.recipe, seed))
            trained = lab.train(data, variant, seed)
            outputs = trained.outputs(record_of(setting, seed)[None])
            codes = np.unique(data.targets, axis=0)
            names = ["".join(f"{bit:.0f}" for bit in code) for code in codes]
            said = [names[place] for place in nearest(outputs, codes)[:, 0]]
            kept = trained.training.best
            answer = {
                "expected": setting.code,
                "said": said[kept],
                "right_share_of_networks": said.count(setting.code) / len(said),
                **{f"output_{node}": float(outputs[kept, 0, node]) for node in range(NODES)},
            }
            rows += lab.told(setting, seed, [answer])
        return rows

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Whether most data sets lead to the answer."""
        said = [row["said"] for row in rows]
        counted = ", ".join(f"{code} on {said.count(code)}" for code in sorted(set(said), key=said.count, reverse=True))
        networks = 100 * np.mean([row["right_share_of_networks"] for row in rows])
        return (
            Line(
                f"data sets whose best network answers {rows[0]['expected']}",
                "1 of 1",
                Interval.of_yes(row["said"] == row["expected"] for row in rows),
                f"Answers: {counted} of {len(said)} data sets; of all networks {networks:.0f} % give the expected one.",
                low=MOST,
                percent=True,
            ),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Outputs of the kept networks, one dot a data set, beside the expected bits."""
        (ax,) = axes
        nodes = np.arange(NODES) + 1
        for row, shift in zip(rows, np.linspace(-0.2, 0.2, len(rows)), strict=True):
            ax.plot(nodes + shift, [row[f"output_{node}"] for node in range(NODES)], ".", color=COLOURS[0])
        expected = rows[0]["expected"]
        ax.hlines([int(bit) for bit in expected], nodes - 0.3, nodes + 0.3, color=DARK, label=f"expected, {expected}")
        ax.set(xlabel="output node", ylabel="output, one dot a data set", ylim=(-0.1, 1.3))
        ax.legend()


def record_of(setting: Diagnosed, seed: int, samples: int | None = None, turns_before: int = 1) -> np.ndarray:
    """Record [rad/s²] of the machine of a data set: one turn, after one more, where not told otherwise."""
    rng = np.random.default_rng([seed, STREAM])
    faults = Faults(roller_crack=setting.crack, backlash=setting.backlash_deg * DEGREE)
    machine = faults.applied_to(with_changes(drawn(rng), {"output_joint.backlash": setting.output_backlash}))
    return measured(machine, OperatingPoint(), rng, samples, turns_before)
