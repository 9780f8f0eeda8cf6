"""Numbers of an indexing machine as they are said in the shop: the one place that turns SI into degrees at the motor
shaft, per cent of looseness, minutes of arc and Hz."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from discrepancy.subjects.base import bounded
from indexer_env.faults import LOOSE_HOUSING_HZ
from indexer_env.machine import Machine
from indexer_env.units import DEGREE, RPM
from indexer_records.acceleration_units import STANDARD_GRAVITY

_MINUTE = DEGREE / 60.0

Unit = Callable[[float, Machine], float]


def _times(factor: float) -> Unit:
    return lambda value, machine: factor * value


def _motor_degrees(value: float, machine: Machine) -> float:
    return value * machine.reduction_ratio / DEGREE


def _looseness(value: float, machine: Machine) -> float:
    """Share of the compliance of fully loosened screws, as `indexer_env.faults` defines it [%]."""
    inertia = machine.follower_inertia + machine.housing_inertia
    return 100.0 * value * inertia * (2.0 * math.pi * LOOSE_HOUSING_HZ) ** 2


def _cutoff(value: float, machine: Machine) -> float:
    return math.inf if value <= 0.0 else 1.0 / (2.0 * math.pi * value)


def _resonance(value: float, machine: Machine) -> float:
    return math.inf if value <= 0.0 else 1.0 / (2.0 * math.pi * math.sqrt(value))


SHOP: dict[str, tuple[Unit, str]] = {
    "input_joint.backlash": (_motor_degrees, "° at the motor shaft"),
    "input.backlash.backlash": (_motor_degrees, "° at the motor shaft"),
    "output.backlash.backlash": (_times(1.0 / _MINUTE), "′ at the table"),
    "base.looseness.compliance": (_looseness, "% loose"),
    "base.looseness.backlash": (_times(1.0 / _MINUTE), "′ at the housing"),
    "cam.profile_error.height": (_times(1.0 / _MINUTE), "′ at the follower"),
    "cam.profile_error.centre": (_times(360.0), "° of the cam"),
    "cam.profile_error.half_width": (_times(360.0), "° of the cam"),
    "cam.station_spacing.error": (_times(1.0 / _MINUTE), "′ at the table"),
    "drive.slip.compliance": (_times(1.0 / RPM), "rpm per N m"),
    "drive.speed_ripple.depth": (_times(100.0), "% of the speed"),
    "drive.speed_ripple.phase": (_times(1.0 / DEGREE), "°"),
    "drive.transmission_error.amplitude": (_times(1.0 / _MINUTE), "′ at the cam shaft"),
    "drive.transmission_error.phase": (_times(1.0 / DEGREE), "°"),
    "drive.mesh_stiffness.depth": (_times(100.0), "% of the stiffness"),
    "drive.mesh_stiffness.phase": (_times(1.0 / DEGREE), "°"),
    "drive.mesh_friction.loss": (_times(100.0), "% of the torque"),
    "load.imbalance.torque": (_times(1.0 / STANDARD_GRAVITY), "kg m"),
    "load.imbalance.phase": (_times(1.0 / DEGREE), "°"),
    "load.process.centre": (_times(360.0), "° of the cam"),
    "load.process.half_width": (_times(360.0), "° of the cam"),
    "roller.crack.stiffness_loss": (_times(100.0), "% of the stiffness lost"),
    "roller.crack_single.stiffness_loss": (_times(100.0), "% of the stiffness lost"),
    "sensor.gain.error": (_times(100.0), "% of the reading"),
    "sensor.highpass.corner": (_times(0.5 / math.pi), "Hz cut-off"),
    "sensor.lowpass.time_constant": (_cutoff, "Hz cut-off"),
    "sensor.bracket_resonance.inverse_square": (_resonance, "Hz"),
    "sensor.mains_hum.phase": (_times(1.0 / DEGREE), "°"),
}
"""How a parameter is said in the shop, and in which unit; the others are said in SI."""


def in_the_shop(name: str, values: Sequence[float], machine: Machine) -> str:
    """A value, low and high of a parameter in the shop's unit, "0.34 (0.31 to 0.37) ° at the motor shaft"; "" where the
    SI unit is the shop's."""
    if name not in SHOP:
        return ""
    turned, unit = SHOP[name]
    value, low, high = (turned(one, machine) for one in values)
    low, high = min(low, high), max(low, high)
    return f"{bounded(value, 3)} ({bounded(low, 3)} to {bounded(high, 3)}) {unit}"
