"""Loads on the table beside the constant load torque."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import MachineEffect, parameter, register
from indexer_env.kernels.layout import USES_IMBALANCE, USES_PROCESS

if TYPE_CHECKING:
    from indexer_env.machine import Machine


@register
@dataclass(frozen=True)
class Imbalance(MachineEffect):
    """An eccentric mass on a table whose axis is not vertical: gravity acts once per table turn."""

    name = "load.imbalance"
    sentence = "An eccentric mass on a tilted table makes gravity act once per table turn."
    equation = "T_L += m g e sin(φ + phase)"
    source = "statics of an eccentric mass; m g e is its weight's moment at the worst angle"
    enters = "table torque"
    feature = USES_IMBALANCE

    torque: float = parameter("moment of the eccentric weight m g e", "N m", null=0.0, low=0.0)
    phase: float = parameter("angle of the mass at φ = 0", "rad", default=0.0)

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
    feature = USES_PROCESS

    torque: float = parameter("peak torque T_p", "N m", null=0.0)
    centre: float = parameter("cam phase of the peak", "turns", default=0.75, low=0.0, high=1.0)
    half_width: float = parameter("half width of the pulse", "turns", default=0.1, low=0.0, high=0.5, low_open=True)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["process_torque"] = self.torque
        coefficients["process_centre"] = self.centre
        coefficients["process_half_width"] = self.half_width
