"""What every item of a data set starts from, and its quantities by path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from datagen.changes import value_at
from datagen.quantities import FIELDS
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


@dataclass(frozen=True)
class Base:
    """What every item of a data set starts from."""

    machine: Machine
    operating_point: OperatingPoint
    faults: Faults = Faults()
    sensor: Sensor = Sensor()


def base_value(base: Base, path: str) -> Any:
    """A quantity of the base; None where it lacks the effect."""
    section, _, rest = path.partition(".")
    if section != "effects":
        return value_at(getattr(base, section), rest)
    name, _, parameter = rest.rpartition(".")
    own = next((effect for effect in base.machine.effects if effect.name == name), None)
    return None if own is None else getattr(own, parameter)


def fault_values(base: Base) -> dict[str, Any]:
    """The quantities of the base that count as faults, by path."""
    values = {f"faults.{name}": getattr(base.faults, name) for name in FIELDS["faults"]}
    for effect in (one for one in base.machine.effects if not one.is_null):
        values |= {f"effects.{effect.name}.{name}": value for name, value in vars(effect).items()}
    return values
