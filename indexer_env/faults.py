"""Faults of the bench (the paper, section 5) as severities; docs/explanation/physics.md, section Faults."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from indexer_env.build import field_of, from_mapping
from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.effects.base import MachineEffect
from indexer_env.effects.joint import MOST_INPUT_BACKLASH, BaseLooseness, InputBacklash
from indexer_env.effects.roller import RollerCrack, SingleRollerCrack
from indexer_env.errors import ParameterError, refuse
from indexer_env.law_reader import law_of_field, make_law
from indexer_env.laws import Choice, Fixed, Law
from indexer_env.machine import Machine
from indexer_env.units import DEGREE, at_cam

MOST_BACKLASH = 2.0
"""rad at the motor shaft."""

BACKLASH_DEG: dict[str, Any] = {"low": 0.0, "high": MOST_BACKLASH / DEGREE, "unit": "deg at the motor shaft"}
"""Its range in degrees, as `check_number` takes it."""

LOOSE_HOUSING_HZ = 12.0
"""Natural frequency of the housing on fully loosened screws [Hz]. Assumed: below the output joint's 15 Hz, as a machine
that visibly shakes on its floor; tight screws are the rigid limit."""

STATES: dict[str, tuple[str, dict[str, float]]] = {
    "roller": ("roller_crack", {"intact": 0.0, "cracked": 0.4}),
    "screws": ("screw_looseness", {"tight": 0.0, "loose": 1.0}),
}
"""Named states of the bench and the severity each stands for. Assumed, as the paper measures neither: a cracked roller
has lost 40 % of its stiffness in the sense that opens the crack, loose screws are fully loosened."""

NO_CRACK = "left out where no roller is cracked"
NO_CRACK_REMEDY = "add faults.roller=cracked, or faults.roller_crack=0.3"


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
        check_number("Faults", "backlash", self.backlash, low=0.0, high=MOST_BACKLASH, unit="rad at the motor shaft")

    def effects(self, machine: Machine) -> tuple[MachineEffect, ...]:
        """The effects these faults are on a machine, on top of what it has: plays and compliances add, of two cracks
        the stiffnesses left multiply. A fault of severity 0 is none.

        Raises
        ------
        ParameterError
            The machine already has a cracked roller at another station, or so much play that the backlash is more than
            its input joint can have.
        """
        present: list[MachineEffect] = []
        if self.roller_crack > 0.0 and self.cracked_station is None:
            before = _on(machine, RollerCrack(stiffness_loss=0.0))
            present.append(RollerCrack(stiffness_loss=_both_cracks(before.stiffness_loss, self.roller_crack)))
        elif self.roller_crack > 0.0 and self.cracked_station is not None:
            single = _on(machine, SingleRollerCrack(stiffness_loss=0.0, station=self.cracked_station))
            if single.station != self.cracked_station:
                rule = f"{single.station}, where {machine.name} already has its crack"
                raise refuse("Faults", "cracked_station", rule, self.cracked_station)
            stiffness_loss = _both_cracks(single.stiffness_loss, self.roller_crack)
            present.append(SingleRollerCrack(stiffness_loss=stiffness_loss, station=self.cracked_station))
        if self.screw_looseness > 0.0:
            loose = _on(machine, BaseLooseness(compliance=0.0))
            compliance = loose.compliance + self.screw_looseness / _loose_stiffness(machine)
            present.append(dataclasses.replace(loose, compliance=compliance))
        if self.backlash > 0.0:
            most = most_backlash(machine)
            if self.backlash > most:
                rule = f"<= {most:.4g} rad at the motor shaft of {machine.name}, {MOST_INPUT_BACKLASH:g} rad at its cam"
                raise refuse("Faults", "backlash", rule, self.backlash)
            backlash = _on(machine, InputBacklash(backlash=0.0)).backlash + at_cam(self.backlash, machine.reduction)
            present.append(InputBacklash(backlash=min(backlash, MOST_INPUT_BACKLASH)))
        return tuple(present)

    def applied_to(self, machine: Machine) -> Machine:
        """The machine with these faults."""
        return machine.with_effects(*self.effects(machine))


def most_backlash(machine: Machine) -> float:
    """Backlash [rad at the motor shaft] that a fault or wear can add to a machine's; its joint's own does not count."""
    left = MOST_INPUT_BACKLASH - _on(machine, InputBacklash(backlash=0.0)).backlash
    return min(MOST_BACKLASH, left / machine.reduction)


def severities(machine: Machine, faults: Faults) -> dict[str, Any]:
    """How severe each fault of `Faults` is, by field, on a machine that has effects of its own before these faults.

    Its effects that are such faults count, too: plays and compliances add, of cracks the stiffnesses left multiply, at
    the station where all of them are. So a severity may be more than `Faults` takes.
    """
    found = dict(vars(faults))
    cracks, single = _on(machine, RollerCrack(stiffness_loss=0.0)), _on(machine, SingleRollerCrack(stiffness_loss=0.0))
    if cracks.stiffness_loss > 0.0 or single.stiffness_loss > 0.0:
        own = _both_cracks(cracks.stiffness_loss, single.stiffness_loss)
        everywhere = cracks.stiffness_loss > 0.0 or (faults.roller_crack > 0.0 and faults.cracked_station is None)
        found["roller_crack"] = _both_cracks(own, faults.roller_crack)
        found["cracked_station"] = None if everywhere else single.station
    loose = _on(machine, BaseLooseness(compliance=0.0))
    if loose.compliance > 0.0:
        found["screw_looseness"] += loose.compliance * _loose_stiffness(machine)
    play = _on(machine, InputBacklash(backlash=0.0))
    if play.backlash > 0.0:
        found["backlash"] += play.backlash / machine.reduction
    return found


def faults_from_mapping(mapping: Mapping[str, Any]) -> Faults:
    """Build faults from a plain mapping (YAML, Hydra): fields of `Faults`, in degrees where a key ends in ``_deg``, or
    the named states `roller` and `screws`. What is null counts as not given.

    Raises
    ------
    ParameterError
        Unknown key or state, a value out of range, or a fault given by its state and its number.
    """
    if not isinstance(mapping, Mapping):
        raise ParameterError(f"faults must be a mapping of faults to their values, got {mapping!r}.")
    given = {str(key): value for key, value in mapping.items() if value is not None}
    fields = tuple(field.name for field in dataclasses.fields(Faults))
    values = {name: law.centre for name, law in fault_laws(given, fields).items()}
    return from_mapping(Faults, values, "faults", fault_keys(given, fields))


def fault_laws(mapping: Mapping[str, Any], fields: Collection[str]) -> dict[str, Law]:
    """Law by field, in SI units, of a mapping (YAML) of fields, ``_deg`` keys or states to values or laws.

    Raises
    ------
    ParameterError
        Unknown key, state or law, or one fault given by two keys.
    """
    laws: dict[str, Law] = {}
    keys: dict[str, str] = {}
    for key, given in mapping.items():
        if key in STATES:
            name, law = STATES[key][0], _law_of_states(key, make_law("faults", key, given))
        else:
            name, law = law_of_field("faults", key, given, (*fields, *STATES))
        if name in laws:
            raise refuse("faults", key, f"left out where faults.{keys[name]} is given, which says the same", given)
        laws[name], keys[name] = law, key
    return laws


def fault_keys(mapping: Mapping[str, Any], fields: Collection[str]) -> dict[str, str]:
    """The key of a mapping by which each field is given, that of a state apart."""
    return {field_of("faults", key, fields)[0]: key for key in mapping if key not in STATES}


def _law_of_states(key: str, law: Law) -> Law:
    if not law.lists:
        raise refuse("faults", key, f"one of {', '.join(STATES[key][1])} or a choice of them", law)
    for state in law.extremes:
        check_choice("faults", key, state, STATES[key][1])
    severities = tuple(STATES[key][1][state] for state in law.extremes)
    return Choice(severities) if isinstance(law, Choice) else Fixed(severities[0])


_E = TypeVar("_E", bound=MachineEffect)


def _on(machine: Machine, null: _E) -> _E:
    """The machine's own effect of this kind, or the null one."""
    return next((effect for effect in machine.effects if isinstance(effect, type(null))), null)


def _loose_stiffness(machine: Machine) -> float:
    """Stiffness of a base on fully loosened screws [N m/rad]."""
    inertia = machine.follower_inertia + machine.housing_inertia
    return inertia * (2.0 * math.pi * LOOSE_HOUSING_HZ) ** 2


def _both_cracks(first: float, second: float) -> float:
    return 1.0 - (1.0 - first) * (1.0 - second) if first > 0.0 else second
