"""The cartesian product of axes, by number: what the families `grid` and `bench` have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.errors import refuse
from indexer_env.laws import Law


@dataclass(frozen=True)
class Cells:
    """Every combination of the values of some quantities, the last one varying fastest.

    Attributes
    ----------
    axes : mapping
        Values of each quantity, by path; without an axis there is one cell, which changes nothing.
    """

    axes: Mapping[str, tuple[Any, ...]]

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(np.prod([len(values) for values in self.axes.values()], dtype=np.int64))

    def cell(self, number: int) -> dict[str, Any]:
        """Value by path of a cell, 0 … count - 1."""
        places = np.unravel_index(number, self._shape)
        return {path: values[place] for (path, values), place in zip(self.axes.items(), places, strict=True)}

    def machine(self, number: int) -> int:
        """Number of the machine of a cell: cells that differ in the faults, the operating point or the sensor alone are
        on the same machine."""
        own = {path: values for path, values in self.axes.items() if path.partition(".")[0] in ("machine", "effects")}
        cell = self.cell(number)
        places = [values.index(cell[path]) for path, values in own.items()]
        shape = [len(values) for values in own.values()]
        return int(np.ravel_multi_index(places, shape)) if own else 0

    @property
    def machines(self) -> int:
        """Number of machines among the cells."""
        return self.machine(self.count - 1) + 1

    @property
    def _shape(self) -> tuple[int, ...]:
        return tuple(len(values) for values in self.axes.values())


def values_of(owner: str, name: str, law: Law) -> tuple[Any, ...]:
    """The values that a law lists, which an axis has; ParameterError where it lists none or one twice."""
    if not law.lists:
        raise refuse(owner, name, "a list of values", law)
    if len(set(law.extremes)) < len(law.extremes):
        raise refuse(owner, name, "a list of different values", list(law.extremes))
    return law.extremes
