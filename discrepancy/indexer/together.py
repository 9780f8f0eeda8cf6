"""What is known of a machine's numbers together, as earlier records of it left them.

    x = x̂ + A u,    u ~ N(0, 1)

x̂ are the numbers of the nominal machine, u the parameters of a fit in their place. Records tell ratios of stiffnesses,
inertias and torques far better than each of them, so that a prior for each alone would lose most of what is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.parameters import read
from discrepancy.model import Parameter
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor

LOAD, GAIN = "load", "sensor.gain"
"""Names of the error that all stated loads have in common, relative to them, and of the sensor's gain."""

_REACH = 3.0
"""Standard deviations to which a direction is bounded."""


@dataclass(frozen=True, eq=False)
class Together:
    """Attributes
    ----------
    names : tuple of str
        Numbers of the machine, ``joint.field`` or ``field``; of its effects, ``family.effect.field``; LOAD and GAIN.
    axes : ndarray (k, g)
        A [SI].
    low, high : ndarray (k,)
        Range of each number [SI].
    """

    names: tuple[str, ...]
    axes: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """u, each in units of its standard deviation."""
        names = (f"direction {k + 1}" for k in range(self.axes.shape[1]))
        return tuple(Parameter(name, "-", 0.0, 1.0, -_REACH, _REACH, known=True) for name in names)

    def nominal(self, machine: Machine, sensor: Sensor) -> np.ndarray:
        """x̂ (k,) of a machine and its sensor."""
        effects = {f"{e.name}.{field}": value for e in machine.effects for field, value in vars(e).items()}
        given = {LOAD: 0.0, GAIN: sensor.gain, **effects}
        return np.array([given[name] if name in given else read(machine, name) for name in self.names])

    def values(self, u: Sequence[float], nominal: np.ndarray) -> dict[str, float]:
        """x at u (g,), by name."""
        low, high = np.minimum(self.low, nominal), np.maximum(self.high, nominal)
        return dict(zip(self.names, np.clip(nominal + self.axes @ np.array(u), low, high).tolist(), strict=True))
