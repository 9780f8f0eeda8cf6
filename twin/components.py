"""A turn of the table along its principal components: of its mean cam turn, and of how its stations differ.

    m = (√S x̄ A,  p₁ x B,  p₂ x B)

x̄ is the mean over the S stations of a turn x (S, cells), A and B hold the axes of a mean cam turn and of a station's
difference from it, p₁ and p₂ are the cosine and sine of the table's angle at the stations. They are left out where no
weight is out of balance: what the stations then differ by is chance.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from indexer_env.machine import Machine
from twin.faults import Fault

_IMBALANCE = "load.imbalance"

_LEAST_STATIONS = 4
"""Mean, cosine and sine leave one station to tell chance by."""


@dataclass(frozen=True, eq=False)
class Components:
    """Attributes
    ----------
    mean_axes : ndarray (cells, k)
        Of the mean cam turn.
    station_axes : ndarray (cells, l)
        Of a station's difference from it.
    patterns : ndarray (p, stations)
        Orthonormal, each of mean 0.
    """

    mean_axes: np.ndarray
    station_axes: np.ndarray
    patterns: np.ndarray

    @property
    def count(self) -> int:
        """k + p l."""
        return self.mean_axes.shape[1] + len(self.patterns) * self.station_axes.shape[1]

    def of(self, x: np.ndarray) -> np.ndarray:
        """m (n, k + p l) of turns x (n, stations, cells), with the noise of a single cam turn."""
        mean = math.sqrt(x.shape[1]) * x.mean(axis=1) @ self.mean_axes
        return np.concatenate([mean, (self.patterns @ x @ self.station_axes).reshape(len(x), -1)], axis=1)

    def scatter(self, x: np.ndarray) -> np.ndarray:
        """Covariance (n, k + p l, k + p l) of m by what the cam turns of turns x (n, stations, cells) differ beyond the
        patterns."""
        rest = x - x.mean(axis=1, keepdims=True) - self.patterns.T @ (self.patterns @ x)
        freedom, k, each = x.shape[1] - 1 - len(self.patterns), self.mean_axes.shape[1], self.station_axes.shape[1]
        found = np.zeros((len(x), self.count, self.count))
        found[:, :k, :k] = _square(rest @ self.mean_axes) / freedom
        if len(self.patterns) and each:
            own = _square(rest @ self.station_axes) / freedom
            for first in range(k, self.count, each):
                found[:, first : first + each, first : first + each] = own
        return found

    def mean_only(self) -> Components:
        """Those of the mean cam turn. What the stations differ by along the patterns is no chance either: cosine and
        sine span the same from whichever station a turn begins."""
        return dataclasses.replace(self, station_axes=self.station_axes[:, :0])

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name, for a file."""
        return {name: np.ascontiguousarray(value) for name, value in vars(self).items()}

    @classmethod
    def restore(cls, arrays: Mapping[str, np.ndarray]) -> Components:
        """What gave these arrays."""
        return cls(*(arrays[field.name] for field in dataclasses.fields(cls)))


def patterns_of(machine: Machine, faults: Iterable[Fault]) -> np.ndarray:
    """Cosine and sine of the table's angle (2, stations), where an eccentric weight turns with the table or is one of
    the faults; else none, as also where so few stations leave nothing to tell chance by."""
    acting = {effect.name for effect in machine.effects} | {fault.effect for fault in faults}
    if _IMBALANCE not in acting or machine.stations < _LEAST_STATIONS:
        return np.zeros((0, machine.stations))
    angle = 2.0 * math.pi * np.arange(machine.stations) / machine.stations
    return math.sqrt(2.0 / machine.stations) * np.array([np.cos(angle), np.sin(angle)])


def _square(rows: np.ndarray) -> np.ndarray:
    return rows.transpose(0, 2, 1) @ rows
