"""The machine: joints, inertias, motion law and the effects it is extended by. Frozen, self-checking, SI units."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from indexer_env.build import from_mapping
from indexer_env.checks import as_python, check_choice, check_integer, check_number
from indexer_env.effects import MachineEffect, effects_by_name, make_effect
from indexer_env.errors import MotionLawWarning, ParameterError, refuse
from indexer_env.motion_law import ModifiedSine, MotionLaw, TableLaw, motion_law
from indexer_env.operating_point import OperatingPoint

MODELS = ("A", "B", "B_on_base")
"""A: only the output joint (1 DOF); B: input and output joint (2 DOF); B_on_base: also the base joint (3 DOF)."""

NOT_IN_MODEL = {
    "A": ("input_joint", "cam_inertia", "follower_inertia", "base_joint", "housing_inertia", "motor_inertia"),
    "B": ("base_joint", "housing_inertia", "motor_inertia"),
    "B_on_base": ("motor_inertia",),
}
"""Parameters that each model's equations do not have; housing_inertia comes in with base.looseness, which brings a
joint 3 of its own, and motor_inertia with drive.slip."""

CONTACT_LAWS = ("clipped", "kelvin_voigt", "damped_play")
"""clipped: contact pushes and never pulls (default); kelvin_voigt: spring and damper while δ is beyond ±g/2, also when
they pull; damped_play: the damper also acts inside the play. Without play nothing separates: all three are the same."""


@dataclass(frozen=True)
class Joint:
    """An elasto-dynamic joint, all four shapes of the paper's fig. 3 (docs/explanation/physics.md, section Joints).

    Attributes
    ----------
    stiffness : float
        k for δ > g/2 [N m/rad], > 0.
    damping : float
        r [N m s/rad], >= 0.
    backlash : float
        g, TOTAL play [rad], >= 0; the dead zone is ±g/2.
    stiffness_ratio : float
        ρ = stiffness for δ < 0 over stiffness for δ > 0 [-], in (0, 1].
    """

    stiffness: float
    damping: float
    backlash: float = 0.0
    stiffness_ratio: float = 1.0

    def __post_init__(self) -> None:
        check_number("Joint", "stiffness", self.stiffness, low=0.0, low_open=True, unit="N m/rad")
        check_number("Joint", "damping", self.damping, low=0.0, unit="N m s/rad")
        check_number("Joint", "backlash", self.backlash, low=0.0, high=0.5, unit="rad")
        check_number(
            "Joint", "stiffness_ratio", self.stiffness_ratio, low=0.0, low_open=True, high=1.0,
            remedy="it is the softer sense's stiffness over the stiffer one's",
        )  # fmt: skip
        as_python(self, "stiffness", "damping", "backlash", "stiffness_ratio")


@dataclass(frozen=True)
class Machine:
    """A cam indexing machine (docs/explanation/physics.md, section The machine).

    Attributes
    ----------
    input_joint, output_joint, base_joint : Joint
        Joint 1 (reducer and input shaft), 2 (indexer and output shaft), 3 (base screws; only in B_on_base).
    cam_inertia, follower_inertia, table_inertia, housing_inertia, motor_inertia : float
        J_C, J_F, J_t, J_b, J_m [kg m²], > 0; J_m takes part only with drive.slip.
    reduction_ratio : float
        i = 1/τ, motor turns per cam turn [-], > 0.
    stations : int
        S, stations of the table = cam turns per table turn, >= 2.
    motion_share : float
        f, share of the cam turn in which the table moves [-], in (0, 1].
    motion_law : MotionLaw
        Law of the cam. A `TableLaw` that does not close on the stations is refused; what else a table cannot satisfy
        is a `MotionLawWarning`.
    model, contact_law : str
        One of MODELS, one of CONTACT_LAWS.
    effects : tuple of MachineEffect
        What the machine is extended by; an effect at its null value changes no bit.
    name : str
        Used in messages.
    """

    input_joint: Joint
    output_joint: Joint
    base_joint: Joint
    cam_inertia: float
    follower_inertia: float
    table_inertia: float
    housing_inertia: float
    motor_inertia: float
    reduction_ratio: float
    stations: int
    motion_share: float
    motion_law: MotionLaw = field(default_factory=ModifiedSine)
    model: str = "B"
    contact_law: str = "clipped"
    effects: tuple[MachineEffect, ...] = ()
    name: str = "machine"

    def __post_init__(self) -> None:
        for joint in ("input_joint", "output_joint", "base_joint"):
            if not isinstance(getattr(self, joint), Joint):
                raise refuse("Machine", joint, "a Joint", getattr(self, joint))
        for part in ("cam", "follower", "table", "housing", "motor"):
            name = f"{part}_inertia"
            check_number("Machine", name, getattr(self, name), low=0.0, low_open=True, unit="kg m²")
        check_number("Machine", "reduction_ratio", self.reduction_ratio, low=0.0, low_open=True)
        check_integer("Machine", "stations", self.stations, low=2, high=1000)
        check_number("Machine", "motion_share", self.motion_share, low=0.0, low_open=True, high=1.0)
        inertias = (f"{part}_inertia" for part in ("cam", "follower", "table", "housing", "motor"))
        as_python(self, *inertias, "reduction_ratio", "stations", "motion_share")
        if not isinstance(self.motion_law, MotionLaw):
            raise refuse("Machine", "motion_law", "a MotionLaw", self.motion_law, "see indexer_env.motion_law")
        if isinstance(self.motion_law, TableLaw):
            for finding in self.motion_law.check(self.stations):
                warnings.warn(finding, MotionLawWarning, stacklevel=3)
        check_choice("Machine", "model", self.model, MODELS)
        check_choice("Machine", "contact_law", self.contact_law, CONTACT_LAWS)
        if not isinstance(self.name, str) or not self.name:
            raise refuse("Machine", "name", "a text", self.name, "put it in quotes")
        self._check_effects()

    def _check_effects(self) -> None:
        if not isinstance(self.effects, tuple):
            raise refuse("Machine", "effects", "a tuple of machine effects", self.effects)
        names = []
        for effect in self.effects:
            if not isinstance(effect, MachineEffect):
                raise refuse(
                    "Machine",
                    "effects",
                    "a tuple of machine effects",
                    effect,
                    "sensor effects extend a Sensor",
                )
            names.append(effect.name)
        for name in names:
            if names.count(name) > 1:
                raise refuse("Machine", "effects", "different effects", name, "it is there twice; merge the two")

    @property
    def reduction(self) -> float:
        """τ = 1/i, cam turns per motor turn [-]."""
        return 1.0 / self.reduction_ratio

    @property
    def advance(self) -> float:
        """h = 2π/S, rotation of the table per cam turn [rad]."""
        return 2.0 * math.pi / self.stations

    def turn_duration(self, operating_point: OperatingPoint) -> float:
        """Time of one table turn at the commanded motor speed [s]: S cam turns."""
        return 2.0 * math.pi * self.stations * self.reduction_ratio / operating_point.motor_speed

    def with_effects(self, *effects: MachineEffect) -> Machine:
        """The machine extended by these effects; one of a name it already has replaces that."""
        return dataclasses.replace(self, effects=self.effects_with(*effects)) if effects else self

    def effects_with(self, *effects: MachineEffect) -> tuple[MachineEffect, ...]:
        """Its effects and these; one of a name it already has replaces that."""
        replaced = {effect.name for effect in effects}
        return tuple(effect for effect in self.effects if effect.name not in replaced) + effects


def machine_from_mapping(mapping: Mapping[str, Any]) -> Machine:
    """Build a machine from a plain mapping (YAML, Hydra).

    Keys are the fields of `Machine`; joints are mappings of the fields of `Joint`; `motion_law` is a name or a mapping
    for `indexer_env.motion_law.motion_law`; `effects` is a mapping as `effects_by_name` takes it.

    Raises
    ------
    ParameterError
        Unknown or missing key, wrong type or value, an effect or law that does not exist.
    """
    if not isinstance(mapping, Mapping):
        raise ParameterError(f"A machine must be a mapping of parameters to values, got {mapping!r}.")
    values = dict(mapping)
    for joint in ("input_joint", "output_joint", "base_joint"):
        if joint in values and not isinstance(values[joint], Joint):
            values[joint] = from_mapping(Joint, values[joint], owner=f"Machine.{joint}")
    if "motion_law" in values and not isinstance(values["motion_law"], MotionLaw):
        values["motion_law"] = motion_law(values["motion_law"])
    effects = values.get("effects")
    if effects is None:
        values["effects"] = ()
    elif isinstance(effects, Mapping):
        values["effects"] = tuple(make_effect(name, given) for name, given in effects_by_name(effects).items())
    elif not isinstance(effects, tuple):
        raise refuse("Machine", "effects", "a mapping of effect names to their parameters", effects)
    return from_mapping(Machine, values)
