"""The machine's own parameters as nuisance of a fit: what the posterior leaves open, in standard normal coordinates.

    values(z) = ŵ + s V Λ^½ z,   z ~ N(0, 1)

ŵ are the values of the twin's machine, s the standard deviations of the posterior's draws, V Λ Vᵀ the correlation among
them; directions without any spread are left out. Values stay within the draws' own range. One more coordinate is what
the load of a single turn is off by from that of the others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet

from datagen.campaigns.own import LOAD_FACTOR
from datagen.changes import value_at, with_changes
from discrepancy.indexer.together import LOAD, Together
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor

_LEAST = 1e-6
"""Least eigenvalue of the correlation, over the largest, of a direction that is kept."""

_REACH = 3.0
"""Standard deviations of a turn's own load that it may be off by."""


@dataclass(frozen=True, eq=False)
class Nuisance:
    """Attributes
    ----------
    paths : tuple of str
        Quantities, as the posterior's columns have them.
    axes : ndarray (k, g)
        What one standard deviation of each coordinate adds to them [SI].
    low, high : ndarray (k,)
        Range of each over its value in the twin's machine, as a difference [SI].
    middle : ndarray (k,)
        Mean of each among the draws [SI].
    """

    paths: tuple[str, ...]
    axes: np.ndarray
    low: np.ndarray
    high: np.ndarray
    middle: np.ndarray

    @property
    def count(self) -> int:
        """Coordinates g."""
        return self.axes.shape[1]

    @classmethod
    def of(cls, posterior: Path, own_load: float = 0.0) -> Nuisance:
        """Of the joint draws in a file; `own_load` is the standard deviation of a turn's own load over what is stated
        [-]."""
        return cls.of_draws(draws_in(posterior))._with_load(own_load)

    @classmethod
    def of_draws(cls, values: Mapping[str, np.ndarray]) -> Nuisance:
        """Of joint draws (n,) of quantities by path."""
        free = {name: column for name, column in values.items() if column.std() > 1e-9 * max(1e-9, abs(column.mean()))}
        if not free:
            return cls((), np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0))
        draws = np.column_stack(list(free.values()))
        off, size = draws - draws.mean(axis=0), draws.std(axis=0)
        share, along = np.linalg.eigh(np.atleast_2d(np.cov((off / size).T)))
        kept = share > _LEAST * share[-1]
        axes = size[:, None] * along[:, kept] * np.sqrt(share[kept])
        return cls(tuple(free), axes, off.min(axis=0), off.max(axis=0), draws.mean(axis=0))

    def _with_load(self, own: float) -> Nuisance:
        if own == 0.0:
            return self
        paths = self.paths if LOAD_FACTOR in self.paths else (*self.paths, LOAD_FACTOR)
        more = np.zeros(len(paths) - len(self.paths))
        axis = np.where(np.array(paths) == LOAD_FACTOR, own, 0.0)[:, None]
        axes = np.concatenate([self.axes, np.zeros((len(more), self.count))])
        reach = _REACH * axis[:, 0]
        low, high = np.concatenate([self.low, more]) - reach, np.concatenate([self.high, more]) + reach
        middle = np.concatenate([self.middle, 1.0 + more])
        return Nuisance(paths, np.concatenate([axes, axis], axis=1), low, high, middle)

    def together(self, load_factor: float) -> Together:
        """The same as what `discrepancy` knows of the machine before a fit, under loads times a factor."""
        plain = (path.removeprefix("machine.").removeprefix("effects.") for path in self.paths)
        names = tuple(LOAD if name == LOAD_FACTOR else name for name in plain)
        loads = np.array(self.paths) == LOAD_FACTOR
        unit, off = np.where(loads, load_factor, 1.0), np.where(loads, 1.0, 0.0)
        low, high = ((self.middle + end) / unit - off for end in (self.low, self.high))
        return Together(names, self.axes / unit[:, None], low, high)

    def at(self, z: np.ndarray, machine: Machine, sensor: Sensor, load_factor: float) -> tuple[Machine, Sensor, float]:
        """The twin's machine and sensor at coordinates z (g,), and loads over loads as stated."""
        if not np.any(z):
            return machine, sensor, load_factor
        off = dict(zip(self.paths, np.clip(self.axes @ z, self.low, self.high).tolist(), strict=True))
        load_factor += off.pop(LOAD_FACTOR, 0.0)
        machine = _moved(machine, {p.partition(".")[2]: v for p, v in off.items() if p.startswith("machine.")})
        sensor = _moved(sensor, {p.partition(".")[2]: v for p, v in off.items() if p.startswith("sensor.")})
        effects = tuple(_moved(effect, _within(off, f"effects.{effect.name}.")) for effect in machine.effects)
        return dataclasses.replace(machine, effects=effects), sensor, load_factor


def draws_in(posterior: Path) -> dict[str, np.ndarray]:
    """The joint draws (n,) in a file, by path."""
    table = pyarrow.parquet.read_table(posterior)
    return {name: table.column(name).to_numpy() for name in table.column_names}


def _within(off: Mapping[str, float], prefix: str) -> dict[str, float]:
    return {path.removeprefix(prefix): value for path, value in off.items() if path.startswith(prefix)}


def _moved(target: Any, off: Mapping[str, float]) -> Any:
    """A copy with the fields at these dotted paths changed by so much."""
    return with_changes(target, {path: value_at(target, path) + change for path, change in off.items()})
