"""Faults of the bench (paper.txt, section 5) as severities, and the effects they stand for (design.md, section 5)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TypeVar

from indexer_env.checks import check_integer, check_number
from indexer_env.effects.base import MachineEffect
from indexer_env.effects.joint import BaseLooseness, InputBacklash
from indexer_env.effects.roller import RollerCrack, SingleRollerCrack
from indexer_env.errors import refuse
from indexer_env.machine import Machine

LOOSE_HOUSING_HZ = 12.0
"""Natural frequency of the housing on fully loosened screws [Hz]. Assumed: below the output joint's 15 Hz, as a machine
that visibly shakes on its floor; tight screws are the rigid limit."""


@dataclass(frozen=True)
class Faults:
    """Severities of the three faults of the paper's bench; all zero is the healthy machine, bit for bit.

    Attributes
    ----------
    roller_crack : float
        Loss of stiffness of the output joint in one sense, 1 - ρ [-], in [0, 1).
    cracked_station : int or None
        None: at all stations, as the paper models it; else the station (0 … S-1) at which the cracked roller carries.
    screw_looseness : float
        Share of the base's full compliance [-], in [0, 1]; 1 puts the housing at LOOSE_HOUSING_HZ.
    backlash : float
        Added play of the reducer at the MOTOR shaft [rad] (the paper's 0 … 20°), >= 0.
    """

    roller_crack: float = 0.0
    cracked_station: int | None = None
    screw_looseness: float = 0.0
    backlash: float = 0.0

    def __post_init__(self) -> None:
        check_number("Faults", "roller_crack", self.roller_crack, low=0.0, high=1.0, high_open=True)
        if self.cracked_station is not None:
            check_integer("Faults", "cracked_station", self.cracked_station, low=0)
        check_number("Faults", "screw_looseness", self.screw_looseness, low=0.0, high=1.0)
        check_number("Faults", "backlash", self.backlash, low=0.0, high=2.0, unit="rad at the motor shaft")

    def effects(self, machine: Machine) -> tuple[MachineEffect, ...]:
        """The effects these faults are on a machine, on top of what it has: plays and compliances add, of two cracks
        the stiffnesses left multiply. A fault of severity 0 is none.

        Raises
        ------
        ParameterError
            The machine already has a cracked roller at another station.
        """
        present: list[MachineEffect] = []
        if self.roller_crack > 0.0 and self.cracked_station is None:
            before = _on(machine, RollerCrack(severity=0.0))
            present.append(RollerCrack(severity=_both_cracks(before.severity, self.roller_crack)))
        elif self.roller_crack > 0.0 and self.cracked_station is not None:
            single = _on(machine, SingleRollerCrack(severity=0.0, station=self.cracked_station))
            if single.station != self.cracked_station:
                rule = f"{single.station}, where {machine.name} already has its crack"
                raise refuse("Faults", "cracked_station", rule, self.cracked_station)
            severity = _both_cracks(single.severity, self.roller_crack)
            present.append(SingleRollerCrack(severity=severity, station=self.cracked_station))
        if self.screw_looseness > 0.0:
            loose = _on(machine, BaseLooseness(compliance=0.0))
            inertia = machine.follower_inertia + machine.housing_inertia
            stiffness = inertia * (2.0 * math.pi * LOOSE_HOUSING_HZ) ** 2
            compliance = loose.compliance + self.screw_looseness / stiffness
            present.append(dataclasses.replace(loose, compliance=compliance))
        if self.backlash > 0.0:
            play = _on(machine, InputBacklash(play=0.0)).play + self.backlash * machine.reduction
            present.append(InputBacklash(play=play))
        return tuple(present)

    def applied_to(self, machine: Machine) -> Machine:
        """The machine with these faults."""
        return machine.with_effects(*self.effects(machine))


_E = TypeVar("_E", bound=MachineEffect)


def _on(machine: Machine, null: _E) -> _E:
    """The machine's own effect of this kind, or the null one."""
    return next((effect for effect in machine.effects if isinstance(effect, type(null))), null)


def _both_cracks(first: float, second: float) -> float:
    return 1.0 - (1.0 - first) * (1.0 - second) if first > 0.0 else second
