"""Analysis by synthesis: what a turn with faults of some sizes would look like, beside a measured one.

Of a turn, m are its principal components (`components`); at sizes t the simulator gives m(t). The remainder is

    q = (m − m(t))ᵀ C⁻¹ (m − m(t)) / k,   C = C_noise + C_open + |m|²/k C_faulty + C_chance

C_noise is the covariance of noise and shift, C_open what the posterior leaves open of healthy turns, C_faulty what it
leaves open besides in turns with faults, which grows with them, C_chance those among the cam turns of the simulated
turn and of the measured one, as both rattle where there is play. Where the machine's own parameters are fitted beside
the sizes (`work`), C_open and C_faulty have no part.

At the sizes that fit best it tells a turn that no fault of the table makes from one that some fault does.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env import Machine, OperatingPoint, Sensor, make_effect
from indexer_env.effects import EFFECTS, Effect, SensorEffect
from twin.components import Components
from twin.faults import Fault, highest_of
from twin.nuisance import Nuisance
from twin.turns import Healthy

SQUARE = ("covariance", "open", "growth")
"""The matrices (k, k) of a synthesis."""


@dataclass(frozen=True, eq=False)
class Synthesis:
    """The simulator of a twin as it is fitted to turns.

    Attributes
    ----------
    healthy : Healthy
    faults : tuple of Fault
    sigma : callable
        OperatingPoint -> σ of a cell there [unit of the sensor].
    components : Components
        k of them.
    covariance, open, growth : ndarray (k, k)
        C_noise, C_open and C_faulty along them in units of the noise.
    shapes : callable
        Turns, and their σ where they are not in units of it -> what shifts add to them, in units of the noise.
    nuisance : Nuisance
        The machine's own parameters.
    """

    healthy: Healthy
    faults: Sequence[Fault]
    sigma: Callable[[OperatingPoint], float]
    components: Components
    covariance: np.ndarray
    open: np.ndarray
    growth: np.ndarray
    shapes: Callable[..., np.ndarray]
    nuisance: Nuisance

    def seen(self, x: np.ndarray) -> np.ndarray:
        """m (n, k) of turns x (n, stations, cells)."""
        return self.components.of(x)

    def chance(self, x: np.ndarray) -> np.ndarray:
        """C_chance (n, k, k) of measured turns x (n, stations, cells): their scatter beyond that of noise."""
        found = self.components.scatter(x)
        power = np.einsum("nii->n", found)
        return found * np.maximum(0.0, 1.0 - np.trace(self.covariance) / np.maximum(power, 1e-12))[:, None, None]

    def open_at(self, m: np.ndarray) -> np.ndarray:
        """C_noise + C_open + |m|²/k C_faulty (n, k, k) of turns m (n, k)."""
        return self.covariance + self.open + (m**2).mean(axis=1)[:, None, None] * self.growth

    def unexplained(self, x: np.ndarray) -> np.ndarray:
        """q (n,) of turns with no fault."""
        m = self.seen(x)
        return np.einsum("ni,ij,nj->n", m, np.linalg.inv(self.covariance + self.open), m) / m.shape[1]

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name, for a file."""
        return {**self.components.arrays(), **{name: np.ascontiguousarray(getattr(self, name)) for name in SQUARE}}

    def of_mean(self) -> Synthesis:
        """By the mean cam turn alone, for a turn whose stations are not known."""
        kept = self.components.mean_only()
        cut = {name: getattr(self, name)[: kept.count, : kept.count] for name in SQUARE}
        return dataclasses.replace(self, components=kept, **cut)


def effect_of(
    fault: Fault, size: float, machine: Machine, phase: float, station: int, on: Machine | None = None,
    sensor: Sensor | None = None,
) -> Effect:  # fmt: skip
    """The effect that a fault of this size of `machine`'s largest is, on top of what the healthy machine, or another
    one, `on`, or its sensor has of it."""
    kind, there = EFFECTS[fault.effect], None
    if not issubclass(kind, SensorEffect):
        there = next((effect for effect in (on or machine).effects if effect.name == fault.effect), None)
    elif sensor is not None:
        there = kind.of_sensor(sensor)
    given: dict[str, Any] = {} if there is None else dict(vars(there))
    grown = float(given.get(fault.parameter, 0.0)) + fault.value(size, machine)
    given[fault.parameter] = min(grown, highest_of(fault))
    for name, law in fault.others.items():
        if name not in given:
            given[name] = phase % (2.0 * math.pi) if name == "phase" else 0.5 * sum(law["uniform"])
    if fault.effect.endswith("_single"):
        given["station"] = station
    return make_effect(fault.effect, given)
