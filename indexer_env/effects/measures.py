"""The machine's own measures of torque, angle, speed and time, in which effects state where a search begins.

With the motion law's largest |β'| and |β''| over a cam turn and ω the cam's rate:

    torque T = J_t |β''| ω²      speed = |β'| ω      deflection = T/k2
    input deflection = T |β'|/k1 + |β''| (ω/ω_m)²/|β'|: what bends joint 1 as the motion does, and what shakes the table
    as much once per motor turn, at ω_m
    motion = the cam phase [turns] at which the table comes to rest

Inertias, stiffnesses, dampings and loads times one factor change T, k1 and k2 alike, and nothing that is measured in
them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from indexer_env.law_table import law_table

if TYPE_CHECKING:
    from indexer_env.machine import Machine

_POINTS = 720

MEASURES = (
    "-", "torque", "torque per speed", "speed", "deflection", "input deflection", "ripple", "slip", "base compliance",
    "cubic stiffness", "period", "period squared", "acceleration", "acceleration rate", "cam rate", "motion",
)  # fmt: skip


def measures(machine: Machine, motor_speed: float, radius: float | None = None) -> Mapping[str, float]:
    """SI value of each of MEASURES for a machine run at `motor_speed` [rad/s]; acceleration is the sensor's, in rad/s²,
    or in m/s² at `radius` [m]."""
    phase = np.linspace(0.0, 2.0 * math.pi, _POINTS, endpoint=False)
    _, slope, curvature = machine.motion_law.evaluate(phase, machine.stations, machine.motion_share)[:3]
    cam = machine.reduction * motor_speed
    slope, acceleration = float(np.abs(slope).max()), float(np.abs(curvature).max()) * cam**2
    torque, speed = machine.table_inertia * acceleration, slope * cam
    deflection = torque / machine.output_joint.stiffness
    at_input = torque * slope / machine.input_joint.stiffness + acceleration / (slope * motor_speed**2)
    period = math.sqrt(machine.table_inertia / machine.output_joint.stiffness)
    seen = acceleration * (1.0 if radius is None else radius)
    values = (
        1.0, torque, torque / speed, speed, deflection, at_input, at_input / machine.reduction,
        motor_speed / (machine.reduction * torque * slope), 1.0 / machine.output_joint.stiffness,
        machine.output_joint.stiffness / deflection**2, period, period**2, seen, seen * cam / (2.0 * math.pi), cam,
        law_table(machine.motion_law, machine.stations, machine.motion_share).motions[-1][1],
    )  # fmt: skip
    return dict(zip(MEASURES, values, strict=True))
