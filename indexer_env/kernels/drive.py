"""What effects do on the drive side of joint 1: what ripples on the reducer's output, and the factor of its mesh."""

from __future__ import annotations

from .compiling import lanes, outlined
from .effects import harmonic, mesh_factor
from .interpolation import hermite, ramp, slope, value
from .layout import *

RIPPLES = USES_RIPPLE | USES_TRANSMISSION
"""Effects that ripple on the reducer's output."""


@lanes
def ripples(w, low, high, features, angle):
    """What ripples on the reducer's output at the motors' present angle: into row `angle` and the two behind it, for
    rate and acceleration."""
    for i in range(low, high):
        w[angle + i], w[angle + LANES + i], w[angle + TWO * LANES + i] = 0.0, 0.0, 0.0
    if features & USES_RIPPLE:
        add_harmonic(w, low, high, RIPPLE_AMPLITUDE, RIPPLE_ORDER, RIPPLE_PHASE, angle)
    if features & USES_TRANSMISSION:
        add_harmonic(w, low, high, TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER, TRANSMISSION_PHASE, angle)


@lanes
def add_harmonic(w, low, high, amplitude, order, phase, row):
    for i in range(low, high):
        angle, rate, acceleration = harmonic(
            w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i], w[amplitude + i], w[order + i], w[phase + i]
        )
        w[row + i] += angle
        w[row + LANES + i] += rate
        w[row + TWO * LANES + i] += acceleration


@lanes
def lever(w, low, high, features, row):
    """Derivative of the drive side's angle by the motor's, into a row: the ratio, and what ripples on it."""
    for i in range(low, high):
        w[row + i] = w[REDUCTION + i]
    if features & USES_RIPPLE:
        add_slope(w, low, high, RIPPLE_AMPLITUDE, RIPPLE_ORDER, RIPPLE_PHASE, row)
    if features & USES_TRANSMISSION:
        add_slope(w, low, high, TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER, TRANSMISSION_PHASE, row)


@lanes
def add_slope(w, low, high, amplitude, order, phase, row):
    for i in range(low, high):
        _, slope, _ = harmonic(w[MOTOR + i], 1.0, 0.0, w[amplitude + i], w[order + i], w[phase + i])
        w[row + i] += slope


@lanes
def mesh(w, low, high):
    """The factor of the reducer's mesh on its torque."""
    for i in range(low, high):
        w[MESH_FACTOR + i] = mesh_factor(w[MOTOR + i], w[MESH_DEPTH + i], w[MESH_ORDER + i], w[MESH_PHASE + i])


@outlined
def begin_ripples(w, high, features):
    """Keep what ripples on the drives of lanes 0 … high-1 at the step's start, and work out what does at its end, to
    which a motor that does not slip comes whatever its load."""
    for i in range(high):
        w[DRIVE_0 + i], w[DRIVE_RATE_0 + i] = w[DRIVE_EXTRA + i], w[DRIVE_RATE_EXTRA + i]
        w[DRIVE_ACC_0 + i] = w[DRIVE_ACC_EXTRA + i]
        w[MOTOR + i], w[MOTOR_RATE + i] = ramp(
            w[STEP + i], w[MOTOR_0 + i], w[MOTOR_RATE_0 + i], w[MOTOR_ACCELERATION + i]
        )
    ripples(w, FIRST_LANE, high, features, DRIVE_1)


@lanes
def ripple_between(w, high, share):
    """What ripples on the drive after a share of the step: at its end as worked out, before from the quintic through
    angles, rates and accelerations at both ends, whose error is of order h⁶ in the angle."""
    for i in range(high):
        if share == 1.0:
            w[DRIVE_EXTRA + i], w[DRIVE_RATE_EXTRA + i] = w[DRIVE_1 + i], w[DRIVE_RATE_1 + i]
            w[DRIVE_ACC_EXTRA + i] = w[DRIVE_ACC_1 + i]
        else:
            h, y0 = w[STEP + i], w[DRIVE_0 + i]
            frequency = 1.0 / h if h > 0.0 else 0.0
            c1, c2, c3, c4, c5 = hermite(
                h, y0, w[DRIVE_RATE_0 + i], w[DRIVE_ACC_0 + i], w[DRIVE_1 + i], w[DRIVE_RATE_1 + i], w[DRIVE_ACC_1 + i]
            )
            w[DRIVE_EXTRA + i] = value(share, y0, c1, c2, c3, c4, c5)
            w[DRIVE_RATE_EXTRA + i] = frequency * slope(share, c1, c2, c3, c4, c5)
