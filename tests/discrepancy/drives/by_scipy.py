"""Drives under closed-loop control, solved by SciPy's LSODA.

Dry friction is a law so steep that what it holds creeps by micrometres a second, and contacts are stiff springs.
Nothing here is shared with the models or the challenge.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from discrepancy.drives.channels import Record

CREEP = 5e-6
"""Speed [m/s] at which three quarters of a dry friction act."""


def path(seconds: float, stroke: float, frequencies: tuple[float, ...], seed: int) -> CubicSpline:
    """A sum of sines of random phases that begins at rest."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, seconds, int(seconds * 200) + 1)
    q = np.zeros_like(t)
    for f in frequencies:
        q += rng.uniform(0.3, 1.0) / math.sqrt(f) * np.sin(2.0 * math.pi * (f * t + rng.uniform()))
    begun = np.clip(t, 0.0, 1.0)
    return CubicSpline(t, stroke * q / np.ptp(q) * begun**2 * (3.0 - 2.0 * begun))


def driven(
    to: CubicSpline,
    rate: float,
    mass: float,
    friction: Callable[[float, float], float],
    *,
    drag: float = 0.0,
    load: tuple[float, float, float] | None = None,
    read: Callable[[np.ndarray], np.ndarray] = np.zeros_like,
    noise: float = 0.0,
    seed: int = 0,
    held_out: bool = False,
) -> Record:
    """A record of a drive that follows a path.

    `friction` is the level [N] by time and speed; `load` the mass [kg] behind play, the play [m] and the load's own dry
    friction [N]; `read` is what the force's reading adds by time; the encoder has steps of a tenth of a micrometre.
    """
    speed, acceleration = to.derivative(), to.derivative(2)
    behind, play, rubs = load or (1.0, 0.0, 0.0)
    whole = mass + (behind if load else 0.0)

    def force(t: float, q: float, v: float) -> float:
        return whole * (float(acceleration(t)) + 2000.0 * (float(to(t)) - q) + 90.0 * (float(speed(t)) - v))

    def contact(d: float, rate: float) -> float:
        if abs(d) <= 0.5 * play:
            return 0.0
        side = math.copysign(1.0, d)
        return side * max(side * (2e7 * (d - side * 0.5 * play) + 2e4 * rate), 0.0)

    def rates(t: float, s: np.ndarray) -> list[float]:
        q, v, x, y = s
        pushed = contact(q - x, v - y) if load else 0.0
        resisted = friction(t, v) * math.tanh(v / CREEP) + drag * v
        free = [y, (pushed - rubs * math.tanh(y / CREEP)) / behind] if load else [0.0, 0.0]
        return [v, (force(t, q, v) - pushed - resisted) / mass, *free]

    t = np.arange(int(to.x[-1] * rate)) / rate
    start = [float(to(0.0)), 0.0, float(to(0.0)), 0.0]
    found = solve_ivp(rates, (0.0, t[-1]), start, "LSODA", t_eval=t, rtol=1e-6, atol=1e-9, max_step=5e-3)
    q, v = found.y[:2]
    rows = {
        "q": 1e-7 * np.round(q / 1e-7),
        "force": np.array([force(*row) for row in zip(t, q, v, strict=True)])
        + read(t)
        + noise * np.random.default_rng(seed).standard_normal(len(t)),
    }
    return Record(f"{'held' if held_out else 'fit'}.csv", rate, rows, {"q": "m", "force": "N"}, held_out)
