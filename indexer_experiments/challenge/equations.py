"""The machine's equations once more, in compiled plain floats that share no code with the kernels or with `reference`.

Symbols: docs/explanation/physics.md. State y (13,): α, α̇, φ, φ̇, θ, θ̇, γ, γ̇, then those of `unlisted`. A joint's
region is +1 or -1 in contact and 0 inside its play.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from indexer_experiments.challenge.laws import rise
from indexer_experiments.challenge.unlisted import (
    NOTHING,
    TURN,
    Bump,
    Unlisted,
    Wave,
    beside_joint,
    bump,
    carried,
    command_rate,
    commanded,
    coupled,
    of_mass,
    on_cam,
    on_table,
    table_inertia,
    wandering,
    waved,
)

STATES = 13


class Joint(NamedTuple):
    """k, r, total play g, ρ and hardening k_c of a joint; `edged` 0 for one straight line at all deflections."""

    k: float
    r: float
    g: float
    rho: float
    k_c: float
    edged: float


class Plant(NamedTuple):
    """All numbers of a machine at an operating point; effects that are absent have size 0.

    `single_rho` is the factor on ρ of joint 2 while the table moves from `single_station`; `slip` is 1/compliance, 0
    for a motor at constant speed; `loose` is 1 for a housing on its base, whose joint is (k3, r3); `law` is a place in
    `laws.LAWS`.
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
    mesh_friction: float
    law: float
    unlisted: Unlisted = NOTHING


@numba.njit
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
    e0, e1, e2 = bump(p.profile, u)
    if u < p.share:
        y, v, a = rise(p.law, u / p.share)
        w0, w1, w2 = waved(p.unlisted, u / p.share)
        e0, e1, e2 = e0 + w0, e1 + w1 / p.share, e2 + w2 / p.share**2
    else:
        y, v, a = 1.0, 0.0, 0.0
    b1, b2 = advance * v / p.share, advance * a / p.share**2
    return start + advance * y + e0, (b1 + e1) / TURN, (b2 + e2) / TURN**2


@numba.njit
def drive_side(p: Plant, gamma: float, rate: float) -> tuple[float, float]:
    """Angle and rate of joint 1's drive side."""
    angle, speed = p.tau * gamma, p.tau * rate
    for wave in (p.ripple, p.transmission):
        angle += wave.size * math.sin(wave.order * gamma + wave.phase)
        speed += wave.size * wave.order * rate * math.cos(wave.order * gamma + wave.phase)
    return angle, speed


@numba.njit
def deflections(p: Plant, y: np.ndarray, turn: float) -> tuple[float, float, float, float]:
    """δ1, δ̇1, δ2, δ̇2."""
    side, side_rate = drive_side(p, y[6], y[7])
    b0, b1, _ = follower(p, y[0], turn)
    return side - y[0], side_rate - y[1], y[2] - b0 - y[4], y[3] - b1 * y[1] - y[5]


@numba.njit
def softness(p: Plant, turn: float) -> float:
    """ρ of joint 2 in a cam turn."""
    return p.joint_2.rho * (p.single_rho if turn % p.stations == p.single_station else 1.0)


@numba.njit
def torque(j: Joint, rho: float, region: int, d: float, v: float) -> float:
    """M of a joint in a region."""
    if region == 0:
        return 0.0
    x = d - 0.5 * region * j.g
    k = j.k if region > 0 else rho * j.k
    return (k + j.k_c * x * x) * x + j.r * v


@numba.njit
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


@numba.njit
def rates(p: Plant, y: np.ndarray, turn: float, region_1: int, region_2: int, out: np.ndarray) -> None:
    """dy/dt into out (STATES,); docs/explanation/physics.md, models B and B_on_base."""
    u = p.unlisted
    d1, v1, d2, v2 = deflections(p, y, turn)
    _, b1, b2 = follower(p, y[0], turn)
    M1 = torque(p.joint_1, p.joint_1.rho, region_1, d1, v1)
    M1 *= 1.0 + p.mesh.size * math.cos(p.mesh.order * y[6] + p.mesh.phase)
    M2 = carried(u, y, turn) * torque(p.joint_2, softness(p, turn), region_2, d2, v2) + beside_joint(u, y, v2)
    M1 = coupled(u, M1)
    driving, w2 = on_cam(u, y, p.command, M1 / (1.0 + p.mesh_friction * region_1)), y[1] * y[1]
    theta_acc = 0.0
    if p.loose != 0.0:
        M3 = p.k3 * y[4] + p.r3 * y[5]
        a, b, c = p.J_C + p.J_F * b1 * b1, p.J_F * b1, p.J_F + p.J_b
        f1, f2 = driving + b1 * M2 - p.J_F * b1 * b2 * w2, M2 - M3 - p.J_F * b2 * w2
        determinant = a * c - b * b
        alpha_acc = (c * f1 - b * f2) / determinant
        theta_acc = (a * f2 - b * f1) / determinant
    else:
        alpha_acc = (driving + b1 * (M2 - p.J_F * b2 * w2)) / (p.J_C + p.J_F * b1 * b1)
    out[0], out[1] = y[1], alpha_acc
    opposed = opposing(p, y[0], y[2], y[3]) + on_table(u, y, turn) - of_mass(u, y)
    out[2], out[3] = y[3], -(opposed + M2) / table_inertia(u, p.J_t, turn)
    out[4], out[5] = y[5], theta_acc
    speed = commanded(u, p.command, y[8])
    out[6] = y[7]
    if p.slip != 0.0:
        _, lever = drive_side(p, y[6], 1.0)
        out[7] = ((speed - y[7]) * p.slip - lever * M1) / p.J_m
    else:
        out[7] = command_rate(u, p.command, y[8])
    out[8], out[9] = 1.0, v2 - abs(v2) * y[9] / u.yielding
    out[12] = wandering(u, y)
    out[10], out[11] = y[11], -of_mass(u, y) / u.mass if u.mass != 0.0 else 0.0
