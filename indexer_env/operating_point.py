"""The operating point: what the machine is asked to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from indexer_env.checks import as_python, check_number
from indexer_env.units import RPM

REFERENCE_MOTOR_SPEED = 1500.0 * RPM
"""Nominal speed of the paper's four-pole induction motor, 1500 rpm, in rad/s (section 2)."""

REFERENCE_LOAD_TORQUE = 2.0
"""Load torque of the reference machine, N m (docs/explanation/physics.md, section The reference machine)."""


LARGEST_START = 1e6
"""rad, either way: a double still resolves a cam angle there to 1e-10 rad."""

START_ANGLE: dict[str, Any] = {"low": -LARGEST_START, "high": LARGEST_START, "unit": "rad"}
"""The start angle's range, as `check_number` takes it."""


@dataclass(frozen=True)
class OperatingPoint:
    """Speed, load and start of one run.

    Attributes
    ----------
    motor_speed : float
        Commanded (no-slip) speed of the motor shaft [rad/s], > 0.
    load_torque : float
        T_L, torque that opposes the table's motion [N m]; a negative one drives it.
    start_angle : float
        Cam angle at t = 0 [rad], within ±1e6; the cam's motion phase begins at 0, its dwell at 2π·motion_share.
    """

    motor_speed: float = REFERENCE_MOTOR_SPEED
    load_torque: float = REFERENCE_LOAD_TORQUE
    start_angle: float = 0.0

    def __post_init__(self) -> None:
        check_number("OperatingPoint", "motor_speed", self.motor_speed, low=0.0, low_open=True, unit="rad/s")
        check_number("OperatingPoint", "load_torque", self.load_torque, unit="N m")
        check_number("OperatingPoint", "start_angle", self.start_angle, **START_ANGLE)
        as_python(self, "motor_speed", "load_torque", "start_angle")
