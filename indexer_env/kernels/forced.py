"""What forces the two oscillators of a dwell: the drive's harmonics at a steady speed, and the weight of an imbalance.

A harmonic D = A sin θ, θ̇ = Ω, drives the deflection δ1 by its D̈. With k, r the line of the joint, ω² = k/J_C and
ρ = r/J_C, one solution is

    x = P D + Q Ḋ,   P = Ω² (Ω² - ω²)/N,   Q = Ω² ρ/N,   N = (ω² - Ω²)² + (Ω ρ)²

and what is left over swings freely. An eccentric weight turns the table by T sin(φ + ψ). With x the deflection beyond
the offset of joint 2's line and φ0 the table's angle at x = 0, the constant T sin(φ0 + ψ) and, on a flank, the
stiffness g = T cos(φ0 + ψ) belong to the oscillator; what is left, T x²/2 or less, acts as two kicks, half of the
stride's each, at both ends of it (Strang splitting). In free flight, where it is T cos(φ0 + ψ) x, its change over the
stride t takes the table further by T cos(φ + ψ) φ̇ t³/(6 J_t).
"""

from __future__ import annotations

import math

from .compiling import lanes, outlined, scalar
from .drive import RIPPLES, ripples
from .effects import harmonic, imbalance_torque
from .interpolation import ramp
from .layout import *
from .trigonometry import sine_and_cosine

FORCES = RIPPLES | USES_IMBALANCE
"""Effects that force the oscillators of a dwell."""

_RESONANCE = 1e-6
"""Share of ω² + Ω² by which a harmonic must miss an undamped oscillator, as both parts of its motion grow without bound
there; nearer to it steps are taken."""


@scalar
def response(amplitude, omega, k, r, inertia):
    """(P, Q [s]) of a harmonic of frequency omega [rad/s] on a line (k, r); nothing where it is off."""
    square, forcing, loss = k / inertia, omega * omega, r / inertia
    apart = forcing - square
    bottom = apart * apart + forcing * loss * loss
    if amplitude == 0.0 or bottom == 0.0:
        return 0.0, 0.0
    return forcing * apart / bottom, forcing * loss / bottom


@scalar
def misses(amplitude, omega, k, r, inertia):
    """Whether a harmonic is off or misses the resonance of a line."""
    square, forcing, loss = k / inertia, omega * omega, r / inertia
    apart, total = forcing - square, _RESONANCE * (forcing + square)
    return amplitude == 0.0 or apart * apart + forcing * loss * loss > total * total


@scalar
def misses_both(w, i, k, r):
    """Whether both harmonics of lane i miss the resonance of a line of joint 1."""
    rate, inertia = w[MOTOR_RATE + i], w[J_CAM + i]
    ripple = misses(w[RIPPLE_AMPLITUDE + i], w[RIPPLE_ORDER + i] * rate, k, r, inertia)
    return ripple and misses(w[TRANSMISSION_AMPLITUDE + i], w[TRANSMISSION_ORDER + i] * rate, k, r, inertia)


@scalar
def part(w, i, motor, k, r, amplitude, order, phase):
    """Deflection, rate and forcing acceleration by one harmonic of lane i with its motor at an angle."""
    rate = w[MOTOR_RATE + i]
    p, q = response(w[amplitude + i], w[order + i] * rate, k, r, w[J_CAM + i])
    x, v, a = harmonic(motor, rate, 0.0, w[amplitude + i], w[order + i], w[phase + i])
    return p * x + q * v, p * v + q * a, a


@outlined
def forced(w, i, motor, k, r, features):
    """Deflection, rate and forcing acceleration of joint 1 by both harmonics of lane i with its motor at an angle."""
    x, v, a = 0.0, 0.0, 0.0
    if features & USES_RIPPLE:
        x, v, a = part(w, i, motor, k, r, RIPPLE_AMPLITUDE, RIPPLE_ORDER, RIPPLE_PHASE)
    if features & USES_TRANSMISSION:
        x2, v2, a2 = part(w, i, motor, k, r, TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER, TRANSMISSION_PHASE)
        x, v, a = x + x2, v + v2, a + a2
    return x, v, a


@outlined
def weight(w, i, offset, stiffness):
    """Torque [N m] of the imbalance at a line's offset, and its stiffness there, nothing in free flight."""
    if w[IMBALANCE_TORQUE + i] == 0.0:
        return 0.0, 0.0
    sine, cosine = sine_and_cosine(w[C_0 + i] + offset + w[IMBALANCE_PHASE + i])
    return w[IMBALANCE_TORQUE + i] * sine, (w[IMBALANCE_TORQUE + i] * cosine if stiffness > 0.0 else 0.0)


@outlined
def left_over(w, i, x, offset, torque, stiffness):
    """What the oscillator leaves of the imbalance's torque at a deflection x beyond the offset, over J_t [rad/s²]."""
    whole = imbalance_torque(x + offset + w[C_0 + i], w[IMBALANCE_TORQUE + i], w[IMBALANCE_PHASE + i])
    return (whole - torque - stiffness * x) / w[J_TABLE + i]


@scalar
def drift(w, i, t, table, rate, stiffness):
    """How far the change of the imbalance's torque takes lane i from an angle and a rate in a time of free flight."""
    slope = imbalance_torque(table, w[IMBALANCE_TORQUE + i], w[IMBALANCE_PHASE + i] + 0.5 * math.pi)
    free = 1.0 if stiffness == 0.0 else 0.0
    return free * (slope * rate * (t * t * t)) / (6.0 * w[J_TABLE + i])


@outlined
def use_forces(w, i, joint, features):
    """Take what forces lane i on the present line of joint 0 or 1, at its present state."""
    if joint == 0 and features & RIPPLES:
        k, r, rate, inertia = w[LINE_K_1 + i], w[LINE_R_1 + i], w[MOTOR_RATE + i], w[J_CAM + i]
        w[RIPPLE_P + i], w[RIPPLE_Q + i] = response(w[RIPPLE_AMPLITUDE + i], w[RIPPLE_ORDER + i] * rate, k, r, inertia)
        w[TRANSMISSION_P + i], w[TRANSMISSION_Q + i] = response(
            w[TRANSMISSION_AMPLITUDE + i], w[TRANSMISSION_ORDER + i] * rate, k, r, inertia
        )
        w[FORCED + i], w[FORCED_RATE + i], _ = forced(w, i, w[MOTOR + i], k, r, features)
    if joint == 1 and features & USES_IMBALANCE:
        offset = w[LINE_OFFSET_2 + i]
        w[WEIGHT + i], w[WEIGHT_STIFFNESS + i] = weight(w, i, offset, w[LINE_K_2 + i])
        acceleration = left_over(
            w, i, w[TABLE + i] - w[C_0 + i] - offset, offset, w[WEIGHT + i], w[WEIGHT_STIFFNESS + i]
        )
        w[KICK + i] = 0.5 * w[STRIDE_TIME + i] * acceleration
        w[DRIFT + i] = drift(w, i, w[STRIDE_TIME + i], w[TABLE + i], w[TABLE_RATE + i], w[LINE_K_2 + i])


@outlined
def begin_forced(w, high, features):
    """Take what is forced off the deflections of lanes that are about to stride, and their half kick off the rates."""
    if features & RIPPLES:
        for i in range(high):
            if w[STRIDE_TIME + i] > 0.0:
                w[DEFLECTION_1 + i] -= w[FORCED + i]
                w[DEFLECTION_RATE_1 + i] -= w[FORCED_RATE + i]
                w[DRIVE_EXTRA + i], w[DRIVE_RATE_EXTRA + i], w[DRIVE_ACC_EXTRA + i] = 0.0, 0.0, 0.0
                w[FORCED + i], w[FORCED_RATE + i] = 0.0, 0.0
    if features & USES_RIPPLE:
        go_with(w, high, RIPPLE_AMPLITUDE, RIPPLE_ORDER, RIPPLE_PHASE, RIPPLE_P)
    if features & USES_TRANSMISSION:
        go_with(w, high, TRANSMISSION_AMPLITUDE, TRANSMISSION_ORDER, TRANSMISSION_PHASE, TRANSMISSION_P)
    if features & USES_IMBALANCE:
        for i in range(high):
            if w[STRIDE_TIME + i] > 0.0:
                w[DEFLECTION_2 + i] -= w[DRIFT + i]
                w[DEFLECTION_RATE_2 + i] -= w[KICK + i]


@lanes
def go_with(w, high, amplitude, order, phase, share):
    """Add a harmonic at the end of the strides, and what it forces; nothing, by a factor of 0, to lanes that take none,
    since a loop with so much under a condition goes lane by lane."""
    for i in range(high):
        t = w[STRIDE_TIME + i]
        on = 1.0 if t > 0.0 else 0.0
        motor, rate = ramp(t, w[MOTOR + i], w[MOTOR_RATE + i], w[MOTOR_ACCELERATION + i])
        x, v, a = harmonic(motor, rate, 0.0, w[amplitude + i], w[order + i], w[phase + i])
        p, q = w[share + i], w[share + LANES + i]
        w[DRIVE_EXTRA + i] += on * x
        w[DRIVE_RATE_EXTRA + i] += on * v
        w[DRIVE_ACC_EXTRA + i] += on * a
        w[FORCED + i] += on * (p * x + q * v)
        w[FORCED_RATE + i] += on * (p * v + q * a)


@outlined
def end_forced(w, high, features):
    """Give the other half of the kick, and work out what opposes the table."""
    for i in range(high):
        if w[STRIDE_TIME + i] > 0.0:
            if features & USES_IMBALANCE:
                torque = imbalance_torque(w[TABLE + i], w[IMBALANCE_TORQUE + i], w[IMBALANCE_PHASE + i])
                x = w[TABLE + i] - w[C_0 + i] - w[LINE_OFFSET_2 + i]
                excess = torque - w[WEIGHT + i] - w[WEIGHT_STIFFNESS + i] * x
                w[KICK + i] = 0.5 * w[STRIDE_TIME + i] * (excess / w[J_TABLE + i])
                w[TABLE_RATE + i] -= w[KICK + i]
                w[LOAD_EXTRA + i] = w[VISCOUS + i] * w[TABLE_RATE + i] + torque
            else:
                w[LOAD_EXTRA + i] = w[VISCOUS + i] * w[TABLE_RATE + i]
    if features & USES_IMBALANCE and features & HAS_EDGES_2:
        for i in range(high):
            w[DRIFT + i] = drift(w, i, w[STRIDE_TIME + i], w[TABLE + i], w[TABLE_RATE + i], w[LINE_K_2 + i])


@outlined
def lane_forces(w, i, features):
    """What ripples on the drive of lane i, and what its imbalance adds to the load, at its present state."""
    if features & RIPPLES:
        ripples(w, i, i + ONE, features, DRIVE_EXTRA)
    if features & USES_IMBALANCE:
        w[LOAD_EXTRA + i] += imbalance_torque(w[TABLE + i], w[IMBALANCE_TORQUE + i], w[IMBALANCE_PHASE + i])
