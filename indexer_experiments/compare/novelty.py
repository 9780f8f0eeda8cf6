"""Which score tells faults and machines never seen from those of the training, so that they are not mis-named."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from matplotlib.figure import Figure

from classifier.dataset import Dataset
from classifier.evaluate import auroc
from classifier.groups import part
from classifier.network import Mlp
from classifier.results import Row
from classifier.tasks.confidence import class_logits, softmax
from classifier.tasks.novelty import ACCEPTED, SCORES, Novelty
from classifier.tasks.severity import QUANTITIES
from classifier.trainers import Examples
from classifier.trainers.traingdx import TrainGdx
from datagen.recipes import Recipe
from indexer_experiments.compare.draw import dots
from indexer_experiments.compare.recipes import but, drawn
from indexer_experiments.compare.study import Setting, Study
from indexer_experiments.compare.trained import Seen

AREA, FALSE_NAMES, KEPT = "AUROC", f"false names at {100 * ACCEPTED:.0f} % accepted [%]", "known accepted [%]"

_NETWORKS = 5
NETWORK_SCORES = ("1 - largest probability", "distance of code", "committee")
"""What the networks themselves have to say: how sure the best one is, how far its outputs are from the nearest code,
and how far apart the outputs of all restarts are (standard deviation, mean over the bits)."""

NEW_FAULTS = {"crack unseen": "crack", "looseness unseen": "looseness", "backlash unseen": "backlash_deg"}
NEW_MACHINES = {
    "inertia doubled": ("machine.table_inertia=10",),
    "other motion law": ("machine.motion_law=modified_trapezoid",),
    "speed lower by 10 %": ("operating_point.motor_speed_rpm=1350", "run.samples=8200"),
    "load of 50 N m": ("operating_point.load_torque=50", "~campaign.draws.operating_point.load_torque"),
    "roller cracked at one station": (
        "faults.roller_crack=0.5",
        "faults.cracked_station=3",
        "faults.screw_looseness=0",
        "faults.backlash_deg=0",
    ),
    "worn bearing, friction of 20 N m": ("+machine.effects.friction.coulomb.torque=20",),
}


def new_machine(name: str, count: int) -> Recipe:
    """The reference machine of `drawn` but for one thing that no training machine had."""
    return but(drawn(count), re.sub(r"\W+", "-", name), *NEW_MACHINES[name])


@dataclass(frozen=True, eq=False)
class Judge:
    """All scores fitted to one data set.

    seen        the data set
    network     shape of the networks
    parameters  (networks, count) those of the restarts, the best one first
    parts       the scores on the spectrum
    """

    seen: Seen
    network: Mlp
    parameters: torch.Tensor
    parts: dict[str, Novelty]

    @classmethod
    def fit(cls, dataset: Dataset, seed: int) -> Judge:
        """Networks as in the paper and one `Novelty` for each of SCORES."""
        seen = Seen.of(dataset)
        network = Mlp(seen.scaled.shape[1], 20, dataset.codes.bits)
        wanted = torch.from_numpy(dataset.codes.targets(dataset.classes))
        calibration, control = (
            Examples(torch.from_numpy(seen.scaled[rows]), wanted[torch.from_numpy(rows)])
            for rows in (dataset.rows("calibration"), dataset.rows("control"))
        )
        start = network.initial(_NETWORKS, torch.Generator().manual_seed(seed))
        training = TrainGdx().train(network, start, calibration, control)
        order = [training.best, *(place for place in range(_NETWORKS) if place != training.best)]
        nothing = np.empty((len(seen.scaled), 0))
        parts = {score: Novelty.fit(dataset, seen.scaled, nothing, seed, score) for score in SCORES}
        return cls(seen, network, training.parameters[order], parts)

    def scores(self, records: np.ndarray) -> dict[str, np.ndarray]:
        """Every score (n,) of records (n, samples); higher is stranger."""
        scaled = self.seen.features.apply(records)
        outputs = self.network.outputs_of(self.parameters, torch.from_numpy(scaled)).numpy()
        codes = self.seen.dataset.codes
        network = (
            1.0 - softmax(class_logits(codes.matrix, outputs[0])).max(axis=1),
            codes.distances(outputs[0]).min(axis=1),
            outputs.std(axis=0).mean(axis=1),
        )
        spectral = {name: part.scores(scaled) for name, part in self.parts.items()}
        return {**spectral, **dict(zip(NETWORK_SCORES, network, strict=True))}


def run(setting: Setting) -> list[Row]:
    """Each fault left out of the training in turn, then machines that the training never had."""
    rows: list[Row] = []
    whole = setting.dataset(drawn(setting.records))
    for name, fault in NEW_FAULTS.items():
        has = whole.table.column(QUANTITIES[fault].column).to_numpy() > 0.0
        known = part(whole, ~has)
        judge = Judge.fit(known, setting.seed)
        rows += _judged(setting, name, judge, whole.records[has & whole.rows("validation")])
    judge = Judge.fit(whole, setting.seed)
    for name in NEW_MACHINES:
        strange = setting.apart(new_machine(name, max(50, setting.records // 10))).records
        rows += _judged(setting, name, judge, strange)
    return rows


def _judged(setting: Setting, data: str, judge: Judge, strange: np.ndarray) -> list[Row]:
    """Known are the validation records of what was learnt, and the control records set the threshold."""
    dataset = judge.seen.dataset
    control, known = (judge.scores(dataset.records[dataset.rows(name)]) for name in ("control", "validation"))
    new = judge.scores(strange)
    rows = []
    for score in setting.methods:
        threshold = np.quantile(control[score], ACCEPTED, method="higher")
        both = np.concatenate([known[score], new[score]])
        found = {
            AREA: auroc(both, np.arange(len(both)) >= len(known[score])),
            FALSE_NAMES: float(100 * np.mean(new[score] <= threshold)),
            KEPT: float(100 * np.mean(known[score] <= threshold)),
        }
        rows += [Row("novelty", data, score, metric, setting.seed, value) for metric, value in found.items()]
    return rows


def pictures(rows: Sequence[Row]) -> Figure:
    """False names of every score, a panel for each thing never seen."""
    return dots(rows, FALSE_NAMES)


STUDY = Study(
    "Which score refuses a fault or a machine that the training never had?",
    (*SCORES, *NETWORK_SCORES),
    run,
    ((AREA, 3), (FALSE_NAMES, 1), (KEPT, 1)),
    {"novelty": pictures},
)
