"""Cracked rollers: a crack opens under load in one sense, so the output joint is bilinear (Lucifredi, paper [2])."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import MachineEffect, Sought, parameter, register
from indexer_env.errors import refuse

if TYPE_CHECKING:
    from indexer_env.machine import Machine

_STIFFNESS_LOSS = "loss of stiffness for δ2 < 0, 1 - ρ"


@register
@dataclass(frozen=True)
class RollerCrack(MachineEffect):
    """Cracked rollers as the paper models them: joint 2 bilinear at every station."""

    name = "roller.crack"
    sentence = "Cracked rollers make the output joint softer in one sense at every station."
    equation = "joint 2: ρ → ρ (1 - stiffness_loss)"
    source = "the paper, section 4.1 and fig. 3c"
    enters = "torque of joint 2"

    stiffness_loss: float = parameter(
        _STIFFNESS_LOSS,
        "-",
        null=0.0,
        low=0.0,
        high=1.0,
        high_open=True,
        sought=Sought("-", (0.05, 0.15, 0.4, 0.7, 0.85, 0.93), 0.05, 0.0, 0.95),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["ratio_2"] *= 1.0 - self.stiffness_loss


@register
@dataclass(frozen=True)
class SingleRollerCrack(MachineEffect):
    """One cracked roller: joint 2 bilinear only in the cam turn in which that roller carries the load."""

    name = "roller.crack_single"
    sentence = "One cracked roller makes the output joint softer in one sense, once per table turn."
    equation = "joint 2: ρ → ρ (1 - stiffness_loss) while the table moves from `station` to the next and dwells there"
    source = "own extension of the paper's fig. 3c to one roller of the turret"
    enters = "torque of joint 2"

    stiffness_loss: float = parameter(
        _STIFFNESS_LOSS,
        "-",
        null=0.0,
        low=0.0,
        high=1.0,
        high_open=True,
        sought=Sought("-", (0.05, 0.15, 0.4, 0.7, 0.85, 0.93), 0.05, 0.0, 0.95),
    )
    station: int = parameter(
        "station the roller leaves under load", "-", default=0, low=0, whole=True, sought=Sought("-")
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        if self.station >= machine.stations:
            raise refuse(self.name, "station", f"below the machine's {machine.stations} stations", self.station)
        coefficients["single_ratio_2"] = 1.0 - self.stiffness_loss
        coefficients["single_station"] = float(self.station)
