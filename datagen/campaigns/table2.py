"""The paper's simulated case: six classes of joint 2 and of the model (paper.txt, Table 2, section 4.3).

Item i has class i mod 6 + 1 and is draw i // 6 of that class, whose subset is draw mod 3. So any count shares
the classes as equally as it can (classes 1 to count mod 6 get one item more), a count that is a multiple of
18 shares the subsets equally too, and a longer data set begins with the items of a shorter one.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from datagen.campaign import SUBSETS, Base, Campaign, Item, Label, laws_by_path, number_at
from datagen.laws import Law
from indexer_env.checks import check_number
from indexer_env.errors import refuse

STIFFNESS_RATIO = "output_joint.stiffness_ratio"
OUTPUT_BACKLASH = "output_joint.backlash"
INPUT_BACKLASH = "input_joint.backlash"
NOT_DRAWN_IN_MODEL_A = "input_joint."
"""Model A has no joint 1, so what is drawn for it would not be seen in the record."""


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


@dataclass(frozen=True)
class Table2(Campaign):
    """Settings of the family.

    Attributes
    ----------
    output_backlash : float
        Nominal total play of joint 2 in the classes with backlash [rad], > 0.
    stiffness_ratio : float
        Nominal ρ of joint 2 in the bilinear classes [-], 0 < ρ < 1.
    draws : mapping
        Law of each drawn parameter of the machine, nested as Machine is; drawn around the base machine, or
        around the two values above. Drawn only where the class has the parameter: play and ρ in their
        classes, joint 1 in Model B.

    The classes differ in joint 2 and the model only: joint 1 has no play in any of them, whatever the base
    machine has.
    """

    name: ClassVar[str] = "table2"
    example_index: ClassVar[int] = 5
    decides: ClassVar[tuple[str, ...]] = ("model", INPUT_BACKLASH, OUTPUT_BACKLASH, STIFFNESS_RATIO)

    output_backlash: float
    stiffness_ratio: float
    draws: Mapping[str, Any]

    def __post_init__(self) -> None:
        check_number("campaign", "output_backlash", self.output_backlash, low=0.0, low_open=True, unit="rad")
        ratio = {"low": 0.0, "low_open": True, "high": 1.0, "high_open": True}
        check_number("campaign", "stiffness_ratio", self.stiffness_ratio, **ratio)
        if not self.laws:
            raise refuse("campaign", "draws", "the law of at least one parameter", self.draws)
        for path in set(self.decides) - {OUTPUT_BACKLASH, STIFFNESS_RATIO}:
            if path in self.laws:
                raise refuse("campaign", f"draws.{path}", "left out, as the class decides it", self.laws[path])

    @functools.cached_property
    def laws(self) -> dict[str, Law]:
        """Law of each drawn parameter, by dotted path."""
        if not isinstance(self.draws, Mapping):
            raise refuse("campaign", "draws", "a mapping of parameters to laws", self.draws)
        return laws_by_path(self.draws, "campaign.draws")

    def classes(self) -> tuple[str, ...]:
        return tuple(row.name for row in CLASSES)

    def draw(self, index: int, base: Base, rng: np.random.Generator) -> Item:
        number, draw = index % len(CLASSES), index // len(CLASSES)
        row = CLASSES[number]
        nominal = {OUTPUT_BACKLASH: self.output_backlash, STIFFNESS_RATIO: self.stiffness_ratio}
        # Every law takes its number in every class, so that the classes differ by their own parameters only.
        drawn = {
            path: law.draw(rng, nominal[path] if path in nominal else number_at(base.machine, path, "campaign.draws"))
            for path, law in self.laws.items()
        }
        ratio = drawn.pop(STIFFNESS_RATIO, self.stiffness_ratio)
        play = drawn.pop(OUTPUT_BACKLASH, self.output_backlash)
        if row.model == "A":
            drawn = {path: value for path, value in drawn.items() if not path.startswith(NOT_DRAWN_IN_MODEL_A)}
        changes = {
            **drawn,
            "model": row.model,
            INPUT_BACKLASH: 0.0,
            OUTPUT_BACKLASH: play if row.backlash else 0.0,
            STIFFNESS_RATIO: ratio if row.bilinear else 1.0,
        }
        label = Label(number + 1, row.name, row.code, SUBSETS[draw % len(SUBSETS)], machine_draw=index)
        return Item(index, label, machine=changes)
