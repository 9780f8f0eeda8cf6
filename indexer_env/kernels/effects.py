"""Scalar equations of the model's extensions. Names, units, ranges and sources stand with the effect classes
(indexer_env/effects); here stands the arithmetic alone, once, for CPU and GPU alike.
"""

from __future__ import annotations

import math

import numpy as np

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
def knot_weight(u):
    """Weight of one coefficient of a uniform cubic B-spline, u its knot's distance from the place, and its first two
    derivatives by u: (max(2-|u|, 0)³ - 4 max(1-|u|, 0)³)/6 (de Boor, chapter X)."""
    far, near = max(2.0 - abs(u), 0.0), max(1.0 - abs(u), 0.0)
    slope = 0.5 * (4.0 * near * near - far * far)
    weight = (far * far * far - 4.0 * near * near * near) * (1.0 / 6.0)
    return weight, (slope if u > 0.0 else -slope), far - 4.0 * near


@scalar
def spline_cell(x, first, per, count, closed):
    """Number of the first of the four coefficients that count at x, and the share of the way from the second one's knot
    to the third's; beyond its ends a table that is not closed is held. A state that is not finite gets a number, too,
    as it becomes an index."""
    cells = count - 3.0 * (1.0 - closed)
    place = first + per * x
    if closed != 0.0:
        place -= cells * math.floor(place / cells)
    place = min(max(0.0, place), cells)
    cell = min(float(math.floor(place)), cells - 1.0)
    return cell, place - cell


@scalar
def tabulated(w, row, step, x, y):
    """Value of a tensor product of two uniform cubic splines at (x, y), and its first two derivatives by x.

    Its numbers stand in w from `row` on, `step` apart: of x and of y the place of 0, places in a unit, number of
    coefficients, whether it is closed; the distance of two rows of coefficients, 0 for a table over x alone; these.
    """
    count_1, count_2 = w[row + np.uint64(2) * step], w[row + np.uint64(6) * step]
    per, stride = w[row + step], w[row + np.uint64(8) * step]
    cell_1, share_1 = spline_cell(x, w[row], per, count_1, w[row + np.uint64(3) * step])
    cell_2, share_2 = spline_cell(
        y, w[row + np.uint64(4) * step], w[row + np.uint64(5) * step], count_2, w[row + np.uint64(7) * step]
    )
    value, slope, bend = 0.0, 0.0, 0.0
    for j in range(4):
        column, across = cell_1 + j, 0.0
        column -= count_1 if column >= count_1 else 0.0
        for k in range(4):
            line = cell_2 + k
            line -= count_2 if line >= count_2 else 0.0
            weight, _, _ = knot_weight(share_2 + 1.0 - k)
            across += weight * w[row + np.uint64(9 + int(column + stride * line)) * step]
        weight, first, second = knot_weight(share_1 + 1.0 - j)
        value, slope, bend = value + weight * across, slope + first * across, bend + second * across
    return value, per * slope, per * per * bend


@scalar
def slip_acceleration(command, rate, compliance, reaction, inertia):
    """Induction motor near its synchronous speed: J_m γ̈ = (ω_s - γ̇)/c - reaction, c the slope [rad/(s N m)]."""
    return ((command - rate) / compliance - reaction) / inertia
