"""A drive of one or two masses under control, advanced by Moreau's time-stepping.

A step of h moves speeds by the smooth forces and then takes from them what dry friction can, at most all:

    v⁻ = v + h F/m,   v' = sign(v⁻) max(|v⁻| - h L/m, 0),   q' = q + h v'

which is Coulomb's law with true sticking, without events and without a smoothed sign (Moreau, in Nonsmooth Mechanics
and Applications, 1988). It is of first order; h is some 20 µs where a drive's fastest motion takes milliseconds. The
models that judge these records integrate otherwise, or not at all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

FIELDS = (
    "mass", "load", "stiffness", "damping", "play", "viscous", "quadratic", "coulomb", "asymmetric", "stribeck",
    "stribeck_speed", "tilted", "offset", "gravity", "gravity_phase", "spring", "cubic", "bilinear", "bilinear_place",
    "stops", "stops_place", "presliding", "presliding_distance", "cogging", "cogging_wavenumber", "cogging_phase",
    "load_coulomb", "load_viscous", "breathing", "breathing_wavenumber", "middle", "stroke", "limit",
    # what no library has
    "hysteresis", "hysteresis_reach", "thickening", "warming", "bending", "streaked", "stick_growth", "cable",
    "shuttle", "shuttle_place", "sag", "swing",
)  # fmt: skip
"""Of a plant; what is not given is 0.

`breathing` is an inertia that varies with the place. The last twelve are in no library: `hysteresis` a cable's Bouc-Wen
force, half of which a reach of travel turns; `thickening` drag with |v|^1.5; `warming` viscous drag that falls by this
share of itself over the record; `bending` Coulomb friction and `streaked` viscous drag in sin² of the place;
`stick_growth` dry friction that grows with the logarithm of a rest and fades over half a second of motion; `cable` a
drag chain's weight over the place cubed and rectified; `shuttle` a one-sided catch at a place; `sag` a force with the
square root of |q|; `swing` a part of the load that hangs and swings, a mass of its own.
"""

_SLOW, _ADHERED, _FADES = 0.02, 0.05, 0.5
"""Of `stick_growth`: the speed below which a drive rests [half strokes a second], the rest after which friction has
grown by ln 2 of the field's value, and the time over which that fades in motion [s]."""

_SWING_STIFFNESS, _SWING_DAMPING = 40.0, 0.6
"""Of `swing`, a kilogram of it: 1 Hz, 5 % of critical damping [N/m, N s/m]."""

_AT = {name: k for k, name in enumerate(FIELDS)}


@dataclass(frozen=True, eq=False)
class Run:
    """A run of a plant at the controller's rate: time, position and force of the motor, load's position, each (n,).

    A force is held until the next sample; positions are those at the middle of that: both belong to one instant.
    """

    t: np.ndarray
    q: np.ndarray
    force: np.ndarray
    load: np.ndarray


def simulate_plant(
    values: Mapping[str, float], reference: np.ndarray, rate: float, gains: tuple[float, float], *, delay: int = 0,
    lag: float = 0.0, steps: int = 40,
) -> Run:  # fmt: skip
    """Follow a reference (n,) sampled at a rate [Hz] with a PD controller with feed-forward of the inertia.

    Parameters
    ----------
    values : mapping
        By the names in `FIELDS`.
    gains : (float, float)
        Of position [F/Q] and of speed [F/V].
    delay : int
        Samples by which the force comes late.
    lag : float
        Time constant of the current loop [s].
    steps : int
        In a sample of the controller.
    """
    c = np.zeros(len(FIELDS))
    for name, value in values.items():
        c[_AT[name]] = value
    c[_AT["stroke"]] = c[_AT["stroke"]] or 0.5 * float(np.ptp(reference))
    c[_AT["middle"]] = 0.5 * float(reference.min() + reference.max())
    speed = np.gradient(reference, 1.0 / rate)
    ahead = (c[_AT["mass"]] + c[_AT["load"]]) * np.gradient(speed, 1.0 / rate)
    out = np.zeros((3, len(reference)))
    _follow(c, reference, speed, ahead, rate, gains[0], gains[1], delay, lag, steps, out)
    return Run(np.arange(len(reference)) / rate, out[0], out[1], out[2])


def _fields() -> tuple[int, ...]:
    return tuple(range(len(FIELDS)))


(
    MASS, LOAD, STIFFNESS, DAMPING, PLAY, VISCOUS, QUADRATIC, COULOMB, ASYMMETRIC, STRIBECK, STRIBECK_SPEED, TILTED,
    OFFSET, GRAVITY, GRAVITY_PHASE, SPRING, CUBIC, BILINEAR, BILINEAR_PLACE, STOPS, STOPS_PLACE, PRESLIDING,
    PRESLIDING_DISTANCE, COGGING, COGGING_WAVENUMBER, COGGING_PHASE, LOAD_COULOMB, LOAD_VISCOUS, BREATHING,
    BREATHING_WAVENUMBER, MIDDLE, STROKE, LIMIT, HYSTERESIS, HYSTERESIS_REACH, THICKENING, WARMING, BENDING, STREAKED,
    STICK_GROWTH, CABLE, SHUTTLE, SHUTTLE_PLACE, SAG, SWING,
) = _fields()  # fmt: skip


@njit(cache=True)
def _resisted(c, q, v, z, w, warm):
    """Smooth forces against the motor's motion."""
    x = q - c[MIDDLE]
    total = c[VISCOUS] * v * (1.0 - c[WARMING] * warm) + c[QUADRATIC] * abs(v) * v + c[OFFSET]
    total += c[GRAVITY] * math.sin(q + c[GRAVITY_PHASE]) + c[SPRING] * x + c[CUBIC] * x * x * x
    total += c[BILINEAR] * max(x - c[BILINEAR_PLACE], 0.0)
    total += c[STOPS] * (max(x - c[STOPS_PLACE], 0.0) + min(x + c[STOPS_PLACE], 0.0))
    total += c[COGGING] * math.sin(c[COGGING_WAVENUMBER] * q + c[COGGING_PHASE])
    total += c[PRESLIDING] * z + c[HYSTERESIS] * w
    total += c[THICKENING] * abs(v) ** 1.5 * (1.0 if v > 0.0 else -1.0)
    share = x / c[STROKE]
    total += c[STREAKED] * v * math.sin(3.0 * share) ** 2
    total += c[CABLE] * max(share, 0.0) ** 3 + c[SAG] * math.sqrt(abs(share)) * (1.0 if share > 0.0 else -1.0)
    if abs(share - c[SHUTTLE_PLACE]) < 0.05 and v > 0.0:
        total += c[SHUTTLE]
    return total


@njit(cache=True)
def _level(c, q, v, rested):
    """Level of dry friction at the motor."""
    share = (q - c[MIDDLE]) / c[STROKE]
    level = c[COULOMB] + c[TILTED] * share + c[BENDING] * math.sin(3.0 * share) ** 2
    level += c[ASYMMETRIC] if v > 0.0 else -c[ASYMMETRIC]
    if c[STRIBECK] != 0.0:
        s = v / c[STRIBECK_SPEED]
        level += c[STRIBECK] / (1.0 + s * s)
    return max(level + c[STICK_GROWTH] * math.log1p(rested / _ADHERED), 0.0)


@njit(cache=True)
def _slowed(v, impulse):
    """A speed after dry friction has taken what it can."""
    if v > impulse:
        return v - impulse
    if v < -impulse:
        return v + impulse
    return 0.0


@njit(cache=True)
def _follow(c, reference, speed, ahead, rate, kp, kd, delay, lag, steps, out):
    n = len(reference)
    h = 1.0 / (rate * steps)
    q, v, x, y = reference[0], 0.0, reference[0], 0.0
    z, w, force, rested, s, r = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    asked = np.zeros(n)
    two = c[LOAD] > 0.0
    for k in range(n):
        command = kp * (reference[k] - q) + kd * (speed[k] - v) + ahead[k]
        if c[LIMIT] > 0.0:
            command = min(max(command, -c[LIMIT]), c[LIMIT])
        asked[k] = command
        out[1, k] = command
        acting = asked[k - delay] if k >= delay else 0.0
        for i in range(steps):
            if i == steps // 2:
                out[0, k], out[2, k] = q, x
            force = acting if lag <= 0.0 else force + h / lag * (acting - force)
            joint = 0.0
            if two:
                d = q - x
                edge = 0.5 * c[PLAY]
                if d > edge:
                    joint = max(c[STIFFNESS] * (d - edge) + c[DAMPING] * (v - y), 0.0)
                elif d < -edge:
                    joint = min(c[STIFFNESS] * (d + edge) + c[DAMPING] * (v - y), 0.0)
            mass = c[MASS] * (1.0 + c[BREATHING] * math.sin(c[BREATHING_WAVENUMBER] * q))
            swung = _SWING_STIFFNESS * s + _SWING_DAMPING * r
            free = force - joint - _resisted(c, q, v, z, w, k / n) + c[SWING] * swung
            free -= (
                0.5 * c[MASS] * c[BREATHING] * c[BREATHING_WAVENUMBER] * math.cos(c[BREATHING_WAVENUMBER] * q) * v * v
            )
            moved = v + h * free / mass
            before = v
            v = _slowed(moved, h * _level(c, q, moved, rested) / mass)
            rested += h if abs(v) < _SLOW * c[STROKE] else -h * rested / _FADES
            q += h * v
            if c[PRESLIDING] != 0.0:
                z += h * (v - abs(v) * z) / c[PRESLIDING_DISTANCE]
            if c[HYSTERESIS] != 0.0:
                w += h * (v - 0.5 * abs(v) * w * abs(w) - 0.5 * v * w * w) / c[HYSTERESIS_REACH]
            # s: how far the hanging mass is ahead; what pushes it pushes back on the drive
            r -= h * swung + v - before
            s += h * r
            if two:
                y = _slowed(y + h * (joint - c[LOAD_VISCOUS] * y) / c[LOAD], h * c[LOAD_COULOMB] / c[LOAD])
                x += h * y
            else:
                x = q
