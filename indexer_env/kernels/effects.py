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
def mesh_share(region, friction):
    """Torque at the cam over that at the motor, of teeth that rub by `friction` times the cam's torque: below 1 where
    the motor drives the cam, above where the cam drives the motor."""
    return 1.0 / (1.0 + friction * region)


@scalar
def imbalance_torque(angle, torque, phase):
    """Moment of an eccentric weight on a tilted table [N m]: torque·sin(angle + phase)."""
    return torque * sine_alone(angle + phase)


@scalar
def spline_weights(t):
    """Weights of the four coefficients of a uniform cubic B-spline that count at a share t of the way between two
    knots (de Boor, chapter X)."""
    s = 1.0 - t
    outer, inner = 1.0 / 6.0, 2.0 / 3.0
    return outer * s * s * s, inner - t * t * (1.0 - 0.5 * t), inner - s * s * (1.0 - 0.5 * s), outer * t * t * t


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
    cell = min(math.floor(place), int(cells) - 1)
    return cell, place - cell


@scalar
def wrapped(number, count):
    """Number of a coefficient; behind the last one of a closed spline comes its first."""
    return number - count if number >= count else number


@scalar
def across(w, row, step, stride, line, count, share):
    """Value along y of a column of coefficients that begins at a row; of a table over x alone, its one coefficient."""
    if stride == 0:
        return w[row]
    w0, w1, w2, w3 = spline_weights(share)
    return (
        w0 * w[row + np.uint64(stride * line) * step]
        + w1 * w[row + np.uint64(stride * wrapped(line + 1, count)) * step]
        + w2 * w[row + np.uint64(stride * wrapped(line + 2, count)) * step]
        + w3 * w[row + np.uint64(stride * wrapped(line + 3, count)) * step]
    )


@scalar
def tabulated(w, row, step, x, y):
    """Value of a tensor product of two uniform cubic splines at (x, y), and its first two derivatives by x.

    Its numbers stand in w from `row` on, `step` apart: of x and of y the place of 0, places in a unit, number of
    coefficients, whether it is closed; the distance of two lines of coefficients, 0 for a table over x alone; these.
    """
    per, count_1, count_2 = w[row + step], w[row + np.uint64(2) * step], w[row + np.uint64(6) * step]
    column, t = spline_cell(x, w[row], per, count_1, w[row + np.uint64(3) * step])
    stride, line, share = int(w[row + np.uint64(8) * step]), 0, 0.0
    if stride != 0:
        line, share = spline_cell(
            y, w[row + np.uint64(4) * step], w[row + np.uint64(5) * step], count_2, w[row + np.uint64(7) * step]
        )
    n, m, first = int(count_1), int(count_2), row + np.uint64(9) * step
    c0 = across(w, first + np.uint64(column) * step, step, stride, line, m, share)
    c1 = across(w, first + np.uint64(wrapped(column + 1, n)) * step, step, stride, line, m, share)
    c2 = across(w, first + np.uint64(wrapped(column + 2, n)) * step, step, stride, line, m, share)
    c3 = across(w, first + np.uint64(wrapped(column + 3, n)) * step, step, stride, line, m, share)
    w0, w1, w2, w3 = spline_weights(t)
    s = 1.0 - t
    slope = 0.5 * (t * t * c3 - s * s * c0) + t * (1.5 * t - 2.0) * c1 - s * (1.5 * s - 2.0) * c2
    bend = s * c0 + (3.0 * t - 2.0) * c1 + (3.0 * s - 2.0) * c2 + t * c3
    return w0 * c0 + w1 * c1 + w2 * c2 + w3 * c3, per * slope, per * per * bend


@scalar
def slip_acceleration(command, rate, compliance, reaction, inertia):
    """Induction motor near its synchronous speed: J_m γ̈ = (ω_s - γ̇)/c - reaction, c the slope [rad/(s N m)]."""
    return ((command - rate) / compliance - reaction) / inertia
