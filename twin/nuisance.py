"""The machine's own parameters as nuisance of a fit: what the posterior leaves open, in standard normal coordinates.

    values(z) = ŵ + s V Λ^½ z,   z ~ N(0, 1)

ŵ are the values of the twin's machine, s the standard deviations of the posterior's draws, V Λ Vᵀ the correlation among
them; directions without any spread are left out. Values stay within the draws' own range, and ŵ's own where that lies
outside. One more coordinate is what
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
        Range of each among the draws [SI].
    """

    paths: tuple[str, ...]
    axes: np.ndarray
    low: np.ndarray
    high: np.ndarray

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
            return cls((), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
        draws = np.column_stack(list(free.values()))
        off, size = draws - draws.mean(axis=0), draws.std(axis=0)
        share, along = np.linalg.eigh(np.atleast_2d(np.cov((off / size).T)))
        kept = share > _LEAST * share[-1]
        axes = size[:, None] * along[:, kept] * np.sqrt(share[kept])
        return cls(tuple(free), axes, draws.min(axis=0), draws.max(axis=0))

    def _with_load(self, own: float) -> Nuisance:
        if own == 0.0:
            return self
        paths = self.paths if LOAD_FACTOR in self.paths else (*self.paths, LOAD_FACTOR)
        as_stated = np.ones(len(paths) - len(self.paths))
        axis = np.where(np.array(paths) == LOAD_FACTOR, own, 0.0)[:, None]
        axes = np.concatenate([self.axes, np.zeros((len(as_stated), self.count))])
        low, high = (np.concatenate([ends, as_stated]) for ends in (self.low, self.high))
        reach = _REACH * axis[:, 0]
        return Nuisance(paths, np.concatenate([axes, axis], axis=1), low - reach, high + reach)

    def together(self, load_factor: float) -> Together:
        """The same as what `discrepancy` knows of the machine before a fit, under loads times a factor."""
        plain = (path.removeprefix("machine.").removeprefix("effects.") for path in self.paths)
        names = tuple(LOAD if name == LOAD_FACTOR else name for name in plain)
        loads = np.array(self.paths) == LOAD_FACTOR
        unit, off = np.where(loads, load_factor, 1.0), np.where(loads, 1.0, 0.0)
        return Together(names, self.axes / unit[:, None], self.low / unit - off, self.high / unit - off)

    def at(self, z: np.ndarray, machine: Machine, sensor: Sensor, load_factor: float) -> tuple[Machine, Sensor, float]:
        """The twin's machine and sensor at coordinates z (g,), and loads over loads as stated."""
        if not np.any(z):
            return machine, sensor, load_factor
        rows = zip((self.axes @ z).tolist(), self.low.tolist(), self.high.tolist(), strict=True)
        of = dict(zip(self.paths, rows, strict=True))
        if LOAD_FACTOR in of:
            load_factor = _clipped(load_factor, *of[LOAD_FACTOR])
        machine, sensor = _moved(machine, _within(of, "machine.")), _moved(sensor, _within(of, "sensor."))
        effects = tuple(_moved(effect, _within(of, f"effects.{effect.name}.")) for effect in machine.effects)
        return dataclasses.replace(machine, effects=effects), sensor, load_factor


def draws_in(posterior: Path) -> dict[str, np.ndarray]:
    """The joint draws (n,) in a file, by path."""
    table = pyarrow.parquet.read_table(posterior)
    return {name: table.column(name).to_numpy() for name in table.column_names}


_Change = tuple[float, float, float]
"""By how much a quantity is changed, and its range."""


def _within(of: Mapping[str, _Change], prefix: str) -> dict[str, _Change]:
    return {path.removeprefix(prefix): change for path, change in of.items() if path.startswith(prefix)}


def _moved(target: Any, changes: Mapping[str, _Change]) -> Any:
    """A copy with the fields at these dotted paths changed by so much, within their range."""
    return with_changes(target, {path: _clipped(value_at(target, path), *change) for path, change in changes.items()})


def _clipped(value: float, by: float, low: float, high: float) -> float:
    return min(max(value + by, min(low, value)), max(high, value))
