"""What was found of a machine when its twin was made, to be fitted anew: its parameters free about what they were."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from discrepancy.indexer.library import Seen, library
from discrepancy.model import Hypothesis, Parameter
from indexer_env.effects import EFFECTS, MachineEffect
from indexer_env.effects.measures import measures
from indexer_env.machine import Machine
from indexer_env.operating_point import REFERENCE_MOTOR_SPEED

_FROM_DAY_TO_DAY = 0.2
"""Relative standard deviation of an effect that the machine had when it was healthy [-]: more of it is a fault, which
the records must show, and not what the search begins with."""


def of_machine(row: Mapping[str, Any]) -> bool:
    """Whether a finding (effect, values) is one of the machine and not of its sensor."""
    return issubclass(EFFECTS[row["effect"]], MachineEffect)


def freed(
    machine: Machine, found: Sequence[Mapping[str, Any]], without: Sequence[str] = ()
) -> tuple[Machine, tuple[Hypothesis, ...]]:
    """The machine without these findings, and each of them as a hypothesis that the machine is known to have; `without`
    are effects that are not looked for."""
    names = {row["effect"] for row in found}
    plain = dataclasses.replace(machine, effects=tuple(e for e in machine.effects if e.name not in names))
    return plain, tuple(_about(plain, row, without) for row in found)


def _about(machine: Machine, row: Mapping[str, Any], without: Sequence[str]) -> Hypothesis:
    """An effect that the machine has, its parameters free about what they were, and all else of it as it was."""
    seen = Seen(measures(machine, REFERENCE_MOTOR_SPEED), 1000.0)
    hypothesis = library(machine, tuple(without), seen)[row["effect"]][0]
    start = f"{hypothesis.name}."
    sought = {p.name.removeprefix(start) for p in hypothesis.parameters}
    # twin.yaml holds whole numbers as floats
    fixed = {n: type(hypothesis.fixed.get(n, v))(v) for n, v in row["values"].items() if n not in sought}

    def about(p: Parameter) -> Parameter:
        if not p.name.startswith(start):
            return p  # a number of the machine that the effect brings into play
        value = float(row["values"][p.name.removeprefix(start)])
        return dataclasses.replace(
            p,
            nominal=min(max(value, p.low), p.high),
            known=True,
            scale=max(_FROM_DAY_TO_DAY * abs(value), p.scale / 20.0),
        )

    return Hypothesis(hypothesis.name, tuple(about(p) for p in hypothesis.parameters), fixed, ((),))
