"""The effect library as hypotheses: what each effect says of its own search (`indexer_env.effects.base.Sought`), in the
numbers of one machine and its records."""

from __future__ import annotations

import itertools
import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from discrepancy.indexer.advance import FINEST
from discrepancy.indexer.lines import MOST
from discrepancy.model import Hypothesis, Parameter
from indexer_env.effects import EFFECTS, LOADABLE, Effect
from indexer_env.effects.base import Sought
from indexer_env.filters import BRACKET_LIMIT, LOWEST
from indexer_env.machine import Machine

_TURN = 2.0 * math.pi

ORDERS = (1.0, 2.0, 3.0)
"""Orders of the motor shaft that are looked at whatever the records show: an eccentric gear, worms of few threads. What
the torque modulates, as a mesh's stiffness, stands beside its order and not at it."""

MAINS = (50.0, 60.0)
"""Frequencies of hum that are looked for whatever the records show [Hz]."""

_WANDER = 0.01
"""How far a line may stand from the mains' frequency to be hum: a grid keeps it within 0.4 %, a logger's clock may be
off by as much. What shakes the machine at any other frequency is not hum."""

HOUSING = "housing_inertia"
"""A parameter of the machine that takes part only where the base is loose."""

_HOUSING_SPREAD = 0.2
"""Relative standard deviation with which the housing's inertia is known: nothing that a tight machine does tells it."""

_LAWS = {
    "friction.viscous": "tabulated.speed", "load.imbalance": "tabulated.angle",
    "output.cubic_stiffness": "tabulated.deflection",
}  # fmt: skip
"""Effects whose torque on the table is a smooth law of one variable, and the table over it."""

_FINER = (1.0 / 3.0, 1.0 / 9.0)
"""Parts of its smallest sizes from which an effect starts, too: what little noise there is shows less than they do."""

_LOW, _HIGH = 1.01 * LOWEST, 0.99 * BRACKET_LIMIT
"""Lowest and highest frequency of a sensor's filter that is looked for, over the sampling rate."""


@dataclass(frozen=True)
class Seen:
    """What makes the library's numbers those of one machine and its records.

    Attributes
    ----------
    measures : mapping
        SI values of `indexer_env.effects.measures.MEASURES`.
    rate : float
        Sampling rate [Hz].
    unit : str
        Of the sensor's reading.
    orders, hums : tuple of float
        Orders of the motor shaft and frequencies [Hz] at which lines stand in what is left, the strongest first: of
        each kind that an effect may have MOST are looked at, beside ORDERS and MAINS.
    """

    measures: Mapping[str, float]
    rate: float
    unit: str = "unit of the signal"
    orders: tuple[float, ...] = ()
    hums: tuple[float, ...] = ()


def library(machine: Machine, known: Container[str], seen: Seen) -> dict[str, tuple[Hypothesis, ...]]:
    """Hypotheses of each effect but those the machine already has (`known`) and those that records of this rate cannot
    show."""
    found = {name: _hypotheses(machine, effect, seen) for name, effect in EFFECTS.items() if name not in known}
    return {name: hypotheses for name, hypotheses in found.items() if hypotheses}


def effect_of(hypothesis: Hypothesis, values: Mapping[str, float]) -> Effect:
    """The effect that a single hypothesis stands for at these parameter values."""
    start = f"{hypothesis.name}."
    own = {p.name.removeprefix(start): values[p.name] for p in hypothesis.parameters if p.name.startswith(start)}
    return LOADABLE[hypothesis.name](**own, **hypothesis.fixed)


def _hypotheses(machine: Machine, effect: type[Effect], seen: Seen) -> tuple[Hypothesis, ...]:
    parameters: list[Parameter] = []
    starts: list[Sequence[float]] = []
    choices: dict[str, Sequence[float]] = {}
    series = ""
    for field in fields(effect):
        sought: Sought | None = field.metadata["sought"]
        if sought is None:
            continue
        series = series or sought.series
        if sought.starts:
            least = FINEST / (2.0 * machine.motor_inertia) if effect.name == "drive.slip" else -math.inf
            parameter, values = _parameter(effect.name, field.name, field.metadata, sought, seen, least)
            if parameter is None:
                return ()
            parameters.append(parameter)
            starts.append(values)
        else:
            choices[field.name] = _choices(field.name, machine, seen)
    if effect.name == "base.looseness":
        value, reach = machine.housing_inertia, math.exp(3.0 * _HOUSING_SPREAD)
        spread = _HOUSING_SPREAD
        parameters.append(
            Parameter(HOUSING, "kg m²", value, spread, value / reach, value * reach, known=True, logarithmic=True)
        )
        starts.append((value,))
    laid_out = tuple(itertools.product(*starts))
    return tuple(
        Hypothesis(
            effect.name,
            tuple(parameters),
            dict(zip(choices, chosen, strict=True)),
            laid_out,
            effect.alike,
            over=_LAWS.get(effect.name, ""),
            series=series,
        )
        for chosen in itertools.product(*choices.values())
    )


def _choices(name: str, machine: Machine, seen: Seen) -> Sequence[float]:
    """What a discrete choice may be."""
    if name == "station":
        return range(machine.stations)
    if name == "order":
        return sorted({*ORDERS, *seen.orders[:MOST]})
    hums = [f for f in seen.hums if any(abs(f / mains - 1.0) < _WANDER for mains in MAINS)]
    return sorted(f for f in {*MAINS, *hums[:MOST]} if f < 0.5 * seen.rate)


def _parameter(
    effect: str, name: str, rules: Mapping[str, Any], sought: Sought, seen: Seen, least: float
) -> tuple[Parameter | None, tuple[float, ...]]:
    """A parameter and its starts [its unit], none below the `least` value that can be simulated; None where it can have
    no value."""
    unit = seen.measures[sought.measure]
    bounds = [(sought.low, rules["low"], max, -math.inf), (sought.high, rules["high"], min, math.inf)]
    low, high = (
        pick(end if own is None else own * unit, end if rule is None else rule) for own, rule, pick, end in bounds
    )
    # a filter of the sensor shows where the sampling rate lets its frequency through
    fastest = 1.0 / (_TURN * _HIGH * seen.rate)
    reach = {"time_constant": fastest, "inverse_square": fastest**2, "corner": _TURN * _LOW * seen.rate}
    low = max(low, reach.get(name, -math.inf), least)
    if low > high:
        return None, ()
    sizes = sought.starts
    if rules["null"] is not None:
        least = min(abs(size) for size in sizes)
        sizes += tuple(size * part for part in _FINER for size in sizes if abs(size) == least)
    starts = tuple(min(start * unit, high) for start in sizes if start * unit >= low)
    null = rules["null"] if rules["null"] is not None else sought.starts[0] * unit
    nominal = min(max(null, low), high)
    told = rules["unit"].replace("unit of the signal", seen.unit)
    parameter = Parameter(f"{effect}.{name}", told, nominal, sought.step * unit, low, high, null=rules["null"])
    return parameter, starts or (low,)
