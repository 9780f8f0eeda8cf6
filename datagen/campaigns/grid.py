"""Every combination of listed values of any quantities, so many times.

Item i is cell i mod cells of repeat i // cells, so a longer data set begins with the items of a shorter one. What is
drawn for a machine is drawn anew in each repeat; repeats are what the subsets are shared by. Without an axis the only
cell is the machine as configured, whose quantities the command line may fix, sweep over or draw.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from datagen.campaign import Base, Campaign, Design
from datagen.campaigns.cells import Cells, values_of
from datagen.quantities import laws_by_path
from indexer_env.checks import check_integer
from indexer_env.law_reader import is_law


@dataclass(frozen=True, kw_only=True)
class Grid(Campaign):
    """Settings of the family, besides those of `Campaign`.

    Attributes
    ----------
    axes : mapping
        List of values of each quantity, in sections as in `draws`: {faults: {backlash_deg: [0, 5, 10]}}; the last one
        varies fastest.
    repeats : int
        Records of each cell in the whole campaign, >= 1.
    """

    name: ClassVar[str] = "grid"
    lengths: ClassVar[tuple[str, ...]] = ("repeats",)

    axes: Mapping[str, Any] = field(default_factory=dict)
    repeats: int = 1

    def __post_init__(self) -> None:
        check_integer("campaign", "repeats", self.repeats, low=1)
        _ = self.cells
        super().__post_init__()

    @functools.cached_property
    def cells(self) -> Cells:
        """The cells of the grid."""
        listed = _as_choices(self.axes)
        laws = laws_by_path(listed, "campaign.axes")
        return Cells({path: values_of("campaign.axes", path, law) for path, law in laws.items()})

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
        repeat, cell = divmod(index, self.cells.count)
        return repeat * self.cells.machines + self.cells.machine(cell)

    def split_number(self, index: int) -> int:
        return index // self.cells.count

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        return Design(self.cells.cell(index % self.cells.count))


def _as_choices(given: Any) -> Any:
    """The axes' lists as laws that list them, which is how quantities are read."""
    if isinstance(given, Mapping) and not is_law(given):
        return {key: _as_choices(value) for key, value in given.items()}
    return {"choice": list(given)} if isinstance(given, list | tuple) else given
