"""Physics that the effect library does not have, as the challenge's equations take it; sizes are 0 where it is absent.

State y (13,), as in `equations`: 8 t [s], 9 hysteretic deflection z [rad], 10 and 11 angle and rate of a mass on the
table, 12 wandering load [N m]. All numbers are floats: arrays among them made the solver three times slower.
Bouc–Wen's hysteresis: Ismail, Ikhouane, Rodellar, Arch. Comput. Methods Eng. 16 (2009) 161, with n = 1, β = γ.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

TURN = 2.0 * math.pi

SIGN = 0.005
"""rad/s; rate at which 71 % of a dry friction acts."""


KICK = 0.005
"""s; between the kicks of a wandering load: 200 a second, above all that the machine follows."""

RECORDS = 37.0
"""Between the seeds of one record and the next."""


class Wave(NamedTuple):
    """size · sin(order x + phase), or its cosine."""

    size: float
    order: float
    phase: float


class Bump(NamedTuple):
    """size (1 - y²)⁴, y = (phase - centre)/half_width, periodic in the phase [turns]."""

    size: float
    centre: float
    half_width: float


class Unlisted(NamedTuple):
    """Numbers of all disturbances; docs/explanation/challenge.md gives their equations in these symbols.

    `seed` is that of `chance`, which in each `record` is another one where what is random follows time; `sticking` the
    share of the cam turns in which the table sticks.
    """

    seed: float
    record: float
    stations: float
    drift: float
    drift_time: float
    quadratic: float
    patch: Bump
    inertia: float
    hysteresis: float
    yielding: float
    warming: float
    warming_time: float
    beat: float
    beat_low: float
    beat_high: float
    loss: Bump
    inverter: Wave
    rate_squared: float
    walk: float
    walk_time: float
    mass: float
    mass_stiffness: float
    mass_damping: float
    stick: float
    sticking: float
    rubber: float
    wavy: Wave


NOTHING = Unlisted(
    seed=0.0, record=0.0, stations=1.0, drift=0.0, drift_time=1.0, quadratic=0.0, patch=Bump(0.0, 0.0, 1.0),
    inertia=0.0, hysteresis=0.0, yielding=1.0, warming=0.0, warming_time=1.0, beat=0.0, beat_low=0.0, beat_high=0.0,
    loss=Bump(0.0, 0.0, 1.0), inverter=Wave(0.0, 0.0, 0.0), rate_squared=0.0, walk=0.0, walk_time=1.0, mass=0.0,
    mass_stiffness=0.0, mass_damping=0.0, stick=0.0, sticking=0.0, rubber=0.0, wavy=Wave(0.0, 1.0, 0.0),
)  # fmt: skip
"""No disturbance."""


@numba.njit
def bump(b: Bump, phase: float) -> tuple[float, float, float]:
    """Value of a periodic bump at a phase [turns] and its first two derivatives by the phase."""
    if b.size == 0.0:
        return 0.0, 0.0, 0.0
    y = (phase - b.centre - math.floor(phase - b.centre + 0.5)) / b.half_width
    if abs(y) >= 1.0:
        return 0.0, 0.0, 0.0
    q = 1.0 - y * y
    curved = q * q * (56.0 * y * y - 8.0)
    return b.size * q**4, -8.0 * b.size * y * q**3 / b.half_width, b.size * curved / b.half_width**2


@numba.njit
def chance(seed: float, number: float) -> float:
    """A number in [0, 1) that looks random, the same for the same seed and whole number."""
    x = 43758.5453 * math.sin(12.9898 * number + 78.233 * seed)
    return x - math.floor(x)


@numba.njit
def of_record(u: Unlisted) -> float:
    """Seed of what is random over one record's time."""
    return u.seed + RECORDS * u.record


@numba.njit
def dry(rate: float) -> float:
    """Share of a dry friction that acts, in ±1."""
    s = rate / SIGN
    return s / math.sqrt(1.0 + s * s)


@numba.njit
def command_rate(u: Unlisted, command: float, t: float) -> float:
    """dω/dt of the commanded speed [rad/s²]: it drifts from ω(1 - d/2) to ω(1 + d/2) over the record."""
    return command * u.drift / u.drift_time if 0.0 <= t < u.drift_time else 0.0


@numba.njit
def commanded(u: Unlisted, command: float, t: float) -> float:
    """Commanded speed [rad/s] at t."""
    return command * (1.0 + u.drift * (min(max(t / u.drift_time, 0.0), 1.0) - 0.5))


@numba.njit
def waved(u: Unlisted, s: float) -> tuple[float, float, float]:
    """Chatter marks A sin²(π s) sin(2π m s + ψ) on the cam's track, s the share of the motion, and two derivatives."""
    if u.wavy.size == 0.0:
        return 0.0, 0.0, 0.0
    a, w = 2.0 * math.pi, 2.0 * math.pi * u.wavy.order
    x, z = a * s, w * s + u.wavy.phase
    e0, e1, e2 = 0.5 * (1.0 - math.cos(x)), 0.5 * a * math.sin(x), 0.5 * a * a * math.cos(x)
    f0, f1, f2 = math.sin(z), w * math.cos(z), -w * w * math.sin(z)
    size = u.wavy.size
    return size * e0 * f0, size * (e1 * f0 + e0 * f1), size * (e2 * f0 + 2.0 * e1 * f1 + e0 * f2)


@numba.njit
def on_table(u: Unlisted, y: np.ndarray, turn: float) -> float:
    """What opposes the table [N m], the mass on it and joint 2 left out."""
    t, phi, rate = y[8], y[2], y[3]
    total = u.quadratic * rate * abs(rate) + y[12]
    if u.patch.size != 0.0:
        total += bump(u.patch, phi / TURN)[0] * dry(rate)
    if u.stick != 0.0 and chance(of_record(u), turn) < u.sticking:
        total += u.stick * dry(rate)
    if u.beat != 0.0:
        total += u.beat * (math.sin(u.beat_low * t) + math.sin(u.beat_high * t))
    return total


@numba.njit
def wandering(u: Unlisted, y: np.ndarray) -> float:
    """Rate of the wandering load [N m/s]: a random walk, pulled back to 0 within `walk_time`, whose kicks are random
    every 5 ms and straight lines between."""
    if u.walk == 0.0 or y[8] < 0.0:
        return 0.0
    k = math.floor(y[8] / KICK)
    seed = of_record(u)
    before, after = 2.0 * chance(seed, k) - 1.0, 2.0 * chance(seed, k + 1.0) - 1.0
    return u.walk * (before + (y[8] / KICK - k) * (after - before)) / KICK - y[12] / u.walk_time


@numba.njit
def of_mass(u: Unlisted, y: np.ndarray) -> float:
    """Torque by which the mass on the table drives the table [N m]."""
    return u.mass_stiffness * (y[10] - y[2]) + u.mass_damping * (y[11] - y[3])


@numba.njit
def carried(u: Unlisted, y: np.ndarray, turn: float) -> float:
    """Share of joint 2's torque that its warm and unevenly preloaded rollers carry [-]."""
    share = 1.0
    if u.warming != 0.0 and y[8] > 0.0:
        share -= u.warming * (1.0 - math.exp(-y[8] / u.warming_time))
    if u.loss.size != 0.0:
        share *= 1.0 - bump(u.loss, y[0] / TURN - turn)[0]
    return share


@numba.njit
def beside_joint(u: Unlisted, y: np.ndarray, rate: float) -> float:
    """Torque that acts beside joint 2's play, between follower and table [N m]."""
    return u.hysteresis * y[9] + u.rate_squared * rate * abs(rate)


@numba.njit
def coupled(u: Unlisted, torque: float) -> float:
    """Torque of joint 1 whose rubber hardens [N m], from its own; `rubber` is 1/M_r²."""
    return torque * (1.0 + u.rubber * torque * torque)


@numba.njit
def on_cam(u: Unlisted, y: np.ndarray, command: float, torque: float) -> float:
    """What joint 1 and the drive give to the cam [N m], joint 1's own torque being `torque`."""
    given = torque
    if u.inverter.size != 0.0:
        given += u.inverter.size * (y[7] / command) ** 2 * math.sin(u.inverter.order * y[8] + u.inverter.phase)
    return given


@numba.njit
def table_inertia(u: Unlisted, inertia: float, turn: float) -> float:
    """J_t while the table leaves a station [kg m²]."""
    return inertia * (1.0 + u.inertia * (2.0 * chance(u.seed, turn % u.stations) - 1.0))
