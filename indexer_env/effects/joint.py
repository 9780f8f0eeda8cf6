"""Play and hardening of the joints, and the loosened base."""

from __future__ import annotations

import math
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import MachineEffect, Sought, ladder, parameter, register

if TYPE_CHECKING:
    from indexer_env.machine import Machine


MOST_INPUT_BACKLASH = 0.2
"""rad at the cam shaft."""


@register
@dataclass(frozen=True)
class InputBacklash(MachineEffect):
    """More play in the reducer and input shaft."""

    name = "input.backlash"
    sentence = "The reducer has more play."
    equation = "g1 → g1 + backlash (total play at the cam shaft; dead zone ±g1/2)"
    source = "docs/explanation/physics.md, section Joints; the paper, fig. 3b"
    enters = "torque of joint 1"
    models = ("B", "B_on_base")

    backlash: float = parameter(
        "added backlash (total play) at the cam shaft",
        "rad",
        null=0.0,
        low=0.0,
        high=MOST_INPUT_BACKLASH,
        sought=Sought("input deflection", ladder(0.033, 5), 0.033, 0.0, 8.0),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["backlash_1"] += self.backlash


@register
@dataclass(frozen=True)
class OutputBacklash(MachineEffect):
    """More play between cam and rollers or at the output shaft."""

    name = "output.backlash"
    sentence = "There is more play between the cam and its rollers."
    equation = "g2 → g2 + backlash (total play at the table; dead zone ±g2/2)"
    source = "docs/explanation/physics.md, section Joints; the paper, fig. 3b"
    enters = "torque of joint 2"

    backlash: float = parameter(
        "added backlash (total play) at the table",
        "rad",
        null=0.0,
        low=0.0,
        high=0.2,
        sought=Sought("deflection", ladder(0.016, 5), 0.054, 0.0, 5.4),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["backlash_2"] += self.backlash


@register
@dataclass(frozen=True)
class OutputCubicStiffness(MachineEffect):
    """Contact that hardens with load: a cubic term in the output joint."""

    name = "output.cubic_stiffness"
    sentence = "The output joint hardens as its deflection grows."
    equation = "M2 += k_c x³ in contact, x = δ2 ∓ g2/2"
    source = "first odd term of a hardening contact (Duffing), e.g. Nayfeh and Mook, Nonlinear Oscillations (1979)"
    enters = "torque of joint 2"

    stiffness: float = parameter(
        "cubic stiffness k_c",
        "N m/rad³",
        null=0.0,
        low=0.0,
        sought=Sought("cubic stiffness", ladder(0.0078, 8, 2.0), 0.0078, 0.0, 78.0),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["cubic_2"] += self.stiffness


@register
@dataclass(frozen=True)
class BaseLooseness(MachineEffect):
    """Loose base screws: the housing rotates on joint 3, Model B becomes Model B on its base."""

    name = "base.looseness"
    sentence = "The base screws are loose, so that the housing rotates against the floor."
    equation = (
        "k3 = 1/compliance, r3 = 2 ζ √(k3 (J_F + J_b)), total play g3; compliance 0 is Model B. On a machine that has "
        "a joint 3, in series with it: 1/k3, g3 and r3/k3² add"
    )
    source = "docs/explanation/physics.md, sections The machine and Faults"
    enters = "joint 3"
    models = ("B", "B_on_base")

    compliance: float = parameter(
        "compliance of the base 1/k3",
        "rad/(N m)",
        null=0.0,
        low=0.0,
        sought=Sought(
            "base compliance", ladder(2.2e-3, 15, 2.0), 2.2e-3, 4.4e-4, 72.0, series="output_joint.stiffness"
        ),
    )
    damping_ratio: float = parameter(
        "damping ratio ζ of the housing on it",
        "-",
        default=0.05,
        low=0.0,
        high=1.0,
        # bolted steel has 0.02 to 0.15 (Newmark and Hall, Earthquake spectra and design, 1982): what damps more is no
        # loose base
        sought=Sought("-", (0.05,), 0.05, 0.0, 0.15),
    )
    backlash: float = parameter("backlash (total play) of the screws g3", "rad", default=0.0, low=0.0, high=0.05)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        inertia = coefficients["follower_inertia"] + coefficients["housing_inertia"]
        damping = 2.0 * self.damping_ratio * math.sqrt(1.0 / self.compliance * inertia)
        compliance, softer, before, backlash = self.compliance, self.compliance, 0.0, 0.0
        if machine.model == "B_on_base":
            own = 1.0 / coefficients["stiffness_3"]
            compliance, softer = own + self.compliance, own / coefficients["ratio_3"] + self.compliance
            before, backlash = coefficients["damping_3"] * (own / compliance) ** 2, coefficients["backlash_3"]
        coefficients["stiffness_3"] = 1.0 / compliance
        coefficients["damping_3"] = before + damping * (self.compliance / compliance) ** 2
        coefficients["backlash_3"] = backlash + self.backlash
        coefficients["ratio_3"] = compliance / softer
