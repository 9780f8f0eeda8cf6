"""A case of the messy challenge: a drive of random size, what is hidden in it, and what no library has.

Everything is drawn from the seed and the case's number alone. Laws: force scale log-uniform over 10^±2, stroke over
10^-2 … 10^0.5 m or 0.6 … 3 rad; rate of 50 to 1000 Hz; 1 to 3 records of 12 s, each another motion; noise of 0.3 to 3 %
of the rms force; mass off by ± 15 %, viscous drag by ± 30 %. Hidden: 0, 1 or 2 effects of the library (20, 60, 20 %),
each of which by itself changes the force by 0.1 to 0.5 of its rms. Beside them 0 to 2 disturbances that are in no
library, each 0.5 to 3 times the noise, likewise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discrepancy.drives.channels import Record
from discrepancy.drives.description import Channel, Drive, known_parameter
from discrepancy.drives.effects import EFFECTS
from indexer_experiments.challenge.drives.laws import HIDDEN, UNKNOWN, Sizes
from indexer_experiments.challenge.drives.motions import KINDS, reference
from indexer_experiments.challenge.drives.plant import Run
from indexer_experiments.challenge.drives.sizes import RATE, SECONDS, run_drive, sized, sizes_of

VERSION = 2
"""Of the cases: raised by whatever makes another case of the same seed and number."""

_RATES = (50, 100, 250, 500, 1000)
_SHARES = (0.1, 0.5)
"""Of the rms force, by which a hidden effect changes the force."""
_TIMES = (0.5, 3.0)
"""The noise, by which a disturbance does."""

_LOST = 10.0
"""Strokes from its origin beyond which a drive is lost."""


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
        stroke * reference(str(rng.choice(KINDS)), round(SECONDS * RATE), rng.uniform(3.0, 7.0), rng)
        for _ in range(rng.integers(1, 4))
    ]
    speed = np.gradient(motions[0], 1.0 / RATE)
    mass, viscous = strength / float(np.std(np.gradient(speed, 1.0 / RATE))), 0.4 * strength / float(np.std(speed))
    base = {"mass": mass, "viscous": viscous, "coulomb": 0.3 * strength if rng.random() < 0.5 else 0.0}
    sizes = sizes_of(base, motions)
    noise = 10.0 ** rng.uniform(np.log10(0.003), np.log10(0.03))
    able = [name for name in HIDDEN if rotary or name != "load.imbalance"]
    able = [name for name in able if not (name == "friction.coulomb" and base["coulomb"])]
    # dry friction that differs from place to place or between directions does so beside some that is there: it never
    # drives
    beside = ("friction.asymmetric", "friction.position")
    able = [name for name in able if base["coulomb"] or name not in beside]
    hidden, unknown, runs = _acting(rng, able, kinds, base, sizes, noise, motions)
    every = round(RATE / rng.choice(_RATES))
    unit = ("rad", "N m") if rotary else ("m", "N")
    records = []
    for k, run in enumerate(runs):
        step = stroke / 10.0 ** rng.uniform(4.5, 6.0)
        q = step * np.round(run.q / step)
        read = run.force + noise * sizes.F * rng.standard_normal(len(run.force))
        rows = {"q": q[::every], "force": read[::every]}
        held = k == len(motions) - 1 and k > 0
        records.append(Record(f"record {k + 1}", RATE / every, rows, {"q": unit[0], "force": unit[1]}, held))
    return Case(number, _drive(base, rng, unit), tuple(records), hidden, unknown, float(noise))


def _acting(
    rng: np.random.Generator, able: Sequence[str], kinds: Sequence[str], base: Mapping[str, float], sizes: Sizes,
    noise: float, motions: Sequence[np.ndarray],
) -> tuple[tuple[str, ...], tuple[str, ...], list[Run]]:  # fmt: skip
    """What is hidden and what disturbs, and each motion's run with all of it; drawn again where a law cannot do what is
    asked, or where the controller, which knows nothing of it, loses the drive."""
    while True:
        hidden = _chosen(rng, able, int(rng.choice([0, 1, 2], p=[0.2, 0.6, 0.2])))
        unknown = tuple(
            str(k) for k in rng.choice(list(kinds), int(rng.integers(0, min(3, len(kinds) + 1))), replace=False)
        )
        asked = [(HIDDEN[name], _SHARES) for name in hidden]
        asked += [(UNKNOWN[name], (noise * _TIMES[0], noise * _TIMES[1])) for name in unknown]
        values = dict(base)
        for law, span in asked:
            found = sized(law, base, sizes, span, motions, rng)
            if found is None:
                break
            values.update(found)
        else:
            runs = [run_drive(values, motion) for motion in motions]
            if all(np.abs(run.q).max() < _LOST * np.ptp(motion) for run, motion in zip(runs, motions, strict=True)):
                return hidden, unknown, runs


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
