"""The record of one turn -> what a classifier says of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from classifier.diagnose.attribution import Band, bands_of, contributions
from classifier.model import Model
from classifier.parts import GUARDS
from classifier.tasks.range import OUTSIDE

NOVEL_WORDS = "none of the classes it was taught"
OUTSIDE_WORDS = f"{NOVEL_WORDS}, outside the range of the training"
UNGUARDED_WORDS = "unguarded, nearest to "


@dataclass(frozen=True)
class Diagnosis:
    """What a classifier says of the record of one turn.

    class_label, class_name, code  the class whose code lies nearest to the outputs
    outputs      outputs of the network, one per bit; 0 and 1 are its targets
    distance     Euclidean distance of the outputs from that code; 0 where they agree fully
    margin       how much farther the second nearest code is; 0 at a tie, 1 between codes that differ in one
                 bit and are hit exactly
    second_name  name of the class with the second nearest code
    guarded      whether the model has a part that tells a record unlike all that was taught
    left_out     what the model cannot say or compare, with the reason, by name
    assessment   what the model's parts say: a number, flag or list by name; see `classifier.parts`
    bands        bands of frequencies with what each added to the agreement with the code, see `attribution`

    Distance and margin are measures of agreement, not probabilities: a fault that the classifier was never
    taught can lie near one of its codes, and so can noise. So `verdict` is what to print and act upon, while
    `class_name` is but the nearest class.
    """

    class_label: int
    class_name: str
    code: str
    outputs: tuple[float, ...]
    distance: float
    margin: float
    second_name: str
    guarded: bool
    left_out: dict[str, str]
    assessment: dict[str, Any]
    bands: tuple[Band, ...]

    @property
    def is_novel(self) -> bool:
        """Whether a part of the model says that the record is none of its classes."""
        return any(bool(self.assessment.get(column, False)) for column in GUARDS.values())

    @property
    def verdict(self) -> str:
        """The name of the class; or that the record is none of them, and whether for its level and octaves; or the
        nearest name as one that nothing guards."""
        if self.assessment.get(OUTSIDE, False):
            return OUTSIDE_WORDS
        if self.is_novel:
            return NOVEL_WORDS
        return self.class_name if self.guarded else f"{UNGUARDED_WORDS}{self.class_name}"

    def is_right(self, true_name: str) -> bool:
        """Whether the class is named, guarded or not, and is this one."""
        return not self.is_novel and self.class_name == true_name

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, texts, lists and mappings, for JSON."""
        return {"verdict": self.verdict, **asdict(self), "is_novel": self.is_novel}


def diagnose_turn(model: Model, record: np.ndarray) -> Diagnosis:
    """Diagnose a record (samples,) of one turn at the model's rate, in its unit."""
    scaled = model.scaled(record[None])
    outputs = model.outputs_of(scaled)
    distances = model.codes.distances(outputs)[0]
    order = np.argsort(distances, kind="stable")
    nearest, second = int(order[0]), int(order[1])
    return Diagnosis(
        class_label=model.codes.classes[nearest],
        class_name=model.codes.names[nearest],
        code=model.codes.codes[nearest],
        outputs=tuple(outputs[0].tolist()),
        distance=float(distances[nearest]),
        margin=float(distances[second] - distances[nearest]),
        second_name=model.codes.names[second],
        guarded=bool(model.guards),
        left_out=dict(model.left_out),
        assessment={name: column[0].tolist() for name, column in model.assess(scaled, outputs, record[None]).items()},
        bands=bands_of(model, contributions(model, scaled[0], nearest)),
    )
