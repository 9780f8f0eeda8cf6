"""The effect library as hypotheses: which parameters of an effect a fit may move, and where it may begin.

A phase would make a fit begin at several places. Sizes are therefore laid out as the scan of `naming` needs them: a
ladder for the parameter that has a null value, a few places for those that give its shape.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from discrepancy.model import Hypothesis, Parameter
from indexer_env.effects import EFFECTS, Effect, make_effect
from indexer_env.filters import BRACKET_LIMIT
from indexer_env.machine import Machine

_TURN = 2.0 * math.pi
_PHASES = tuple(_TURN * k / 6 for k in range(6))
_DENSE_PHASES = tuple(_TURN * k / 12 for k in range(12))
_PLACES = tuple(0.05 + 0.035 * k for k in range(13))


@dataclass(frozen=True)
class Move:
    """How a fit may move one parameter: `scale` of a step, bounds, values to begin with."""

    scale: float
    starts: tuple[float, ...]
    low: float | None = None
    high: float | None = None


def _ladder(unit: float, steps: int, *, factor: float = 3.0, both: bool = False) -> tuple[float, ...]:
    up = tuple(unit * factor**k for k in range(steps))
    return up + tuple(-size for size in up) if both else up


_HALF_WIDTHS = Move(0.03, (0.06, 0.12), 0.01, 0.3)
_BRACKETS = tuple(1.0 / (_TURN * f) ** 2 for f in (16, 19, 22, 25, 29, 34, 40, 48, 60, 75, 95, 130, 180))
_PHASE = Move(0.5, _PHASES)

MOVES: Mapping[str, Mapping[str, Move]] = {
    "friction.coulomb": {"torque": Move(10.0, _ladder(3.0, 5))},
    "friction.viscous": {"coefficient": Move(10.0, _ladder(3.0, 5))},
    "friction.stribeck": {"torque": Move(10.0, _ladder(5.0, 4)), "speed": Move(0.05, (0.05, 0.2), 0.01, 0.4)},
    "load.imbalance": {"torque": Move(10.0, _ladder(12.0, 9, factor=1.55)), "phase": Move(0.5, _DENSE_PHASES)},
    "load.process": {
        "torque": Move(10.0, (30.0, 120.0, -30.0, -120.0)),
        # 25 ms apart at the reference speed: at half a period of the ringing the other sign fits as well
        "centre": Move(0.05, tuple(0.5125 + 0.025 * k for k in range(20)), 0.5, 1.0),
        "half_width": _HALF_WIDTHS,
    },
    "drive.slip": {"compliance": Move(0.05, _ladder(0.05, 5), 1e-3)},
    "drive.speed_ripple": {"depth": Move(0.002, _ladder(0.001, 4), 0.0, 0.1), "phase": _PHASE},
    "drive.transmission_error": {"amplitude": Move(1e-4, _ladder(1e-4, 4), 0.0, 0.01), "phase": _PHASE},
    "drive.mesh_stiffness": {"depth": Move(0.05, (0.05, 0.15, 0.4), 0.0, 0.9), "phase": _PHASE},
    "cam.profile_error": {
        "height": Move(1e-4, _ladder(1.5e-4, 5, factor=2.0, both=True), -0.01, 0.01),
        "centre": Move(0.02, _PLACES, 0.0, 0.5),
        "half_width": _HALF_WIDTHS,
    },
    "cam.station_spacing": {"error": Move(3e-4, _ladder(3e-4, 5, both=True), -0.06, 0.06)},
    "roller.crack": {"stiffness_loss": Move(0.05, (0.05, 0.15, 0.4, 0.7), 0.0, 0.95)},
    "roller.crack_single": {"stiffness_loss": Move(0.05, (0.1, 0.2, 0.35, 0.5, 0.65, 0.8), 0.0, 0.95)},
    "input.backlash": {"backlash": Move(2e-4, _ladder(2e-4, 5), 0.0, 0.05)},
    "output.backlash": {"backlash": Move(1e-4, _ladder(3e-5, 5), 0.0, 0.01)},
    "output.cubic_stiffness": {"stiffness": Move(1e8, _ladder(1e8, 8, factor=2.0), 0.0, 1e12)},
    "base.looseness": {
        "compliance": Move(5e-8, _ladder(5e-8, 10, factor=2.0), 1e-8, 5e-5),
        "damping_ratio": Move(0.05, (0.05,), 0.0, 1.0),
    },
    "sensor.gain": {"error": Move(0.02, (0.03, -0.03, 0.1, -0.1))},
    "sensor.lowpass": {"time_constant": Move(5e-4, _ladder(1e-3, 3), 4e-4, 0.05)},
    "sensor.bracket_resonance": {
        "inverse_square": Move(2e-7, _BRACKETS, 2.6e-7, 1e-3),
        "damping": Move(0.02, (0.015, 0.05), 0.002, 0.3),
    },
    "sensor.mains_hum": {"amplitude": Move(0.1, _ladder(0.05, 4))},
    "sensor.offset_drift": {"rate": Move(0.01, (0.02, -0.02))},
}

_SEEN = 0.99 * BRACKET_LIMIT
"""Highest frequency of a sensor's filter that is looked for, over the sampling rate."""

_CHOICES = {"cam.station_spacing": "station", "roller.crack_single": "station"}


def library(machine: Machine, known: tuple[str, ...], rate: float) -> dict[str, tuple[Hypothesis, ...]]:
    """Hypotheses of each effect but those the machine already has (`known`), for records sampled at `rate` [Hz]."""
    found: dict[str, tuple[Hypothesis, ...]] = {}
    for name, moves in MOVES.items():
        if name in known:
            continue
        moves = {field: _seen(field, move, rate) for field, move in moves.items()}
        parameters = tuple(_parameter(name, field, move) for field, move in moves.items())
        starts = tuple(itertools.product(*(move.starts for move in moves.values())))
        choice = _CHOICES.get(name)
        fixed = [{choice: k} for k in range(machine.stations)] if choice else [{}]
        found[name] = tuple(Hypothesis(name, parameters, values, starts) for values in fixed)
    return found


def effect_of(hypothesis: Hypothesis, values: Mapping[str, float]) -> Effect:
    """The effect a hypothesis stands for at these parameter values."""
    start = f"{hypothesis.name}."
    own = {name.removeprefix(start): value for name, value in values.items() if name.startswith(start)}
    return make_effect(hypothesis.name, {**own, **hypothesis.fixed})


def _seen(name: str, move: Move, rate: float) -> Move:
    """A move of a sensor's filter, kept where its frequency is seen at this sampling rate; any other one as it is."""
    fastest = 1.0 / (_TURN * _SEEN * rate)
    low = {"time_constant": fastest, "inverse_square": fastest**2}.get(name)
    if low is None or move.low is None or low <= move.low:
        return move
    return replace(move, low=low, starts=tuple(start for start in move.starts if start >= low))


def _parameter(effect: str, name: str, move: Move) -> Parameter:
    rules = next(field.metadata for field in fields(EFFECTS[effect]) if field.name == name)
    low = max(move.low if move.low is not None else -math.inf, -math.inf if rules["low"] is None else rules["low"])
    high = min(move.high if move.high is not None else math.inf, math.inf if rules["high"] is None else rules["high"])
    start = rules["null"] if rules["null"] is not None else move.starts[0]
    return Parameter(f"{effect}.{name}", rules["unit"], min(max(start, low), high), move.scale, low, high)
