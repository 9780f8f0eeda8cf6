"""Loads on the table beside the constant load torque."""

from __future__ import annotations

import math
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import LEAST_HALF_WIDTH, MachineEffect, Sought, ladder, parameter, register

if TYPE_CHECKING:
    from indexer_env.machine import Machine


_PHASES = tuple(2.0 * math.pi * k / 12 for k in range(12))
"""Angles at which the mass is looked for: it changes the order of contacts, which narrows the valley of its phase."""

_PLACES = tuple(0.5125 + 0.025 * k for k in range(20))
"""Cam phases at which a pulse is looked for, finer than half a period of the ringing, where the other sign fits as
well."""


@register
@dataclass(frozen=True)
class Imbalance(MachineEffect):
    """An eccentric mass on a table whose axis is not vertical: gravity acts once per table turn."""

    name = "load.imbalance"
    sentence = "An eccentric mass on a tilted table makes gravity act once per table turn."
    equation = "T_L += m g e sin(φ + phase)"
    source = "statics of an eccentric mass; m g e is its weight's moment at the worst angle"
    enters = "table torque"

    torque: float = parameter(
        "moment of the eccentric weight m g e",
        "N m",
        null=0.0,
        low=0.0,
        sought=Sought("torque", ladder(0.145, 9, 1.55), 0.12),
    )
    phase: float = parameter("angle of the mass at φ = 0", "rad", default=0.0, sought=Sought("-", _PHASES, 0.5))

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["imbalance_torque"] = self.torque
        coefficients["imbalance_phase"] = self.phase


@register
@dataclass(frozen=True)
class ProcessTorque(MachineEffect):
    """A torque pulse on the table in every dwell, as a press or a screwdriver at a station makes."""

    name = "load.process"
    sentence = "The process at the stations twists the table with a torque pulse in every dwell."
    equation = "T_L += T_p (1 - y²)⁴ for |y| < 1, y = (cam phase - centre)/half_width"
    source = "own choice: smooth pulse with three continuous derivatives"
    enters = "table torque"

    torque: float = parameter(
        "peak torque T_p", "N m", null=0.0, sought=Sought("torque", (0.36, 1.45, -0.36, -1.45), 0.12)
    )
    centre: float = parameter(
        "cam phase of the peak", "turns", default=0.75, low=0.0, high=1.0, sought=Sought("-", _PLACES, 0.05, 0.0, 1.0)
    )
    half_width: float = parameter(
        "half width of the pulse",
        "turns",
        default=0.1,
        low=LEAST_HALF_WIDTH,
        high=0.5,
        sought=Sought("-", (0.06, 0.12), 0.03, 0.01, 0.3),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["process_torque"] = self.torque
        coefficients["process_centre"] = self.centre
        coefficients["process_half_width"] = self.half_width
