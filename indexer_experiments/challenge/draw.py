"""What is hidden in case k of a challenge: a function of the seed and k alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from indexer_env import load_machine
from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.effects import Effect, make_effect
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.units import DEGREE, at_cam

KINDS = ("single", "none", "outside", "two")
"""single: one effect of the library; none: nothing; outside: one effect that the library lacks in that case; two."""

PLAYS = ("healthy", "none", "5", "20")
"""Play of the nominal machine: its own 2 arc minutes, none, or so many degrees at the motor shaft."""

_SPREAD = 0.1
"""Half width of the uniform law of each machine parameter, relative."""

KNOWN_TO = dict.fromkeys(UNCERTAINTY, _SPREAD / math.sqrt(3.0))
"""What the search is told of it: the law's relative standard deviation."""

_TURN = 2.0 * math.pi
_STATION = "station"

_Law = float | tuple[float, float]

HIDDEN: Mapping[str, Mapping[str, _Law]] = {
    "friction.coulomb": {"torque": 1.7},
    "friction.viscous": {"coefficient": 27.0},
    "friction.stribeck": {"torque": 1.5, "speed": (0.04, 0.25)},
    "load.imbalance": {"torque": 48.0, "phase": (0.0, _TURN)},
    "load.process": {"torque": 26.0, "centre": (0.62, 0.88), "half_width": (0.06, 0.12)},
    "drive.slip": {"compliance": 0.75},
    "drive.speed_ripple": {"depth": 1.0e-3, "phase": (0.0, _TURN)},
    "drive.transmission_error": {"amplitude": 2.1e-4, "phase": (0.0, _TURN)},
    "drive.mesh_stiffness": {"depth": 0.1, "phase": (0.0, _TURN)},
    "cam.profile_error": {"height": 2.1e-4, "centre": (0.08, 0.42), "half_width": (0.04, 0.12)},
    "cam.station_spacing": {"error": 4e-3, "station": (0.0, 7.0)},
    "roller.crack": {"stiffness_loss": 0.06},
    "roller.crack_single": {"stiffness_loss": 0.08, "station": (0.0, 7.0)},
    "input.backlash": {"backlash": 6e-4},
    "output.backlash": {"backlash": 4e-5},
    "output.cubic_stiffness": {"stiffness": 1e9},
    "base.looseness": {"compliance": 1.5e-6, "damping_ratio": (0.02, 0.1)},
    "sensor.gain": {"error": 0.02},
    "sensor.lowpass": {"time_constant": 4e-3},
    "sensor.bracket_resonance": {"inverse_square": 6e-6, "damping": (0.01, 0.06)},
    "sensor.mains_hum": {"amplitude": 0.2},
    "sensor.offset_drift": {"rate": 0.015},
    "drive.mesh_friction": {"loss": 0.08},
    "sensor.highpass": {"corner": 0.15},
}
"""Law of each parameter: the first one is the size at which the base model is left with a gap of about 1.4 (as much
misfit as noise); the others are uniform between their two values."""

_LARGEST = {"drive.mesh_stiffness": 0.35, "drive.mesh_friction": 0.45}
"""Largest size drawn, where a larger one shakes the machine to pieces, as an uneven mesh then drives it parametrically,
or locks it."""


@dataclass(frozen=True)
class Order:
    """What a challenge consists of.

    Attributes
    ----------
    count : int
        Cases, >= 1; effects are taken in turn, so that 24 hide each of the library once.
    seed : int
        >= 0.
    kind, play : str
        Of KINDS and PLAYS.
    gap : tuple of float
        Lowest and highest size, as misfit over noise of the base model; drawn log-uniform between them.
    turns : float
        Table turns of each record, >= 0.7, so that a case's records hold two in all.
    """

    count: int
    seed: int
    kind: str = "single"
    play: str = "healthy"
    gap: tuple[float, float] = (1.0, 10.0)
    turns: float = 1.2

    def __post_init__(self) -> None:
        check_integer("challenge", "count", self.count, low=1)
        check_integer("challenge", "seed", self.seed, low=0)
        check_choice("challenge", "kind", self.kind, KINDS)
        check_choice("challenge", "play", self.play, PLAYS)
        if len(self.gap) != 2:
            raise refuse("challenge", "gap", "two numbers, the lowest and the highest", self.gap, "write gap=[1,10]")
        check_number("challenge", "gap[0]", self.gap[0], low=0.0, low_open=True)
        check_number("challenge", "gap[1]", self.gap[1], low=self.gap[0])
        check_number("challenge", "turns", self.turns, low=0.7, unit="table turns")


@dataclass(frozen=True)
class Draw:
    """One case.

    Attributes
    ----------
    number : int
    nominal, truth : Machine
        What the search is told, and what it is; without the hidden effects.
    hidden : tuple of Effect
    removed : tuple of str
        Effects taken out of the library.
    rng : Generator
        For the records that follow.
    """

    number: int
    nominal: Machine
    truth: Machine
    hidden: tuple[Effect, ...]
    removed: tuple[str, ...]
    rng: np.random.Generator


def nominal_machine(play: str) -> Machine:
    """The reference machine with its play replaced."""
    machine = load_machine("reference")
    if play == "healthy":
        return machine
    degrees = {"none": 0.0, "5": 5.0, "20": 20.0}[play]
    return changed(machine, {"input_joint.backlash": at_cam(degrees * DEGREE, machine.reduction)})


def draw(order: Order, number: int) -> Draw:
    """Case `number` of a challenge."""
    key = (KINDS.index(order.kind), PLAYS.index(order.play), number)
    rng = np.random.default_rng(np.random.SeedSequence(order.seed, spawn_key=key))
    nominal = nominal_machine(order.play)
    factors = {name: 1.0 + _SPREAD * rng.uniform(-1.0, 1.0) for name in UNCERTAINTY}
    truth = changed(nominal, {name: read(nominal, name) * factor for name, factor in factors.items()})
    names = list(HIDDEN)
    chosen: tuple[str, ...] = ()
    if order.kind in ("single", "outside"):
        chosen = (names[number % len(names)],)
    elif order.kind == "two":
        first, second = rng.choice(len(names), 2, replace=False)
        chosen = names[first], names[second]
    hidden = tuple(_effect(name, order.gap, rng) for name in chosen)
    return Draw(number, nominal, truth, hidden, chosen if order.kind == "outside" else (), rng)


def _effect(name: str, gap: tuple[float, float], rng: np.random.Generator) -> Effect:
    """An effect, its size log-uniform over the gaps asked for, its shape uniform."""
    size = math.exp(rng.uniform(math.log(gap[0]), math.log(gap[1])))
    drawn: dict[str, float] = {}
    for parameter, law in HIDDEN[name].items():
        if not isinstance(law, tuple):
            drawn[parameter] = min(size * law, _LARGEST.get(name, math.inf))
        elif parameter == _STATION:
            drawn[parameter] = int(rng.integers(int(law[0]), int(law[1]) + 1))
        else:
            drawn[parameter] = rng.uniform(*law)
    return make_effect(name, drawn)
