"""What an effect is: a frozen, self-checking object that adds one named piece of physics to the model.

Every parameter of an effect carries its unit, meaning and range; the one that measures the effect's size also carries
its null value. An effect at its null value leaves the machine's coefficients bit-equal to the machine without it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse

if TYPE_CHECKING:
    from indexer_env.machine import Machine
    from indexer_env.sensors import Sensor


@dataclass(frozen=True)
class Sought:
    """How a search on records moves a parameter, in the machine's own measure, so that no number is about one machine.

    Attributes
    ----------
    measure : str
        One of `indexer_env.effects.measures.MEASURES`, in which the other numbers count.
    starts : tuple of float
        Values at which fits may begin; nothing for a discrete choice.
    step : float
        A small change of it; 0 for a discrete choice.
    low, high : float or None
        Bounds of a fit, beside the parameter's own range.
    series : str
        The machine's stiffness with which it lies in series where it is a compliance; "" where it is none.
    """

    measure: str
    starts: tuple[float, ...] = ()
    step: float = 0.0
    low: float | None = None
    high: float | None = None
    series: str = ""


def ladder(first: float, rungs: int, factor: float = 3.0, *, both: bool = False) -> tuple[float, ...]:
    """Starts that grow from rung to rung by a factor; `both` adds those of the other sign."""
    up = tuple(first * factor**k for k in range(rungs))
    return up + tuple(-size for size in up) if both else up


LEAST_HALF_WIDTH = 0.01
"""Cam turns; what is over sooner no step of 0.25 ms resolves."""

PHASES = tuple(2.0 * math.pi * k / 6 for k in range(6))
"""Starts of a phase [rad]: a fit reaches either neighbour's half of the way."""


def parameter(
    meaning: str,
    unit: str,
    *,
    default: float | None = None,
    null: float | None = None,
    low: float | None = None,
    high: float | None = None,
    low_open: bool = False,
    high_open: bool = False,
    whole: bool = False,
    sought: Sought | None = None,
) -> Any:
    """A dataclass field of an effect: meaning, unit, range; `null` for the parameter that measures its size; `sought`
    where a search for the effect on records may move it."""
    metadata = {
        "meaning": meaning, "unit": unit, "null": null, "low": low, "high": high,
        "low_open": low_open, "high_open": high_open, "whole": whole, "sought": sought,
    }  # fmt: skip
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Effect:
    """Base of all effects.

    Class attributes
    ----------------
    name : str
        ``family.effect``, the name in YAML, tables and verdicts.
    sentence, equation, source, enters : str
        What it is, its equation in the symbols of the equation sheet, where that comes from, and which quantity of the
        model it enters.
    alike : tuple of str
        Effects that some records cannot tell from it.
    """

    name: ClassVar[str]
    sentence: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    enters: ClassVar[str]
    alike: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            rules, value = field.metadata, getattr(self, field.name)
            if rules["whole"]:
                check_integer(self.name, field.name, value, low=rules["low"], high=rules["high"], unit=rules["unit"])
            else:
                bounds = {key: rules[key] for key in ("low", "high", "low_open", "high_open", "unit")}
                check_number(self.name, field.name, value, **bounds)

    @property
    def is_null(self) -> bool:
        """True where the effect's size is at its null value: the machine is then bit-equal to one without it."""
        own = sizes(type(self))
        return bool(own) and all(getattr(self, field.name) == field.metadata["null"] for field in own)


class MachineEffect(Effect):
    """An effect that enters the equations of motion, through the coefficients of one machine."""

    models: ClassVar[tuple[str, ...]] = ("A", "B", "B_on_base")
    """The machine's models it can act in."""

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        """Write the effect into the coefficients: those that `coefficients.numbers_of` gives, no others."""
        raise TypeError(f"{type(self).__name__} must define extend().")


class SensorEffect(Effect):
    """An effect that enters the sensor chain."""

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        """The sensor with the effect in its chain."""
        raise TypeError(f"{type(self).__name__} must define extend_sensor().")

    @classmethod
    def of_sensor(cls, sensor: Sensor) -> Self | None:
        """What a sensor has of an effect that can grow on it; None: nothing, or an effect that does not."""
        return None


_E = TypeVar("_E", bound=Effect)

EFFECTS: dict[str, type[Effect]] = {}
"""All effects by name; filled by `register` when the families are imported (indexer_env.effects)."""


def sizes(effect: type[Effect]) -> list[dataclasses.Field]:
    """The parameters that measure an effect's size: those with a null value."""
    return [field for field in dataclasses.fields(effect) if field.metadata.get("null") is not None]


def register(effect: type[_E]) -> type[_E]:
    """Class decorator: enter an effect into `EFFECTS`; a class that is defined again replaces itself.

    Raises
    ------
    ParameterError
        An effect without a size, which would always count as null, or with a name that another one has.
    """
    if not sizes(effect):
        rule, remedy = "a dataclass's, one of them the effect's size", "give that one null=, the value without effect"
        raise refuse(effect.__name__, "parameters", rule, [field.name for field in dataclasses.fields(effect)], remedy)
    other = EFFECTS.setdefault(effect.name, effect)
    if (other.__module__, other.__qualname__) != (effect.__module__, effect.__qualname__):
        raise refuse(effect.__name__, "name", "one that no other effect has", effect.name, f"{other.__name__} has it")
    EFFECTS[effect.name] = effect
    return effect
