"""The machine's equations once more, in compiled plain floats that share no code with the kernels or with `reference`.

Symbols are those of docs/physics.md. The motion law is the modified sine in closed form. State y (8,): α, α̇, φ, φ̇,
θ, θ̇, γ, γ̇. A joint's region is +1 or -1 in contact and 0 inside its play.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

TURN = 2.0 * math.pi


class Joint(NamedTuple):
    """k, r, total play g, ρ and hardening k_c of a joint; `edged` 0 for one straight line at all deflections."""

    k: float
    r: float
    g: float
    rho: float
    k_c: float
    edged: float


class Wave(NamedTuple):
    """size · sin(order γ + phase), or its cosine."""

    size: float
    order: float
    phase: float


class Bump(NamedTuple):
    """size (1 - y²)⁴, y = (cam phase - centre)/half_width."""

    size: float
    centre: float
    half_width: float


class Plant(NamedTuple):
    """All numbers of a machine at an operating point; effects that are absent have size 0.

    `single_rho` is the factor on ρ of joint 2 while the table moves from `single_station`; `slip` is 1/compliance, 0
    for a motor at constant speed; `loose` is 1 for a housing on its base, whose joint is (k3, r3).
    """

    J_C: float
    J_F: float
    J_t: float
    J_b: float
    J_m: float
    tau: float
    stations: float
    share: float
    joint_1: Joint
    joint_2: Joint
    single_rho: float
    single_station: float
    loose: float
    k3: float
    r3: float
    load: float
    coulomb: float
    coulomb_speed: float
    viscous: float
    stribeck: float
    stribeck_speed: float
    stribeck_smoothing: float
    imbalance: float
    imbalance_phase: float
    process: Bump
    profile: Bump
    spacing: float
    spacing_station: float
    command: float
    slip: float
    ripple: Wave
    transmission: Wave
    mesh: Wave


@numba.njit(cache=True)
def rise(s: float) -> tuple[float, float, float]:
    """Modified sine: height, velocity and acceleration at the share s of the motion."""
    if s < 0.125:
        x = 4.0 * math.pi * s
        y = (math.pi * s - 0.25 * math.sin(x)) / (4.0 + math.pi)
        return y, math.pi * (1.0 - math.cos(x)) / (4.0 + math.pi), 4.0 * math.pi**2 * math.sin(x) / (4.0 + math.pi)
    if s <= 0.875:
        x = (4.0 * math.pi * s + math.pi) / 3.0
        y = (2.0 + math.pi * s - 2.25 * math.sin(x)) / (4.0 + math.pi)
        v = math.pi * (1.0 - 3.0 * math.cos(x)) / (4.0 + math.pi)
        return y, v, 4.0 * math.pi**2 * math.sin(x) / (4.0 + math.pi)
    x = 4.0 * math.pi * (1.0 - s)
    y = (math.pi * (1.0 - s) - 0.25 * math.sin(x)) / (4.0 + math.pi)
    return 1.0 - y, math.pi * (1.0 - math.cos(x)) / (4.0 + math.pi), -4.0 * math.pi**2 * math.sin(x) / (4.0 + math.pi)


@numba.njit(cache=True)
def bump(b: Bump, phase: float) -> tuple[float, float, float]:
    """Value of a periodic bump at a cam phase [turns] and its first two derivatives by the phase."""
    if b.size == 0.0:
        return 0.0, 0.0, 0.0
    y = (phase - b.centre - math.floor(phase - b.centre + 0.5)) / b.half_width
    if abs(y) >= 1.0:
        return 0.0, 0.0, 0.0
    q = 1.0 - y * y
    curved = q * q * (56.0 * y * y - 8.0)
    return b.size * q**4, -8.0 * b.size * y * q**3 / b.half_width, b.size * curved / b.half_width**2


@numba.njit(cache=True)
def follower(p: Plant, alpha: float, turn: float) -> tuple[float, float, float]:
    """β(α), β', β'' in cam turn `turn`, with bump and spacing error."""
    u = alpha / TURN - turn
    h = TURN / p.stations
    start, advance = turn * h, h
    if p.spacing != 0.0:
        if (turn + 1.0) % p.stations == p.spacing_station:
            advance = h + p.spacing
        elif turn % p.stations == p.spacing_station:
            start, advance = start + p.spacing, h - p.spacing
    if u < p.share:
        y, v, a = rise(u / p.share)
    else:
        y, v, a = 1.0, 0.0, 0.0
    e0, e1, e2 = bump(p.profile, u)
    b1, b2 = advance * v / p.share, advance * a / p.share**2
    return start + advance * y + e0, (b1 + e1) / TURN, (b2 + e2) / TURN**2


@numba.njit(cache=True)
def drive_side(p: Plant, gamma: float, rate: float) -> tuple[float, float]:
    """Angle and rate of joint 1's drive side."""
    angle, speed = p.tau * gamma, p.tau * rate
    for wave in (p.ripple, p.transmission):
        angle += wave.size * math.sin(wave.order * gamma + wave.phase)
        speed += wave.size * wave.order * rate * math.cos(wave.order * gamma + wave.phase)
    return angle, speed


@numba.njit(cache=True)
def deflections(p: Plant, y: np.ndarray, turn: float) -> tuple[float, float, float, float]:
    """δ1, δ̇1, δ2, δ̇2."""
    side, side_rate = drive_side(p, y[6], y[7])
    b0, b1, _ = follower(p, y[0], turn)
    return side - y[0], side_rate - y[1], y[2] - b0 - y[4], y[3] - b1 * y[1] - y[5]


@numba.njit(cache=True)
def softness(p: Plant, turn: float) -> float:
    """ρ of joint 2 in a cam turn."""
    return p.joint_2.rho * (p.single_rho if turn % p.stations == p.single_station else 1.0)


@numba.njit(cache=True)
def torque(j: Joint, rho: float, region: int, d: float, v: float) -> float:
    """M of a joint in a region."""
    if region == 0:
        return 0.0
    x = d - 0.5 * region * j.g
    k = j.k if region > 0 else rho * j.k
    return (k + j.k_c * x * x) * x + j.r * v


@numba.njit(cache=True)
def opposing(p: Plant, alpha: float, phi: float, rate: float) -> float:
    """What opposes the table beside joint 2 [N m]."""
    total = p.load + p.viscous * rate + p.imbalance * math.sin(phi + p.imbalance_phase)
    total += bump(p.process, alpha / TURN)[0]
    if p.coulomb != 0.0:
        s = rate / p.coulomb_speed
        total += p.coulomb * s / math.sqrt(1.0 + s * s)
    if p.stribeck != 0.0:
        s = rate / p.stribeck_smoothing
        total += p.stribeck / (1.0 + (rate / p.stribeck_speed) ** 2) * s / math.sqrt(1.0 + s * s)
    return total


@numba.njit(cache=True)
def rates(p: Plant, y: np.ndarray, turn: float, region_1: int, region_2: int, out: np.ndarray) -> None:
    """dy/dt into out (8,); docs/physics.md, models B and B_on_base."""
    d1, v1, d2, v2 = deflections(p, y, turn)
    _, b1, b2 = follower(p, y[0], turn)
    M1 = torque(p.joint_1, p.joint_1.rho, region_1, d1, v1)
    M1 *= 1.0 + p.mesh.size * math.cos(p.mesh.order * y[6] + p.mesh.phase)
    M2 = torque(p.joint_2, softness(p, turn), region_2, d2, v2)
    w2 = y[1] * y[1]
    theta_acc = 0.0
    if p.loose != 0.0:
        M3 = p.k3 * y[4] + p.r3 * y[5]
        a, b, c = p.J_C + p.J_F * b1 * b1, p.J_F * b1, p.J_F + p.J_b
        f1, f2 = M1 + b1 * M2 - p.J_F * b1 * b2 * w2, M2 - M3 - p.J_F * b2 * w2
        determinant = a * c - b * b
        alpha_acc = (c * f1 - b * f2) / determinant
        theta_acc = (a * f2 - b * f1) / determinant
    else:
        alpha_acc = (M1 + b1 * (M2 - p.J_F * b2 * w2)) / (p.J_C + p.J_F * b1 * b1)
    out[0], out[1] = y[1], alpha_acc
    out[2], out[3] = y[3], -(opposing(p, y[0], y[2], y[3]) + M2) / p.J_t
    out[4], out[5] = y[5], theta_acc
    out[6], out[7] = y[7], ((p.command - y[7]) * p.slip - p.tau * M1) / p.J_m if p.slip != 0.0 else 0.0
