"""A case of the messy challenge: a drive of random size, what is hidden in it, and what no library has.

Everything is drawn from the seed and the case's number alone. Laws: force scale log-uniform over 10^±2, stroke over
10^-2 … 10^0.5 m or 0.6 … 3 rad; rate of 50 to 1000 Hz; 1 to 3 records of 12 s, each another motion; noise of 0.3 to 3 %
of the rms force; mass off by ± 15 %, viscous drag by ± 30 %. Hidden: 0, 1 or 2 effects of the library (20, 60, 20 %),
each 0.1 to 0.5 of the rms force. Beside them 0 to 2 disturbances that are in no library, each 0.5 to 3 times the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discrepancy.drives.channels import Record
from discrepancy.drives.description import Channel, Drive, known_parameter
from discrepancy.drives.effects import EFFECTS
from indexer_experiments.challenge.drives.motions import KINDS, reference
from indexer_experiments.challenge.drives.plant import Run, simulate_plant

_RATE = 1000.0
_SECONDS = 12.0
_RATES = (50, 100, 250, 500, 1000)
_BANDWIDTH = 60.0
"""Of the position loop [rad/s]."""


@dataclass(frozen=True)
class Sizes:
    """rms force F, stroke's half Q, rms speed V, mass and dry friction of a drive without anything hidden."""

    F: float
    Q: float
    V: float
    mass: float
    coulomb: float


Hidden = Callable[[Sizes, float, np.random.Generator], dict[str, float]]


def _split(s: Sizes, size: float, rng: np.random.Generator, **more: float) -> dict[str, float]:
    """The drive as two masses, the share of the second by the size."""
    share = 0.3 + size
    load = share * s.mass
    return {"mass": s.mass - load, "load": load, **more}


def _play(s: Sizes, size: float, rng: np.random.Generator) -> dict[str, float]:
    load = (0.3 + size) * s.mass
    return _split(
        s, size, rng, stiffness=load * 1000.0**2, damping=load * 500.0, play=s.Q * rng.uniform(0.01, 0.04),
        load_coulomb=0.3 * s.F,
    )  # fmt: skip


def _soft(s: Sizes, size: float, rng: np.random.Generator) -> dict[str, float]:
    load, omega = (0.3 + size) * s.mass, rng.uniform(15.0, 30.0)
    return _split(s, size, rng, stiffness=load * omega**2, damping=load * 0.1 * omega)


HIDDEN: Mapping[str, Hidden] = {
    "friction.coulomb": lambda s, x, r: {"coulomb": x * s.F},
    "friction.quadratic": lambda s, x, r: {"quadratic": 1.5 * x * s.F / s.V**2},
    "friction.asymmetric": lambda s, x, r: {"asymmetric": 0.6 * x * s.coulomb},
    "friction.stribeck": lambda s, x, r: {"stribeck": 1.5 * x * s.F, "stribeck_speed": r.uniform(0.1, 0.3) * s.V},
    "friction.position": lambda s, x, r: {"tilted": 1.8 * x * s.coulomb},
    "friction.presliding": lambda s, x, r: {"presliding": x * s.F, "presliding_distance": r.uniform(0.01, 0.06) * s.Q},
    "offset": lambda s, x, r: {"offset": x * s.F * r.choice([-1.0, 1.0])},
    "spring.linear": lambda s, x, r: {"spring": x * s.F / s.Q},
    "spring.cubic": lambda s, x, r: {"cubic": 2.0 * x * s.F / s.Q**3},
    "spring.bilinear": lambda s, x, r: {"bilinear": 4.0 * x * s.F / s.Q, "bilinear_place": r.uniform(0.1, 0.6) * s.Q},
    "end_stop": lambda s, x, r: {"stops": 15.0 * x * s.F / s.Q, "stops_place": r.uniform(0.6, 0.85) * s.Q},
    "load.imbalance": lambda s, x, r: {"gravity": x * s.F, "gravity_phase": r.uniform(0.0, 6.28)},
    "cogging": lambda s, x, r: {
        "cogging": x * s.F, "cogging_wavenumber": r.uniform(8.0, 25.0) / s.Q, "cogging_phase": r.uniform(0.0, 6.28)},
    "inertia.position": lambda s, x, r: {"breathing": 1.5 * x, "breathing_wavenumber": r.uniform(2.0, 8.0) / s.Q},
    "play.contact": _play,
    "compliance": _soft,
    "delay": lambda s, x, r: {"delay": float(round(20.0 + 60.0 * x))},
    "loop_lag": lambda s, x, r: {"lag": 0.02 + 0.06 * x},
    "sensor.mains_hum": lambda s, x, r: {"hum": x * s.F, "hum_frequency": r.uniform(4.0, 9.0)},
    "sensor.offset_drift": lambda s, x, r: {"drift": 2.0 * x * s.F / _SECONDS},
}  # fmt: skip
"""Effects of the library as the plant has them, given sizes, a share of the rms force and a stream of chance."""

ALSO: Mapping[str, tuple[str, ...]] = {
    "play.contact": ("play",), "loop_lag": ("delay",), "delay": ("loop_lag",), "offset": ("friction.asymmetric",),
    "friction.asymmetric": ("offset",),
}  # fmt: skip
"""Other names that are right for the same physics."""

WITH: Mapping[str, tuple[str, ...]] = {
    "play.contact": ("friction.coulomb",), "bending": ("friction.coulomb",),
}  # fmt: skip
"""What comes with an effect or a disturbance and is in the library: the load behind the play rubs, and half of what
bends is friction that is the same everywhere. Its name is right, but asked of nobody."""

LIKE: Mapping[str, tuple[str, ...]] = {
    "cable": ("spring.bilinear",), "hysteresis": ("friction.presliding",), "thickening": ("friction.quadratic",),
    "sag": ("spring.linear", "spring.cubic", "load.imbalance", "ripple"),
}  # fmt: skip
"""Laws of the library that describe a disturbance to 95 % of its mean square or more, as near as `Criteria.law` asks a
law to be: the cube from the middle on is a hinge to 2 %, Bouc and Wen's hysteresis Dahl's to 1 %, the root a spring
that softens to 1.3 %, a linear one to 4.4 %, an imbalance to 1.7 to 4.3 % over the strokes that are drawn, a ripple of
order 2 to 1.2 % over 2 rad; a drag with the speed's power 1.5 is a quadratic one to 1.5 %."""

_LOST = 10.0
"""Strokes from its origin beyond which a drive is lost."""

UNKNOWN: Mapping[str, Hidden] = {
    "hysteresis": lambda s, x, r: {"hysteresis": x * s.F, "hysteresis_reach": 0.2 * s.Q},
    "thickening": lambda s, x, r: {"thickening": x * s.F / s.V**1.5},
    "warming": lambda s, x, r: {"warming": 5.0 * x},
    "bending": lambda s, x, r: {"bending": 2.0 * x * s.F},
    "streaked": lambda s, x, r: {"streaked": 2.0 * x * s.F / s.V},
    "stick_growth": lambda s, x, r: {"stick_growth": x * s.F},
    "cable": lambda s, x, r: {"cable": 3.0 * x * s.F},
    "shuttle": lambda s, x, r: {"shuttle": 5.0 * x * s.F, "shuttle_place": r.uniform(-0.5, 0.5)},
    "sag": lambda s, x, r: {"sag": x * s.F},
    "swing": lambda s, x, r: {"swing": 20.0 * x * s.F},
}
"""What is in no library, likewise."""

TUNED = ("hysteresis", "warming", "streaked", "cable", "sag")
"""Kinds of disturbance that anything may be tuned on; the others judge."""


@dataclass(frozen=True, eq=False)
class Case:
    """One case.

    Attributes
    ----------
    number : int
    drive : Drive
    records : tuple of Record
    hidden, unknown : tuple of str
        Effects of the library, and disturbances that are in none.
    noise : float
        Over the rms force.
    """

    number: int
    drive: Drive
    records: tuple[Record, ...]
    hidden: tuple[str, ...]
    unknown: tuple[str, ...]
    noise: float


def draw(seed: int, number: int, kinds: Sequence[str] = tuple(UNKNOWN)) -> Case:
    """Case `number` of a seed, with disturbances of these kinds."""
    rng = np.random.default_rng([seed, number])
    rotary = bool(rng.random() < 0.4)
    strength = 10.0 ** rng.uniform(-2.0, 2.0)
    stroke = float(rng.uniform(0.6, 3.0)) if rotary else 10.0 ** rng.uniform(-2.0, 0.5)
    motions = [
        stroke * reference(str(rng.choice(KINDS)), round(_SECONDS * _RATE), rng.uniform(3.0, 7.0), rng)
        for _ in range(rng.integers(1, 4))
    ]
    accelerated = float(np.std(np.gradient(np.gradient(motions[0], 1.0 / _RATE), 1.0 / _RATE)))
    mass = strength / accelerated
    speed = float(np.std(np.gradient(motions[0], 1.0 / _RATE)))
    base = {"mass": mass, "viscous": 0.4 * strength / speed, "coulomb": 0.3 * strength if rng.random() < 0.5 else 0.0}
    plain = [_run(base, motion) for motion in motions]
    force = float(np.sqrt(np.mean(np.concatenate([run.force for run in plain]) ** 2)))
    sizes = Sizes(force, 0.5 * stroke, speed, mass, base["coulomb"])
    noise = 10.0 ** rng.uniform(np.log10(0.003), np.log10(0.03))
    able = [name for name in HIDDEN if rotary or name != "load.imbalance"]
    able = [name for name in able if not (name == "friction.coulomb" and base["coulomb"])]
    # dry friction that differs from place to place or between directions does so beside some that is there: it never
    # drives
    beside = ("friction.asymmetric", "friction.position")
    able = [name for name in able if base["coulomb"] or name not in beside]
    hidden, unknown, runs = _acting(rng, able, kinds, base, sizes, noise, motions)
    every = round(_RATE / rng.choice(_RATES))
    unit = ("rad", "N m") if rotary else ("m", "N")
    records = []
    for k, (values, run) in enumerate(runs):
        step = stroke / 10.0 ** rng.uniform(4.5, 6.0)
        q = step * np.round(run.q / step)
        read = run.force + noise * force * rng.standard_normal(len(run.force)) + _read(values, run.t)
        rows = {"q": q[::every], "force": read[::every]}
        held = k == len(motions) - 1 and k > 0
        records.append(Record(f"record {k + 1}", _RATE / every, rows, {"q": unit[0], "force": unit[1]}, held))
    return Case(number, _drive(base, rng, unit), tuple(records), hidden, unknown, float(noise))


def _acting(
    rng: np.random.Generator, able: Sequence[str], kinds: Sequence[str], base: Mapping[str, float], sizes: Sizes,
    noise: float, motions: Sequence[np.ndarray],
) -> tuple[tuple[str, ...], tuple[str, ...], list[tuple[dict[str, float], Run]]]:  # fmt: skip
    """What is hidden and what disturbs, and each motion's run with all of it; drawn again where the controller, which
    knows nothing of it, loses the drive."""
    while True:
        hidden = _chosen(rng, able, int(rng.choice([0, 1, 2], p=[0.2, 0.6, 0.2])))
        unknown = tuple(
            str(k) for k in rng.choice(list(kinds), int(rng.integers(0, min(3, len(kinds) + 1))), replace=False)
        )
        values = dict(base)
        for name in hidden:
            values.update(HIDDEN[name](sizes, float(rng.uniform(0.1, 0.5)), rng))
        for name in unknown:
            values.update(UNKNOWN[name](sizes, noise * float(rng.uniform(0.5, 3.0)), rng))
        runs = [_run(values, motion) for motion in motions]
        if all(np.abs(run.q).max() < _LOST * np.ptp(motion) for run, motion in zip(runs, motions, strict=True)):
            return hidden, unknown, [(values, run) for run in runs]


def _chosen(rng: np.random.Generator, names: Sequence[str], count: int) -> tuple[str, ...]:
    """So many different effects that do not use the same part of the plant."""
    found: list[str] = []
    while len(found) < count:
        name = str(rng.choice(list(names)))
        masses = {"play.contact", "compliance"}
        times, even = {"delay", "loop_lag"}, {"offset", "friction.asymmetric"}
        clash = any(name == f or {name, f} <= masses or {name, f} <= times or {name, f} <= even for f in found)
        if not clash:
            found.append(name)
    return tuple(found)


def _run(values: Mapping[str, float], motion: np.ndarray) -> Run:
    plant = {k: v for k, v in values.items() if k not in ("delay", "lag", "hum", "hum_frequency", "drift")}
    whole = plant["mass"] + plant.get("load", 0.0)
    gains = (whole * _BANDWIDTH**2, 1.6 * whole * _BANDWIDTH)
    slow = 4.0 if values.get("delay") or values.get("lag") else 1.0
    gains = (gains[0] / slow**2, gains[1] / slow)
    return simulate_plant(
        plant, motion, _RATE, gains, delay=int(values.get("delay", 0)), lag=values.get("lag", 0.0), steps=25
    )


def _read(values: Mapping[str, float], t: np.ndarray) -> np.ndarray:
    hum = values.get("hum", 0.0) * np.sin(2.0 * np.pi * values.get("hum_frequency", 1.0) * t)
    return hum + values.get("drift", 0.0) * t


def _drive(base: Mapping[str, float], rng: np.random.Generator, unit: tuple[str, str]) -> Drive:
    """The drive as its owner would describe it: mass and drag nearly right, dry friction where there is some."""
    mass = base["mass"] * (1.0 + 0.15 * rng.uniform(-1.0, 1.0))
    drag = base["viscous"] * (1.0 + 0.3 * rng.uniform(-1.0, 1.0))
    parameters = (
        known_parameter("mass", "kg", mass, 0.15 * mass),
        known_parameter("drag", "N s/m", drag, 0.3 * drag),
    )
    known = {}
    if base["coulomb"]:
        known = {"friction.coulomb": {"force": base["coulomb"] * (1.0 + 0.3 * rng.uniform(-1.0, 1.0))}}
    channels = {"q": Channel("q"), "force": Channel("f")}
    return Drive(
        Path("drawn.py"), "drawn", _force, parameters, channels, tuple(EFFECTS.values()), known=known,
    )  # fmt: skip


def _force(q, v, a, u, t, p):
    return p.mass * a + p.drag * v
