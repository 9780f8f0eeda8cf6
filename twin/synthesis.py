"""Analysis by synthesis: what a turn with faults of some sizes would look like, beside a measured one.

Of a turn, m is its mean cam turn in the principal axes of simulated turns; at sizes t the simulator gives m(t). The
remainder is

    q = (m − m(t))ᵀ C⁻¹ (m − m(t)) / k,   C = C_healthy + |m|²/k C_faulty + C_chance

C_healthy is the covariance of healthy turns (noise, shift, what the posterior leaves open), C_faulty what the posterior
leaves open besides in turns with faults, which grows with them, C_chance that among the cam turns of the simulated turn
itself, which rattles where there is play.

At the sizes that fit best it tells a turn that no fault of the table makes from one that some fault does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env import Machine, make_effect
from indexer_env.effects import Effect
from twin.faults import Fault
from twin.turns import Healthy


@dataclass(frozen=True, eq=False)
class Synthesis:
    """The simulator of a twin as it is fitted to turns.

    Attributes
    ----------
    healthy : Healthy
    faults : tuple of Fault
    noise : float
        σ of a cell [unit of the sensor].
    axes : ndarray (cells, k)
        Of the mean cam turn.
    covariance, growth : ndarray (k, k)
        Of healthy turns along them in units of the noise, and what is added for turns of strength 1.
    shapes : callable
        A turn of reference -> what shifts add to it, in units of the noise.
    """

    healthy: Healthy
    faults: Sequence[Fault]
    noise: float
    axes: np.ndarray
    covariance: np.ndarray
    growth: np.ndarray
    shapes: Any

    def seen(self, x: np.ndarray) -> np.ndarray:
        """m (n, k) of turns x (n, stations, cells)."""
        return math.sqrt(x.shape[1]) * x.mean(axis=1) @ self.axes

    def open_at(self, m: np.ndarray) -> np.ndarray:
        """C_healthy + |m|²/k C_faulty (n, k, k) of turns m (n, k)."""
        return self.covariance + (m**2).mean(axis=1)[:, None, None] * self.growth

    def unexplained(self, x: np.ndarray) -> np.ndarray:
        """q (n,) of turns with no fault."""
        m = self.seen(x)
        return np.einsum("ni,ij,nj->n", m, np.linalg.inv(self.covariance), m) / m.shape[1]


def effect_of(fault: Fault, size: float, machine: Machine, phase: float, station: int) -> Effect:
    """The effect that a fault of this size is, on top of what the healthy machine has of it."""
    there = next((effect for effect in machine.effects if effect.name == fault.effect), None)
    given: dict[str, Any] = {} if there is None else dict(vars(there))
    given[fault.parameter] = float(given.get(fault.parameter, 0.0)) + fault.value(size, machine)
    for name, law in fault.others.items():
        if name not in given:
            given[name] = phase % (2.0 * math.pi) if name == "phase" else 0.5 * sum(law["uniform"])
    if fault.effect.endswith("_single"):
        given["station"] = station
    return make_effect(fault.effect, given)
