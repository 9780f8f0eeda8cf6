"""What is hidden in a drive, and what disturbs it that no library has: each a law of the plant, by its size.

A law gives the plant's values for a size x, the share of the rms force by which the force is to change. Its numbers are
a first guess; trial runs scale x (`sizes`). Where a law ends, x does no more: friction below 0 would drive, and a loop
later than 35 ms, or slower than 80 ms, is unstable.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sizes:
    """Of a drive without anything hidden, over all its motions.

    Attributes
    ----------
    F, V, A : float
        rms force [N], speed [m/s] and acceleration [m/s²], N m and rad for a rotary drive.
    Q : float
        Half its stroke [m].
    T : float
        Duration of a record [s].
    mass, coulomb : float
        [kg] and dry friction [N].
    """

    F: float
    Q: float
    V: float
    A: float
    T: float
    mass: float
    coulomb: float


Law = Callable[[Sizes, float, np.random.Generator], dict[str, float]]


def _split(s: Sizes, share: float, **more: float) -> dict[str, float]:
    """The drive as two masses, the second with this share."""
    load = share * s.mass
    return {"mass": s.mass - load, "load": load, **more}


def _play(s: Sizes, x: float, rng: np.random.Generator) -> dict[str, float]:
    share, gap = min(2.0 * x, 0.85), rng.uniform(0.01, 0.04) * s.Q
    load = share * s.mass
    stiff = {"stiffness": load * 1000.0**2, "damping": load * 500.0}
    return _split(s, share, **stiff, play=gap, load_coulomb=0.3 * s.F)


def _soft(s: Sizes, x: float, rng: np.random.Generator) -> dict[str, float]:
    share, omega = min(2.0 * x, 0.85), rng.uniform(15.0, 30.0)
    load = share * s.mass
    return _split(s, share, stiffness=load * omega**2, damping=load * 0.1 * omega)


HIDDEN: Mapping[str, Law] = {
    "friction.coulomb": lambda s, x, r: {"coulomb": x * s.F},
    "friction.quadratic": lambda s, x, r: {"quadratic": x * s.F / s.V**2},
    "friction.asymmetric": lambda s, x, r: {"asymmetric": min(x * s.F, s.coulomb)},
    "friction.stribeck": lambda s, x, r: {"stribeck": 1.5 * x * s.F, "stribeck_speed": r.uniform(0.1, 0.3) * s.V},
    "friction.position": lambda s, x, r: {"tilted": min(2.0 * x * s.F, s.coulomb)},
    "friction.presliding": lambda s, x, r: {"presliding": x * s.F, "presliding_distance": r.uniform(0.01, 0.06) * s.Q},
    "offset": lambda s, x, r: {"offset": x * s.F * r.choice([-1.0, 1.0])},
    "spring.linear": lambda s, x, r: {"spring": x * s.F / s.Q},
    "spring.cubic": lambda s, x, r: {"cubic": 2.0 * x * s.F / s.Q**3},
    "spring.bilinear": lambda s, x, r: {"bilinear": 4.0 * x * s.F / s.Q, "bilinear_place": r.uniform(0.1, 0.6) * s.Q},
    "end_stop": lambda s, x, r: {"stops": 10.0 * x * s.F / s.Q, "stops_place": r.uniform(0.6, 0.85) * s.Q},
    "load.imbalance": lambda s, x, r: {"gravity": x * s.F, "gravity_phase": r.uniform(0.0, 6.28)},
    "cogging": lambda s, x, r: {
        "cogging": x * s.F, "cogging_wavenumber": r.uniform(8.0, 25.0) / s.Q, "cogging_phase": r.uniform(0.0, 6.28)},
    "inertia.position": lambda s, x, r: {
        "breathing": min(1.5 * x, 0.9), "breathing_wavenumber": r.uniform(2.0, 8.0) / s.Q},
    "play.contact": _play,
    "compliance": _soft,
    "delay": lambda s, x, r: {"delay": float(min(max(round(70.0 * x), 1), 35))},
    "loop_lag": lambda s, x, r: {"lag": min(0.15 * x, 0.08)},
    "sensor.mains_hum": lambda s, x, r: {"hum": 1.4 * x * s.F, "hum_frequency": r.uniform(4.0, 9.0)},
    "sensor.offset_drift": lambda s, x, r: {"drift": 1.7 * x * s.F / s.T},
}  # fmt: skip
"""Effects of the library as the plant has them."""

UNKNOWN: Mapping[str, Law] = {
    "hysteresis": lambda s, x, r: {"hysteresis": x * s.F, "hysteresis_reach": 0.2 * s.Q},
    "thickening": lambda s, x, r: {"thickening": x * s.F / s.V**1.5},
    "warming": lambda s, x, r: {"warming": min(5.0 * x, 1.0)},
    "bending": lambda s, x, r: {"bending": 2.0 * x * s.F},
    "streaked": lambda s, x, r: {"streaked": 2.0 * x * s.F / s.V},
    "stick_growth": lambda s, x, r: {"stick_growth": x * s.F},
    "cable": lambda s, x, r: {"cable": 3.0 * x * s.F},
    "shuttle": lambda s, x, r: {"shuttle": 5.0 * x * s.F, "shuttle_place": r.uniform(-0.5, 0.5)},
    "sag": lambda s, x, r: {"sag": x * s.F},
    "swing": lambda s, x, r: {"swing": x * s.F / s.A},
}
"""What is in no library, likewise."""

TUNED = ("hysteresis", "warming", "streaked", "cable", "sag")
"""Kinds of disturbance that anything may be tuned on; the others judge."""
