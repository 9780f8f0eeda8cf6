"""Motor and reducer: what makes the cam's drive side run other than evenly."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import PHASES, MachineEffect, Sought, ladder, parameter, register

if TYPE_CHECKING:
    from indexer_env.machine import Machine


@register
@dataclass(frozen=True)
class Slip(MachineEffect):
    """Induction motor near synchronous speed: its speed falls in proportion to its torque; its inertia takes part."""

    name = "drive.slip"
    sentence = "The motor's speed falls with the torque asked of it, as an induction motor's does."
    equation = "J_m γ̈ = (γ̇_command - γ̇)/c - M1 ∂(drive side)/∂γ; the drive side is at τ γ where nothing ripples on it"
    source = "linear part of the torque-speed curve, e.g. Leonhard, Control of Electrical Drives (2001)"
    enters = "the motor's speed through the torque of joint 1"
    models = ("B", "B_on_base")

    compliance: float = parameter(
        "speed lost per torque c", "rad/(s N m)", null=0.0, low=0.0, sought=Sought("slip", ladder(5e-4, 5), 5e-4, 1e-5)
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["slip_compliance"] += self.compliance


@register
@dataclass(frozen=True)
class SpeedRipple(MachineEffect):
    """The motor's speed ripples with its own rotation (cogging, a bent coupling, an eccentric pinion)."""

    name = "drive.speed_ripple"
    sentence = "The motor's speed ripples at an order of its own shaft."
    equation = "angle of the shaft = γ + (depth/order) sin(order γ + phase); its speed = γ̇ (1 + depth cos(…))"
    source = "kinematics; depth is the relative amplitude of the speed"
    enters = "drive side of joint 1"
    alike = ("drive.transmission_error",)

    depth: float = parameter(
        "relative amplitude of the speed",
        "-",
        null=0.0,
        low=0.0,
        high=0.5,
        sought=Sought("ripple", ladder(0.0065, 5), 0.013, 0.0, 5.0),
    )
    order: float = parameter("order", "1/motor turn", default=1.0, low=0.0, low_open=True, sought=Sought("-"))
    phase: float = parameter("phase at γ = 0", "rad", default=0.0, sought=Sought("-", PHASES, 0.5))

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["ripple_amplitude"] = self.depth / self.order / machine.reduction_ratio
        coefficients["ripple_order"] = self.order
        coefficients["ripple_phase"] = self.phase


@register
@dataclass(frozen=True)
class TransmissionError(MachineEffect):
    """The reducer's output wavers about τγ at an order of its gears."""

    name = "drive.transmission_error"
    sentence = "The reducer's output angle wavers at an order of its gears."
    equation = "drive side of joint 1 = τ γ + e sin(order γ + phase)"
    source = "Smith, Gear Noise and Vibration (2003): transmission error as a displacement input"
    enters = "drive side of joint 1"
    alike = ("drive.speed_ripple",)

    amplitude: float = parameter(
        "amplitude e at the cam shaft",
        "rad",
        null=0.0,
        low=0.0,
        high=0.1,
        sought=Sought("input deflection", ladder(0.0165, 5), 0.0165, 0.0, 5.0),
    )
    order: float = parameter(
        "order (for a worm: its threads)", "1/motor turn", default=2.0, low=0.0, low_open=True, sought=Sought("-")
    )
    phase: float = parameter("phase at γ = 0", "rad", default=0.0, sought=Sought("-", PHASES, 0.5))

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["transmission_amplitude"] = self.amplitude
        coefficients["transmission_order"] = self.order
        coefficients["transmission_phase"] = self.phase


@register
@dataclass(frozen=True)
class MeshStiffness(MachineEffect):
    """The reducer's stiffness varies as teeth come in and out of mesh."""

    name = "drive.mesh_stiffness"
    sentence = "The reducer's stiffness varies as teeth come in and out of mesh."
    equation = "M1 → M1 (1 + depth cos(order γ + phase))"
    source = "Kahraman and Singh, J. Sound Vib. 146 (1991) 135: first harmonic of the mesh stiffness"
    enters = "torque of joint 1"
    models = ("B", "B_on_base")

    depth: float = parameter(
        "relative amplitude", "-", null=0.0, low=0.0, high=0.9, sought=Sought("-", (0.05, 0.15, 0.4), 0.05, 0.0, 0.9)
    )
    order: float = parameter(
        "order (teeth in mesh per motor turn)", "1/motor turn", default=2.0, low=0.0, low_open=True, sought=Sought("-")
    )
    phase: float = parameter("phase at γ = 0", "rad", default=0.0, sought=Sought("-", PHASES, 0.5))

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["mesh_depth"] = self.depth
        coefficients["mesh_order"] = self.order
        coefficients["mesh_phase"] = self.phase


@register
@dataclass(frozen=True)
class MeshFriction(MachineEffect):
    """The reducer's teeth rub in proportion to the torque that they carry, as a worm's do above all."""

    name = "drive.mesh_friction"
    sentence = "The reducer's teeth rub in proportion to the torque that they carry."
    equation = (
        "M1 → M1/(1 + κ s) at the cam and M1 at the motor, κ = loss/(1 - loss), s = 1 where the motor drives the "
        "cam, -1 where the cam drives the motor"
    )
    source = (
        "friction in proportion to the teeth's normal force, e.g. Shigley, Mechanical Engineering Design, worm "
        "gearing: efficiencies η = 1 - loss forwards and 2 - 1/η backwards; the motor turns forwards"
    )
    enters = "torque of joint 1"
    models = ("B", "B_on_base")

    # a worm that loses half of its torque locks itself, so that the table could not drive it
    loss: float = parameter(
        "share of the torque that is lost where the motor drives, 1 - efficiency",
        "-",
        null=0.0,
        low=0.0,
        high=0.5,
        high_open=True,
        sought=Sought("-", (0.02, 0.06, 0.2, 0.4), 0.02, 0.0, 0.49),
    )

    @property
    def friction(self) -> float:
        """κ [-]."""
        return self.loss / (1.0 - self.loss)

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["mesh_friction"] += self.friction
