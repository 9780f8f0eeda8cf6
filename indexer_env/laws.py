"""Laws of chance, as YAML names them beside a drawn quantity; episodes and data sets draw by the same ones.

Every law turns ONE number u, uniform in [0, 1), into a value (inverse transform), so that whatever a quantity's law, it
takes one draw and never shifts another quantity. In YAML:

    0.3                              fixed; takes no draw
    {uniform: [low, high]}           low + (high - low) u
    {log_uniform: [low, high]}       low (high / low)^u
    {normal: [mean, sd]}             mean + sd Φ⁻¹(u)
    {choice: [a, b, ...]}            each as likely; an entry may be a law, {choice: [0, {uniform: [5, 20]}]}
    {around: share}                  nominal (1 + share (2u - 1)): ±10 % for 0.1; {around: [nominal, share]} where none
    {sobol: [low, high]}             as uniform, u from a Sobol' sequence that a data set's sobol laws share
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.special import ndtri

from indexer_env.build import field_of
from indexer_env.checks import check_number, did_you_mean
from indexer_env.errors import refuse

_LEAST, _MOST = 2.0**-54, 1.0 - 2.0**-53
"""Stands for u = 0, where Φ⁻¹ is infinite (half of the smallest step of u); the largest u below 1."""


class Law(ABC):
    """A law of chance for one quantity, in that quantity's unit."""

    form: ClassVar[str]
    """How it stands in YAML."""

    @abstractmethod
    def at(self, u: float, nominal: Any = None) -> Any:
        """The value for u in [0, 1); `nominal` is what the quantity is without the law."""

    def draw(self, rng: np.random.Generator, nominal: Any = None) -> Any:
        """One value, for one draw of the generator."""
        return self.at(float(rng.random()), nominal)

    @property
    @abstractmethod
    def extremes(self) -> tuple[Any, ...]:
        """The values at which a check must pass so that every value passes it."""

    @property
    def lists(self) -> bool:
        """Whether `extremes` are all the values there are."""
        return False

    @property
    @abstractmethod
    def centre(self) -> Any:
        """A value in the middle of the law, for what must be known before anything is drawn."""

    @abstractmethod
    def scaled(self, factor: float) -> Law:
        """The law of the quantity times a factor > 0 (degrees to radians)."""


@dataclass(frozen=True)
class Fixed(Law):
    """The same value always; it takes nothing from the generator."""

    form: ClassVar[str] = "a value"
    value: Any

    def at(self, u: float, nominal: Any = None) -> Any:
        return self.value

    def draw(self, rng: np.random.Generator, nominal: Any = None) -> Any:
        return self.value

    @property
    def extremes(self) -> tuple[Any, ...]:
        return (self.value,)

    @property
    def lists(self) -> bool:
        return True

    @property
    def centre(self) -> Any:
        return self.value

    def scaled(self, factor: float) -> Law:
        return Fixed(_times(self.value, factor))


@dataclass(frozen=True)
class _Interval(Law):
    """A law between two values, low <= high."""

    low: float
    high: float

    @property
    def extremes(self) -> tuple[Any, ...]:
        return (self.low, self.high)

    def scaled(self, factor: float) -> Law:
        return type(self)(self.low * factor, self.high * factor)


@dataclass(frozen=True)
class Uniform(_Interval):
    """low + (high - low) u."""

    form: ClassVar[str] = "{uniform: [low, high]}"

    def at(self, u: float, nominal: Any = None) -> float:
        return self.low + (self.high - self.low) * u

    @property
    def centre(self) -> float:
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True)
class Sobol(_Interval):
    """low + (high - low) u, u from the data set's Sobol' sequence, in which this quantity is one dimension."""

    form: ClassVar[str] = "{sobol: [low, high]}"

    def at(self, u: float, nominal: Any = None) -> float:
        return self.low + (self.high - self.low) * u

    @property
    def centre(self) -> float:
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True)
class LogUniform(_Interval):
    """low (high / low)^u: each octave as likely; 0 < low."""

    form: ClassVar[str] = "{log_uniform: [low, high]}"

    def at(self, u: float, nominal: Any = None) -> float:
        return self.low * (self.high / self.low) ** u

    @property
    def centre(self) -> float:
        return math.sqrt(self.low * self.high)


@dataclass(frozen=True)
class Normal(Law):
    """mean + sd Φ⁻¹(u); u has 53 bits, so no value lies farther than 8.3 sd from the mean."""

    form: ClassVar[str] = "{normal: [mean, sd]}"
    mean: float
    sd: float

    def at(self, u: float, nominal: Any = None) -> float:
        return self.mean + self.sd * float(ndtri(max(u, _LEAST)))

    @property
    def extremes(self) -> tuple[Any, ...]:
        return (self.at(0.0), self.at(_MOST))

    @property
    def centre(self) -> float:
        return self.mean

    def scaled(self, factor: float) -> Law:
        return Normal(self.mean * factor, self.sd * factor)


@dataclass(frozen=True)
class Choice(Law):
    """One of the values, each as likely; an entry that is a law draws from what u leaves after the choice."""

    form: ClassVar[str] = "{choice: [value, ...]}"
    values: tuple[Any, ...]

    def at(self, u: float, nominal: Any = None) -> Any:
        place = u * len(self.values)
        index = min(int(place), len(self.values) - 1)
        chosen = self.values[index]
        # (u n) mod 1 is again uniform, so that a law inside takes no second draw.
        return chosen.at(min(place - index, _MOST), nominal) if isinstance(chosen, Law) else chosen

    @property
    def extremes(self) -> tuple[Any, ...]:
        return tuple(end for entry in self.values for end in (entry.extremes if isinstance(entry, Law) else (entry,)))

    @property
    def lists(self) -> bool:
        return not any(isinstance(entry, Law) for entry in self.values)

    @property
    def centre(self) -> Any:
        return self.values[0].centre if isinstance(self.values[0], Law) else self.values[0]

    def scaled(self, factor: float) -> Law:
        return Choice(tuple(_times(entry, factor) for entry in self.values))


@dataclass(frozen=True)
class Around(Law):
    """nominal (1 + share (2u - 1)), the paper's ±10 % for share 0.1 (paper.txt, section 4.1); share 0 keeps the nominal
    value. A nominal value of its own serves where the quantity has none."""

    form: ClassVar[str] = "{around: share}"
    share: float
    nominal: float | None = None

    def at(self, u: float, nominal: Any = None) -> float:
        middle = self.nominal if self.nominal is not None else nominal
        return middle * (1.0 + self.share * (2.0 * u - 1.0))

    @property
    def extremes(self) -> tuple[Any, ...]:
        return () if self.nominal is None else (self.at(0.0), self.at(1.0))

    @property
    def centre(self) -> float | None:
        return self.nominal

    def scaled(self, factor: float) -> Law:
        return Around(self.share, None if self.nominal is None else self.nominal * factor)


LAWS: dict[str, type[Law]] = {
    "uniform": Uniform,
    "log_uniform": LogUniform,
    "normal": Normal,
    "choice": Choice,
    "around": Around,
    "sobol": Sobol,
}
"""Law by its name in YAML."""


def is_law(given: object) -> bool:
    """Whether this is a law other than a plain value: ``{NAME: ...}`` with NAME in LAWS."""
    return isinstance(given, Mapping) and len(given) == 1 and next(iter(given)) in LAWS


def make_law(owner: str, name: str, given: object) -> Law:
    """The law of what stands beside a quantity in YAML.

    Raises
    ------
    ParameterError
        No law of this name, or parameters that break its rule; the sentence begins with ``owner.name``.
    """
    if not isinstance(given, Mapping):
        return Fixed(given)
    if not is_law(given):
        forms = ", ".join(law.form for law in LAWS.values())
        hint = did_you_mean(next(iter(given)), LAWS) if len(given) == 1 else ""
        raise refuse(owner, name, f"a value or one of {forms}", dict(given), hint)
    ((key, values),) = given.items()
    law = LAWS[key]
    if law is Around and not isinstance(values, list | tuple):
        check_number(owner, name, values, low=0.0, unit="-", remedy="{around: 0.1} stands for ±10 %")
        return Around(float(values))
    if not isinstance(values, list | tuple) or not values:
        raise refuse(owner, name, law.form, dict(given))
    if law is Choice:
        return Choice(tuple(_entry(owner, name, entry) for entry in values))
    for value in values:
        check_number(owner, name, value)
    rule, fits = _RULES[law]
    if len(values) != 2 or not fits(*values):
        raise refuse(owner, name, f"{law.form} with {rule}", dict(given))
    first, second = float(values[0]), float(values[1])
    return Around(second, first) if law is Around else law(first, second)  # type: ignore[call-arg]


_RULES: dict[type[Law], tuple[str, Any]] = {
    Uniform: ("low <= high", lambda low, high: low <= high),
    Sobol: ("low <= high", lambda low, high: low <= high),
    LogUniform: ("0 < low <= high", lambda low, high: 0.0 < low <= high),
    Normal: ("sd >= 0", lambda mean, sd: sd >= 0.0),
    Around: ("[nominal, share >= 0]", lambda nominal, share: share >= 0.0),
}


def law_of_field(owner: str, key: str, given: object, fields: Collection[str]) -> tuple[str, Law]:
    """The SI field of a key of YAML and its law in SI units: ``backlash_deg: {uniform: [0, 20]}`` is `backlash` in rad.

    Raises
    ------
    ParameterError
        As `make_law`, no such field, or text in degrees.
    """
    name, factor = field_of(owner, key, fields)
    law = make_law(owner, key, given)
    if name == key:
        return name, law
    for value in law.extremes:
        check_number(owner, key, value)
    return name, law.scaled(factor)


def _entry(owner: str, name: str, given: object) -> Any:
    law = make_law(owner, name, given)
    if isinstance(law, Sobol):
        raise refuse(owner, name, "a choice of values and laws other than sobol", given)
    return law.value if isinstance(law, Fixed) else law


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, Law):
        return value.scaled(factor)
    return value if value is None else value * factor
