"""Friction in the table's bearing; it opposes φ̇. All signs of a rate are smooth: s/√(1+s²), s = φ̇/smoothing, so that
the integrator keeps its order; within ±smoothing the bearing creeps instead of sticking.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import MachineEffect, Sought, ladder, parameter, register

if TYPE_CHECKING:
    from indexer_env.machine import Machine

_SMOOTHING = 0.005
"""rad/s; a five-hundredth of the table's peak speed in the reference machine (2.7 rad/s)."""


@register
@dataclass(frozen=True)
class CoulombFriction(MachineEffect):
    """Dry friction of the table bearing: constant torque against the motion."""

    name = "friction.coulomb"
    sentence = "Dry friction in the table bearing opposes the motion with a constant torque."
    equation = "T_L += T_c s/√(1+s²), s = φ̇/smoothing"
    source = "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, section 2"
    enters = "table torque"
    alike = ("friction.stribeck",)

    torque: float = parameter(
        "Coulomb torque T_c", "N m", null=0.0, low=0.0, sought=Sought("torque", ladder(0.036, 5), 0.12)
    )
    smoothing: float = parameter("rate at which 71 % of it acts", "rad/s", default=_SMOOTHING, low=0.0, low_open=True)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["coulomb_torque"] += self.torque
        coefficients["coulomb_speed"] = self.smoothing


@register
@dataclass(frozen=True)
class ViscousFriction(MachineEffect):
    """Viscous drag of the table bearing, proportional to the table's speed."""

    name = "friction.viscous"
    sentence = "Viscous drag in the table bearing grows in proportion to the table's speed."
    equation = "T_L += c φ̇"
    source = "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, section 2"
    enters = "table torque"

    coefficient: float = parameter(
        "drag c", "N m s/rad", null=0.0, low=0.0, sought=Sought("torque per speed", ladder(0.1, 5), 0.33)
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["viscous"] += self.coefficient


@register
@dataclass(frozen=True)
class StribeckFriction(MachineEffect):
    """Extra friction at low speed that fades as the lubricant film builds up."""

    name = "friction.stribeck"
    sentence = "Friction in the table bearing is higher at low speed and falls as the film builds up."
    equation = "T_L += T_s /(1 + (φ̇/v_s)²) · s/√(1+s²), s = φ̇/smoothing"
    source = "Hess and Soom, J. Tribology 112 (1990) 147: the 1/(1+(v/v_s)²) form"
    enters = "table torque"
    alike = ("friction.coulomb",)

    torque: float = parameter(
        "breakaway torque above Coulomb's, T_s",
        "N m",
        null=0.0,
        low=0.0,
        sought=Sought("torque", ladder(0.06, 4), 0.12),
    )
    speed: float = parameter(
        "Stribeck speed v_s, half of it left",
        "rad/s",
        default=0.1,
        low=0.0,
        low_open=True,
        sought=Sought("speed", (0.018, 0.074), 0.018, 0.0037, 0.3),
    )
    smoothing: float = parameter("rate at which 71 % of it acts", "rad/s", default=_SMOOTHING, low=0.0, low_open=True)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["stribeck_torque"] = self.torque
        coefficients["stribeck_speed"] = self.speed
        coefficients["stribeck_smoothing"] = self.smoothing
