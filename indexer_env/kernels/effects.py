"""Scalar equations of the model's extensions. Names, units, ranges and sources stand with the effect classes
(indexer_env/effects); here stands the arithmetic alone, once, for CPU and GPU alike.
"""

from __future__ import annotations

import math

from .compiling import scalar
from .trigonometry import sine_alone, sine_and_cosine


@scalar
def coulomb_torque(rate, torque, smoothing):
    """Dry friction [N m]: torque·s/√(1+s²), s = rate/smoothing, a sign that is smooth within `smoothing` [rad/s]."""
    return torque * rate / math.sqrt(smoothing * smoothing + rate * rate)


@scalar
def stribeck_torque(rate, torque, speed, smoothing):
    """Breakaway torque above Coulomb's [N m], which fades as 1/(1 + (rate/speed)²) (Hess and Soom 1990)."""
    fading = speed * speed
    return torque * fading * rate / ((fading + rate * rate) * math.sqrt(smoothing * smoothing + rate * rate))


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
    sine, cosine = sine_and_cosine(order * angle + phase)
    first = amplitude * order * rate * cosine
    second = amplitude * order * (acceleration * cosine - order * rate * rate * sine)
    return amplitude * sine, first, second


@scalar
def mesh_factor(angle, depth, order, phase):
    """Factor on the reducer's torque as teeth come in and out of mesh: 1 + depth·cos(order·angle + phase)."""
    return 1.0 + depth * sine_alone(order * angle + (phase + 0.5 * math.pi))


@scalar
def imbalance_torque(angle, torque, phase):
    """Moment of an eccentric weight on a tilted table [N m]: torque·sin(angle + phase)."""
    return torque * sine_alone(angle + phase)


@scalar
def knot_weight(place, knot, closed):
    """Weight of one coefficient of a uniform cubic B-spline, u its knot's distance from the place:
    (max(2-|u|, 0)³ - 4 max(1-|u|, 0)³)/6. Of a closed one the nearest of the images that are nine knots apart counts.
    """
    u = place - knot
    u = abs(u - closed * 9.0 * math.floor(u / 9.0 + 0.5))
    far, near = max(2.0 - u, 0.0), max(1.0 - u, 0.0)
    return (far * far * far - 4.0 * near * near * near) * (1.0 / 6.0)


@scalar
def spline_place(x, first, per, closed):
    """Place among the knots of a variable's value: held at the first or the last one where the table ends."""
    place = first + per * x
    held = min(max(place, 1.0), 9.0)
    return held + closed * (place - held)


@scalar
def slip_acceleration(command, rate, compliance, reaction, inertia):
    """Induction motor near its synchronous speed: J_m γ̈ = (ω_s - γ̇)/c - reaction, c the slope [rad/(s N m)]."""
    return ((command - rate) / compliance - reaction) / inertia
