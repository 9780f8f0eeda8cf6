"""The paper's bench: each roller with each state of the base screws and each backlash, measured again and again
(the paper, section 5.1: 2 x 2 x 5 = 20 cases, 10 tests of each).

Item i is case i mod 20 of round i // 20. In each round the bench is put together anew (`draws`) and all cases are
measured on it; each test has its own start, load and noise (`drift`, sensor). A round is a machine draw, so subsets are
shared by rounds: 7 of 10 teach and 3 judge, as in the paper.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from datagen.campaign import Base, Campaign, Design
from datagen.campaigns.cells import Cells, values_of
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_env.faults import BACKLASH_DEG, fault_laws


@dataclass(frozen=True, kw_only=True)
class Bench(Campaign):
    """Settings of the family, besides those of `Campaign`.

    Attributes
    ----------
    roller, screws : sequence of str
        States of `indexer_env.faults.STATES`.
    backlash_deg : sequence of float
        Play at the MOTOR shaft [degrees], >= 0.
    repeats : int
        Rounds of the whole campaign, >= 1.
    """

    name: ClassVar[str] = "bench"
    lengths: ClassVar[tuple[str, ...]] = ("repeats",)

    roller: Sequence[str]
    screws: Sequence[str]
    backlash_deg: Sequence[float]
    repeats: int

    def __post_init__(self) -> None:
        check_integer("campaign", "repeats", self.repeats, low=1)
        assert self.cells.count  # the states and the kinds of values are checked where these are listed
        for value in self.backlash_deg:
            check_number("campaign", "backlash_deg", value, **BACKLASH_DEG)
        super().__post_init__()

    @functools.cached_property
    def cells(self) -> Cells:
        """The cases of a round."""
        listed: dict[str, Any] = {}
        for key in ("roller", "screws", "backlash_deg"):
            values = getattr(self, key)
            if not isinstance(values, list | tuple):
                raise refuse("campaign", key, "a list of values", values)
            listed[key] = {"choice": list(values)}
        laws = fault_laws(listed, ("roller_crack", "screw_looseness", "backlash"))
        return Cells({f"faults.{name}": values_of("campaign", name, law) for name, law in laws.items()})

    @property
    def decides(self) -> tuple[str, ...]:
        return tuple(self.cells.axes)

    @property
    def size(self) -> int:
        return self.cells.count * self.repeats

    @property
    def different(self) -> int:
        return self.cells.count

    def machine_draw(self, index: int) -> int:
        return index // self.cells.count

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        return Design(self.cells.cell(index % self.cells.count))
