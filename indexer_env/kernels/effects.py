"""Scalar equations of the model's extensions. Names, units, ranges and sources stand with the effect classes
(indexer_env/effects); here stands the arithmetic alone, once, for CPU and GPU alike.
"""

from __future__ import annotations

import math

from indexer_env.kernels.compiling import scalar


@scalar
def smooth_sign(rate, smoothing):
    """Sign of a rate, smooth within `smoothing` [rad/s]: s/√(1+s²), s = rate/smoothing."""
    s = rate / smoothing
    return s / math.sqrt(1.0 + s * s)


@scalar
def stribeck_share(rate, speed):
    """Share of the extra breakaway torque left at `rate`: 1/(1 + (rate/speed)²) (Hess and Soom 1990)."""
    s = rate / speed
    return 1.0 / (1.0 + s * s)


@scalar
def friction_torque(rate, coulomb, coulomb_speed, viscous, stribeck, stribeck_speed, stribeck_smoothing):
    """Friction that opposes the table [N m]: Coulomb, viscous and Stribeck parts added."""
    breakaway = stribeck * stribeck_share(rate, stribeck_speed)
    return (
        coulomb * smooth_sign(rate, coulomb_speed) + viscous * rate + breakaway * smooth_sign(rate, stribeck_smoothing)
    )


@scalar
def bump(phase, centre, half_width):
    """A bump of height 1 at a cam phase [turns]: (1-y²)⁴ for |y| < 1, y = (phase-centre)/half_width, and its first two
    derivatives by y. Three derivatives are continuous at its ends. The nearest of the periodic images counts.
    """
    offset = phase - centre
    offset -= math.floor(offset + 0.5)
    y = offset / half_width
    q = max(1.0 - y * y, 0.0)
    return q * q * q * q, -8.0 * y * q * q * q, q * q * (56.0 * y * y - 8.0)


@scalar
def harmonic(angle, rate, acceleration, amplitude, order, phase):
    """Kinematic harmonic of a shaft: amplitude·sin(order·angle + phase) [rad] and its first two time derivatives."""
    sine, cosine = math.sin(order * angle + phase), math.cos(order * angle + phase)
    first = amplitude * order * rate * cosine
    second = amplitude * order * (acceleration * cosine - order * rate * rate * sine)
    return amplitude * sine, first, second


@scalar
def mesh_factor(angle, depth, order, phase):
    """Factor on the reducer's torque as teeth come in and out of mesh: 1 + depth·cos(order·angle + phase)."""
    return 1.0 + depth * math.cos(order * angle + phase)


@scalar
def slip_acceleration(command, rate, compliance, reaction, inertia):
    """Induction motor near its synchronous speed: J_m γ̈ = (ω_s - γ̇)/c - reaction, c the slope [rad/(s N m)]."""
    return ((command - rate) / compliance - reaction) / inertia
