"""The paper's simulated case: six classes of joint 2 and of the model (Table 2, section 4.3).

Item i has class i mod 6 + 1 and is draw i // 6 of that class, by which it gets its subset. So any count shares
the classes as equally as it can (classes 1 to count mod 6 get one item more), a count that is a multiple of
18 shares three equal subsets equally too, and a longer data set begins with the items of a shorter one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from datagen.base import Base, fault_values
from datagen.campaign import Campaign, Design
from datagen.labels import BITS, NO_FAULTS
from indexer_env.checks import check_number
from indexer_env.errors import refuse
from indexer_env.machine import NOT_IN_MODEL

MODEL = "machine.model"
STIFFNESS_RATIO = "machine.output_joint.stiffness_ratio"
OUTPUT_BACKLASH = "machine.output_joint.backlash"
INPUT_BACKLASH = "machine.input_joint.backlash"
FAULTY_EFFECTS = (*(path for _, paths in BITS for path in paths[1:]), "effects.output.backlash.backlash")
"""What would make a machine of one class one of another class or of none."""


@dataclass(frozen=True)
class ClassOfTable2:
    """One row of the paper's Table 2: the model, whether joint 2 has play and whether it is bilinear."""

    code: str
    model: str
    backlash: bool
    bilinear: bool

    @property
    def name(self) -> str:
        """The class in words."""
        shape = "bilinear" if self.bilinear else "linear"
        return f"model {self.model}, joint 2 {shape} {'with' if self.backlash else 'without'} backlash"


CLASSES = (
    ClassOfTable2("01111", "A", backlash=False, bilinear=False),
    ClassOfTable2("01110", "A", backlash=True, bilinear=False),
    ClassOfTable2("11111", "B", backlash=False, bilinear=False),
    ClassOfTable2("11110", "B", backlash=True, bilinear=False),
    ClassOfTable2("11101", "B", backlash=False, bilinear=True),
    ClassOfTable2("11100", "B", backlash=True, bilinear=True),
)
"""Table 2, class 1 first; the last bit of a code is 1 for "without backlash", as printed there."""


@dataclass(frozen=True, kw_only=True)
class Table2(Campaign):
    """Settings of the family, besides those of `Campaign`.

    Attributes
    ----------
    output_backlash : float
        Nominal total play of joint 2 in the classes with backlash [rad], > 0.
    stiffness_ratio : float
        Nominal ρ of joint 2 in the bilinear classes [-], 0 < ρ < 1.

    What is drawn for a parameter that a class has not (play, ρ, joint 1 in Model A) is left out of its items. The
    classes differ in joint 2 and the model only: joint 1 has no play in any of them and there are no other faults,
    whatever the joints and the faults of the base are. A base with an effect that is such a fault is refused.
    """

    name: ClassVar[str] = "table2"
    example_index: ClassVar[int] = 5

    output_backlash: float
    stiffness_ratio: float

    def __post_init__(self) -> None:
        check_number("campaign", "output_backlash", self.output_backlash, low=0.0, low_open=True, unit="rad")
        ratio = {"low": 0.0, "low_open": True, "high": 1.0, "high_open": True}
        check_number("campaign", "stiffness_ratio", self.stiffness_ratio, **ratio)
        super().__post_init__()

    @property
    def decides(self) -> tuple[str, ...]:
        return (MODEL, INPUT_BACKLASH, OUTPUT_BACKLASH, STIFFNESS_RATIO, *NO_FAULTS, *FAULTY_EFFECTS)

    def check_base(self, base: Base) -> None:
        there = fault_values(base)
        for path in FAULTY_EFFECTS:
            if there.get(path):
                remedy = "take a machine without this effect, as the classes decide play and cracks"
                raise refuse("machine", path, f"left to the campaign {self.name}", there[path], remedy)

    @property
    def size(self) -> int:
        """The paper's 3 x 42."""
        return 126

    @property
    def different(self) -> int:
        return len(CLASSES)

    def machine_draw(self, index: int) -> int:
        return index

    def split_number(self, index: int) -> int:
        return index // len(CLASSES)

    def classes(self) -> tuple[str, ...]:
        return tuple(row.name for row in CLASSES)

    def classify(self, index: int, values: Mapping[str, Any], base: Base) -> tuple[int, str, str]:
        row = CLASSES[index % len(CLASSES)]
        return index % len(CLASSES) + 1, row.name, row.code

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        row = CLASSES[index % len(CLASSES)]
        return Design({
            MODEL: row.model,
            INPUT_BACKLASH: 0.0,
            OUTPUT_BACKLASH: self.output_backlash if row.backlash else 0.0,
            STIFFNESS_RATIO: self.stiffness_ratio if row.bilinear else 1.0,
            **NO_FAULTS,
        })  # fmt: skip

    def varies(self, path: str, design: Design) -> bool:
        if path == STIFFNESS_RATIO:
            return design.values[STIFFNESS_RATIO] < 1.0
        section, _, rest = path.partition(".")
        return section != "machine" or rest.partition(".")[0] not in NOT_IN_MODEL[design.values[MODEL]]
