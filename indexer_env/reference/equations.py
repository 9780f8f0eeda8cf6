"""The equations of motion with all effects, smooth between two edges, from docs/explanation/physics.md."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

from indexer_env.effects import LOADABLE
from indexer_env.errors import ParameterError, refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference.cam import CamTurn, Stretch
from indexer_env.reference.contact import Contact
from indexer_env.reference.tables import spline_of, table_of

STATE = (
    "cam_angle", "cam_rate", "table_angle", "table_rate", "housing_angle", "housing_rate", "motor_angle", "motor_rate",
)  # fmt: skip
"""Order of the state (8,). Models without a housing keep its two at 0; Model A's cam pair is filled in by the sheet."""

SHEET = (
    "cam_angle", "cam_rate", "cam_acceleration", "table_acceleration", "housing_acceleration", "motor_acceleration",
    "deflection_1", "deflection_rate_1", "deflection_2", "deflection_rate_2", "deflection_3", "deflection_rate_3",
    "torque_1", "torque_2", "torque_3",
)  # fmt: skip
"""What `Equations.sheet` returns at a state, in this order."""

Sheet = Callable[[Sequence[float]], tuple[float, ...]]

Load = Callable[[float, float, float, float, float], float]
"""A torque [N m] from α, φ, φ̇, δ2 and its rate."""

_VARIABLES = ("cam", "angle", "speed", "deflection", "rate")
"""The same as variables of tables."""

_KNOWN = frozenset(name for name in LOADABLE if not name.startswith("sensor."))


class Equations:
    """A machine at an operating point, its effects read off into the places where they enter.

    Attributes
    ----------
    model : str
        Model after the effects: base.looseness makes B_on_base of B.
    cam : CamTurn
    present : tuple of int
        Joints (0, 1, 2) that the model has and that have edges.
    """

    def __init__(self, machine: Machine, operating_point: OperatingPoint) -> None:
        self.machine, self.operating_point = machine, operating_point
        self.effects: dict[str, Any] = {effect.name: effect for effect in machine.effects if not effect.is_null}
        for name in self.effects:
            if name not in _KNOWN:
                raise ParameterError(
                    f"simulate_reference does not know the effect {name!r}; it knows {', '.join(sorted(_KNOWN))}."
                )
        self.model = machine.model
        if "base.looseness" in self.effects:
            if machine.model == "A":
                raise ParameterError(
                    "base.looseness needs Machine.model B or B_on_base, got 'A'; Model A has no housing to move."
                )
            self.model = "B_on_base"
        for name in ("cam.station_spacing", "roller.crack_single"):
            effect = self.effects.get(name)
            if effect is not None and effect.station >= machine.stations:
                raise refuse(name, "station", f"below the machine's {machine.stations} stations", effect.station)
        self.cam = CamTurn(machine, self.effects)
        self._sound, self._cracked = self._contacts()
        joints = {"A": (1,), "B": (0, 1), "B_on_base": (0, 1, 2)}[self.model]
        self.present = tuple(joint for joint in joints if self._sound[joint].edged)

    def _contacts(self) -> tuple[tuple[Contact, ...], tuple[Contact, ...]]:
        """The three joints with their effects, at the other stations and at the one with the cracked roller."""
        machine, effects = self.machine, self.effects

        def contact(joint, backlash: float = 0.0, ratio: float = 1.0, bilinear: bool = False, **more) -> Contact:
            g, rho = joint.backlash + backlash, joint.stiffness_ratio * ratio
            edged = g > 0.0 or rho < 1.0 or bilinear
            return Contact(joint.stiffness, joint.damping, g, rho, machine.contact_law, edged, **more)

        def size(name: str, field: str) -> float:
            return getattr(effects[name], field) if name in effects else 0.0

        backlash, rubs = size("input.backlash", "backlash"), "drive.mesh_friction" in effects
        first = contact(machine.input_joint, backlash, bilinear=rubs)
        backlash, cubic = size("output.backlash", "backlash"), size("output.cubic_stiffness", "stiffness")
        ratio = 1.0 - size("roller.crack", "stiffness_loss")
        single = effects.get("roller.crack_single")
        second = contact(machine.output_joint, backlash, ratio, bilinear=single is not None, cubic=cubic)
        third = contact(machine.base_joint)
        if "base.looseness" in effects:
            third = self._loose_base(effects["base.looseness"])
        cracked = second
        if single is not None:
            cracked = dataclasses.replace(second, ratio=second.ratio * (1.0 - single.stiffness_loss))
        return (first, second, third), (first, cracked, third)

    def _loose_base(self, loose: Any) -> Contact:
        """Joint 3 with loose screws: alone, or in series with the base that the machine stands on."""
        machine, base = self.machine, self.machine.base_joint
        J = machine.follower_inertia + machine.housing_inertia
        k, r, g, rho = 1.0 / loose.compliance, 2.0 * loose.damping_ratio * math.sqrt(J / loose.compliance), 0.0, 1.0
        if machine.model == "B_on_base":
            # a torque deflects both by their own compliance; each loses by its damper what it takes of the rate
            both = k * base.stiffness / (k + base.stiffness)
            r = r * (both / k) ** 2 + base.damping * (both / base.stiffness) ** 2
            softer = k * base.stiffness * base.stiffness_ratio / (k + base.stiffness * base.stiffness_ratio)
            k, g, rho = both, base.backlash, softer / both
        g += loose.backlash
        return Contact(k, r, g, rho, machine.contact_law, g > 0.0 or rho < 1.0)

    def contacts(self, turn: int) -> tuple[Contact, ...]:
        """The three joints as they are in a cam turn."""
        single = self.effects.get("roller.crack_single")
        return self._cracked if single and turn % self.machine.stations == single.station else self._sound

    def start(self) -> list[float]:
        """State of kinematic motion at the start angle: φ = β(α), the motor at its commanded speed. Model A's cam is
        the drive side, with what wavers on it."""
        gamma, gamma_rate = (
            self.operating_point.start_angle / self.machine.reduction,
            self.operating_point.motor_speed,
        )
        alpha, rate = self.operating_point.start_angle, self.machine.reduction * gamma_rate
        if self.model == "A":
            alpha, rate, _ = self._drive()(gamma, gamma_rate)
        beta, beta1, _ = self.cam.stretch(*self.cam.place(alpha)).follower(alpha)
        return [alpha, rate, beta, beta1 * rate, 0.0, 0.0, gamma, gamma_rate]

    def sheet(self, stretch: Stretch, contacts: Sequence[Contact], regions: Sequence[int]) -> Sheet:
        """The equation sheet on one stretch of the cam with the joints in these regions: a smooth function that gives
        the values named in `SHEET` for a state in the order of `STATE`."""
        machine = self.machine
        J_C, J_F = machine.cam_inertia, machine.follower_inertia
        J_t, J_b = machine.table_inertia, machine.housing_inertia
        rigid_drive, on_base = self.model == "A", self.model == "B_on_base"
        follower, drive, mesh, load, slip = (
            stretch.follower,
            self._drive(),
            self._mesh(),
            self._load(stretch),
            self._slip(),
        )
        (k1, o1, r1, _), (k2, o2, r2, k_c), (k3, o3, r3, _) = (
            contact.line(region) for contact, region in zip(contacts, regions, strict=True)
        )
        rubbing = self.effects.get("drive.mesh_friction")
        share = 1.0 / (1.0 + rubbing.loss / (1.0 - rubbing.loss) * regions[0]) if rubbing else 1.0

        def sheet(state: Sequence[float]) -> tuple[float, ...]:
            alpha, w, phi, phi_rate, theta, theta_rate, gamma, gamma_rate = state
            side, side_rate, side_acc = drive(gamma, gamma_rate)
            if rigid_drive:
                alpha, w = side, side_rate
            b0, b1, b2 = follower(alpha)
            d1, v1 = side - alpha, side_rate - w
            d2, v2 = phi - b0 - theta, phi_rate - b1 * w - theta_rate
            M_motor = 0.0 if rigid_drive else mesh(gamma) * (k1 * (d1 - o1) + r1 * v1)
            M1 = share * M_motor
            x = d2 - o2
            M2 = (k2 + k_c * x * x) * x + r2 * v2
            M3 = k3 * (theta - o3) + r3 * theta_rate if on_base else 0.0

            phi_acc = -(load(alpha, phi, phi_rate, d2, v2) + M2) / J_t
            # what the drive side turns per turn of the motor is the lever of M1 on it
            gamma_acc = slip(gamma_rate, drive(gamma, 1.0)[1] * M_motor)
            theta_acc = 0.0
            if rigid_drive:
                # side_acc is at γ̈ = 0; Model A has no joint 1, so nothing slows its motor down
                alpha_acc = side_acc
            elif on_base:
                # (J_C + J_F β'²) α̈ + J_F β' θ̈     = M1 + β' M2 - J_F β' β'' α̇²
                #  J_F β' α̈         + (J_F + J_b) θ̈ = M2 - M3 - J_F β'' α̇²
                a, b, c = J_C + J_F * b1 * b1, J_F * b1, J_F + J_b
                p, q = M1 + b1 * M2 - J_F * b1 * b2 * w * w, M2 - M3 - J_F * b2 * w * w
                alpha_acc = (c * p - b * q) / (a * c - b * b)
                theta_acc = (q - b * alpha_acc) / c
            else:
                alpha_acc = (M1 + b1 * (M2 - J_F * b2 * w * w)) / (J_C + J_F * b1 * b1)
            return (
                alpha, w, alpha_acc, phi_acc, theta_acc, gamma_acc,
                d1, v1, d2, v2, theta, theta_rate, M1, M2, M3,
            )  # fmt: skip

        return sheet

    def _drive(self) -> Callable[[float, float], tuple[float, float, float]]:
        """Drive side of joint 1: angle, rate, and acceleration at γ̈ = 0, from γ and γ̇."""
        tau = self.machine.reduction
        waves = []
        ripple, error = self.effects.get("drive.speed_ripple"), self.effects.get("drive.transmission_error")
        if ripple:
            waves.append((tau * ripple.depth / ripple.order, ripple.order, ripple.phase))
        if error:
            waves.append((error.amplitude, error.order, error.phase))
        if not waves:
            return lambda gamma, gamma_rate: (tau * gamma, tau * gamma_rate, 0.0)

        def drive(gamma: float, gamma_rate: float) -> tuple[float, float, float]:
            angle, rate, acc = tau * gamma, tau * gamma_rate, 0.0
            for amplitude, order, phase in waves:
                sine, cosine = math.sin(order * gamma + phase), math.cos(order * gamma + phase)
                angle += amplitude * sine
                rate += amplitude * order * gamma_rate * cosine
                acc -= amplitude * (order * gamma_rate) ** 2 * sine
            return angle, rate, acc

        return drive

    def _mesh(self) -> Callable[[float], float]:
        """Factor on M1 from γ."""
        mesh = self.effects.get("drive.mesh_stiffness")
        if mesh is None:
            return lambda gamma: 1.0
        return lambda gamma: 1.0 + mesh.depth * math.cos(mesh.order * gamma + mesh.phase)

    def _slip(self) -> Callable[[float, float], float]:
        """γ̈ from γ̇ and the torque that the input joint takes from the motor's shaft."""
        slip = self.effects.get("drive.slip")
        if slip is None:
            return lambda gamma_rate, taken: 0.0
        command, J_m = self.operating_point.motor_speed, self.machine.motor_inertia
        return lambda gamma_rate, taken: ((command - gamma_rate) / slip.compliance - taken) / J_m

    def _load(self, stretch: Stretch) -> Load:
        """All that opposes the table beside joint 2 [N m]."""
        constant = self.operating_point.load_torque
        terms: list[Load] = []
        for name, effect in self.effects.items():
            if name == "friction.coulomb":
                terms.append(lambda a, p, v, d, r, e=effect: e.torque * _sign(v, e.smoothing))
            elif name == "friction.viscous":
                terms.append(lambda a, p, v, d, r, e=effect: e.coefficient * v)
            elif name == "friction.stribeck":
                terms.append(
                    lambda a, p, v, d, r, e=effect: e.torque / (1.0 + (v / e.speed) ** 2) * _sign(v, e.smoothing)
                )
            elif name == "load.imbalance":
                terms.append(lambda a, p, v, d, r, e=effect: e.torque * math.sin(p + e.phase))
            elif name == "load.process":
                terms.append(lambda a, p, v, d, r, e=effect: e.torque * stretch.process(a))
        if (table := table_of(self.effects, moves=False)) is not None:
            places, spline = [_VARIABLES.index(name) for name in table.over], spline_of(table)
            terms.append(lambda *at: spline(*(at[place] for place in places)))
        return lambda *at: constant + sum(term(*at) for term in terms)


def _sign(rate: float, smoothing: float) -> float:
    s = rate / smoothing
    return s / math.sqrt(1.0 + s * s)
