"""The fault table: which effect of the library each fault is, how large it is drawn, and how the shop tells its size.

A size is a share t of the fault's largest, in [0, 1]; the effect's parameter is linear in it. What else an effect needs
(a phase, a station) is drawn.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from indexer_env.checks import did_you_mean
from indexer_env.effects import EFFECTS, SensorEffect
from indexer_env.errors import refuse
from indexer_env.faults import LOOSE_HOUSING_HZ
from indexer_env.machine import Machine
from indexer_env.operating_point import REFERENCE_MOTOR_SPEED, OperatingPoint
from indexer_env.sensors import Sensor

_TURN = 2.0 * math.pi

_MARGIN, _SLIGHTEST = 1.1, 0.01
"""What the healthy machine has of an effect counts a tenth more, as it is not known exactly; room that is always left,
as a share of what the effect can be."""

_ROUNDED = 5e-3
"""Relative error of a largest size that is written with three digits."""


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes
    ----------
    name, words : str
        As keys and tables have it, and as a sentence has it.
    effect, parameter : str
        The effect of `indexer_env.effects` that it is, and the parameter that says how bad it is.
    reach : callable
        (Machine, motor speed [rad/s]) -> that parameter's value at t = 1 [SI].
    unit : str
        Of the shop.
    shop : callable
        (value [SI], Machine) -> the value that the shop reads.
    others : mapping
        Laws of the effect's other parameters, as `datagen` reads them.
    signed : bool
        Whether the parameter may have either sign.
    most : float
        The size t beyond which there is none: no more than all of the stiffness is lost, no screw is more than loose.
    motor_speed : float
        The fastest at which the machine is diagnosed [rad/s]: torques are measured by what the index asks there.
    before : float
        What the healthy sensor has of the parameter [SI]; the fault comes on top, and the shop reads both.
    """

    name: str
    words: str
    effect: str
    parameter: str
    reach: Callable[[Machine, float], float]
    unit: str
    shop: Callable[[float, Machine], float]
    others: Mapping[str, Any] = field(default_factory=dict)
    signed: bool = False
    most: float = math.inf
    motor_speed: float = REFERENCE_MOTOR_SPEED
    before: float = 0.0

    @property
    def simulated(self) -> float:
        """The largest size t that is simulated and taught."""
        return min(1.0, self.most)

    def largest(self, machine: Machine) -> float:
        """The effect's parameter at t = 1 [SI]."""
        return self.reach(machine, self.motor_speed)

    def possible(self, share: float) -> float:
        """The size t next to this one that there can be."""
        return min(share if self.signed else max(0.0, share), self.most)

    def value(self, share: float, machine: Machine) -> float:
        """What a size t adds to the effect's parameter [SI]."""
        return share * self.largest(machine)

    def share(self, value: float, machine: Machine) -> float:
        """Size t that adds a value to the parameter [SI]."""
        return value / self.largest(machine)

    def told(self, share: float, machine: Machine) -> float:
        """A size t in the shop's unit."""
        return self.shop(self.before + self.value(share, machine), machine)


def number_of(value: float) -> str:
    """A size in the shop's unit, three digits; what is without limit, such as the resonance of a rigid bracket, is over
    1000."""
    return f"{float(f'{value:.3g}'):g}" if math.isfinite(value) else "over 1000"


def peak_torque(machine: Machine, motor_speed: float = REFERENCE_MOTOR_SPEED) -> float:
    """Largest torque that the index asks of the table at a motor speed [rad/s], J_t h C_a/T² [N m]."""
    duration = machine.turn_duration(OperatingPoint(motor_speed)) / machine.stations * machine.motion_share
    law = machine.motion_law
    steps = np.linspace(0.0, _TURN * machine.motion_share, 401)
    bent = float(np.abs(law.evaluate(steps, machine.stations, machine.motion_share)[2]).max())
    rate = _TURN * machine.motion_share / duration
    return machine.table_inertia * bent * rate**2


def _full_compliance(machine: Machine) -> float:
    inertia = machine.follower_inertia + machine.housing_inertia
    return 1.0 / (inertia * (_TURN * LOOSE_HOUSING_HZ) ** 2)


def _hertz(inverse_square: float, _: Machine) -> float:
    return math.inf if inverse_square <= 0.0 else 1.0 / (_TURN * math.sqrt(inverse_square))


def _percent(value: float, _: Machine) -> float:
    return 100.0 * value


def _itself(value: float, _: Machine) -> float:
    return value


_PHASE = {"phase": {"uniform": [0.0, _TURN]}}

FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("crack", "cracked rollers", "roller.crack", "stiffness_loss", lambda m, _: 0.6,
              "% of stiffness lost", _percent, most=1.0 / 0.6),
        Fault("crack_single", "one cracked roller", "roller.crack_single", "stiffness_loss", lambda m, _: 0.8,
              "% of stiffness lost", _percent, most=1.0 / 0.8),
        Fault("reducer_play", "play in the reducer", "input.backlash", "backlash",
              lambda m, _: math.radians(20.0) * m.reduction, "° at the motor shaft",
              lambda v, m: math.degrees(v / m.reduction)),
        Fault("follower_play", "play of the followers", "output.backlash", "backlash", lambda m, _: 5e-4,
              "arc minutes at the table", lambda v, m: 60.0 * math.degrees(v)),
        Fault("loose_base", "loose base screws", "base.looseness", "compliance", lambda m, _: _full_compliance(m),
              "% loose", lambda v, m: 100.0 * v / _full_compliance(m), most=1.0),
        Fault("friction", "growing friction", "friction.coulomb", "torque", lambda m, w: 0.5 * peak_torque(m, w),
              "N m", _itself),
        Fault("imbalance", "imbalance", "load.imbalance", "torque", lambda m, w: 2.0 * peak_torque(m, w),
              "N m", _itself, _PHASE),
        Fault("mesh_wear", "worn mesh", "drive.mesh_stiffness", "depth", lambda m, _: 0.35,
              "% of stiffness", _percent, _PHASE),
        Fault("sensor_loose", "loose sensor", "sensor.bracket_resonance", "inverse_square",
              lambda m, _: 1.0 / (_TURN * 25.0) ** 2, "Hz bracket resonance", _hertz,
              {"damping": {"uniform": [0.015, 0.06]}}),
        Fault("sensor_gain", "wrong gain", "sensor.gain", "error", lambda m, _: 0.3, "%", _percent, signed=True),
    )
}  # fmt: skip
"""All faults that the library can grade. The largest sizes are those of a machine that nobody would call sound: 60 % of
the stiffness lost, the paper's 20° of play, fully loosened screws, friction of half the index's own torque."""


BY_SPEED = ("friction", "imbalance")
"""Faults whose largest size follows from the machine's inertia and its fastest speed."""


def chosen(
    names: Sequence[str], motor_speed: float = REFERENCE_MOTOR_SPEED, sensor: Sensor | None = None,
    machine: Machine | None = None,
) -> tuple[Fault, ...]:  # fmt: skip
    """The faults of these names, of a machine that is diagnosed up to a motor speed [rad/s] by a sensor; none grows
    beyond what an effect can be that the healthy machine has a part of already."""
    if not isinstance(names, list | tuple) or not names:
        raise refuse("twin", "faults", "a list of one fault or more", names, "write it as [crack,friction]")
    for name in names:
        if name not in FAULTS:
            raise refuse("twin", "faults", "some of " + ", ".join(FAULTS), name, did_you_mean(name, FAULTS))
    found = (
        dataclasses.replace(FAULTS[name], motor_speed=motor_speed, before=_before(FAULTS[name], sensor))
        for name in dict.fromkeys(names)
    )
    return tuple(found) if machine is None else tuple(
        dataclasses.replace(fault, most=_room(fault, machine)) for fault in found
    )  # fmt: skip


def _room(fault: Fault, machine: Machine) -> float:
    """The largest size t beside what the healthy machine has of the effect."""
    there = next((getattr(e, fault.parameter) for e in machine.effects if e.name == fault.effect), 0.0)
    highest = highest_of(fault)
    if not there or highest == math.inf:
        return fault.most
    return min(fault.most, max(highest - _MARGIN * there, _SLIGHTEST * highest) / fault.largest(machine))


def highest_of(fault: Fault) -> float:
    """What the effect's parameter may be at most [SI]."""
    (own,) = (f for f in dataclasses.fields(EFFECTS[fault.effect]) if f.name == fault.parameter)
    high = own.metadata["high"]
    if high is None:
        return math.inf
    return math.nextafter(high, -math.inf) if own.metadata["high_open"] else high


def _before(fault: Fault, sensor: Sensor | None) -> float:
    kind = EFFECTS[fault.effect]
    there = kind.of_sensor(sensor) if sensor is not None and issubclass(kind, SensorEffect) else None
    return 0.0 if there is None else float(getattr(there, fault.parameter))


def check_matters(matters: Mapping[str, float] | None, faults: Sequence[Fault], machine: Machine) -> None:
    """Refuse a smallest size that matters beyond the largest size of its fault."""
    for fault in faults:
        told, largest = (matters or {}).get(fault.name), fault.told(1.0, machine)
        if told is None:
            continue
        falls = largest < fault.told(0.5, machine)
        if (told < largest * (1.0 - _ROUNDED)) if falls else (told > largest * (1.0 + _ROUNDED)):
            rule = f"{number_of(largest)} {fault.unit} or {'more' if falls else 'less'}, the largest fault simulated"
            raise refuse("twin.matters", fault.name, rule, told, "state a smaller fault")


def by_effect(faults: Sequence[Fault]) -> dict[str, Fault]:
    """The faults by the effect that each one is."""
    return {fault.effect: fault for fault in faults}


def share_of(fault: Fault, told: float, machine: Machine) -> float:
    """Size t of a value in the shop's unit, by bisection: what the shop reads is monotonic in t."""
    low, high = 0.0, 1.0
    rising = fault.told(1.0, machine) > fault.told(0.5, machine)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = fault.told(middle, machine) < told if rising else fault.told(middle, machine) > told
        low, high = (middle, high) if below else (low, middle)
    return high
