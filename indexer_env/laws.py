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

import dataclasses
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

_LEAST, _MOST = 2.0**-54, 1.0 - 2.0**-53
"""Stands for u = 0, where Φ⁻¹ is infinite (half of the smallest step of u); the largest u below 1."""

_NEXT_TO_NOTHING = 1e-9
"""Share of an interval's upper end that stands for the least value above 0 [-]."""


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
    def needs_nominal(self) -> bool:
        """Whether it is relative to a nominal value that it has not got itself."""
        return False

    @property
    @abstractmethod
    def centre(self) -> Any:
        """A value in the middle of the law, for what must be known before anything is drawn."""

    @abstractmethod
    def scaled(self, factor: float) -> Law:
        """The law of the quantity times a factor > 0 (degrees to radians)."""

    def __repr__(self) -> str:
        # As in YAML, because it stands in sentences for those who wrote it there.
        values = [getattr(self, field.name) for field in dataclasses.fields(self)]  # type: ignore[arg-type]
        return self.form.partition(":")[0] + f": {values}}}"


@dataclass(frozen=True, repr=False)
class Fixed(Law):
    """The same value always; it takes nothing from the generator."""

    form: ClassVar[str] = "a value"
    value: Any

    def __repr__(self) -> str:
        return repr(self.value)

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


@dataclass(frozen=True, repr=False)
class _Interval(Law):
    """A law between two values, low <= high."""

    low: float
    high: float

    @property
    def extremes(self) -> tuple[Any, ...]:
        # 0 often stands for "not there", and what is next to nothing may then be what no check passes.
        return (self.low, _NEXT_TO_NOTHING * self.high, self.high) if self.low == 0.0 else (self.low, self.high)

    def scaled(self, factor: float) -> Law:
        return type(self)(self.low * factor, self.high * factor)


@dataclass(frozen=True, repr=False)
class _Even(_Interval):
    """low + (high - low) u."""

    def at(self, u: float, nominal: Any = None) -> float:
        return self.low + (self.high - self.low) * u

    @property
    def centre(self) -> float:
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True, repr=False)
class Uniform(_Even):
    """low + (high - low) u."""

    form: ClassVar[str] = "{uniform: [low, high]}"


@dataclass(frozen=True, repr=False)
class Sobol(_Even):
    """low + (high - low) u, u from the data set's Sobol' sequence, in which this quantity is one dimension."""

    form: ClassVar[str] = "{sobol: [low, high]}"


@dataclass(frozen=True, repr=False)
class LogUniform(_Interval):
    """low (high / low)^u: each octave as likely; 0 < low."""

    form: ClassVar[str] = "{log_uniform: [low, high]}"

    def at(self, u: float, nominal: Any = None) -> float:
        return self.low * (self.high / self.low) ** u

    @property
    def centre(self) -> float:
        return math.sqrt(self.low * self.high)


@dataclass(frozen=True, repr=False)
class Normal(Law):
    """mean + sd Φ⁻¹(u); u has 53 bits, so no value lies farther than 8.3 sd from the mean."""

    form: ClassVar[str] = "{normal: [mean, sd]}"
    mean: float
    sd: float

    def at(self, u: float, nominal: Any = None) -> float:
        from scipy.special import ndtri  # here, not above: its import takes as long as all others of this package

        return self.mean + self.sd * float(ndtri(max(u, _LEAST)))

    @property
    def extremes(self) -> tuple[Any, ...]:
        return (self.at(0.0), self.at(_MOST))

    @property
    def centre(self) -> float:
        return self.mean

    def scaled(self, factor: float) -> Law:
        return Normal(self.mean * factor, self.sd * factor)


@dataclass(frozen=True, repr=False)
class Choice(Law):
    """One of the values, each as likely; an entry that is a law draws from what u leaves after the choice."""

    form: ClassVar[str] = "{choice: [value, ...]}"
    values: tuple[Any, ...]

    def __repr__(self) -> str:
        return f"{{choice: {list(self.values)}}}"

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
    def needs_nominal(self) -> bool:
        return any(isinstance(entry, Law) and entry.needs_nominal for entry in self.values)

    @property
    def centre(self) -> Any:
        return self.values[0].centre if isinstance(self.values[0], Law) else self.values[0]

    def scaled(self, factor: float) -> Law:
        return Choice(tuple(_times(entry, factor) for entry in self.values))


@dataclass(frozen=True, repr=False)
class Around(Law):
    """nominal (1 + share (2u - 1)), the paper's ±10 % for share 0.1 (section 4.1); share 0 keeps the nominal
    value. A nominal value of its own serves where the quantity has none."""

    form: ClassVar[str] = "{around: share}"
    share: float
    nominal: float | None = None

    def __repr__(self) -> str:
        return f"{{around: {self.share if self.nominal is None else [self.nominal, self.share]}}}"

    def at(self, u: float, nominal: Any = None) -> float:
        middle = self.nominal if self.nominal is not None else nominal
        return middle * (1.0 + self.share * (2.0 * u - 1.0))

    @property
    def extremes(self) -> tuple[Any, ...]:
        return () if self.nominal is None else (self.at(0.0), self.at(_MOST))

    @property
    def needs_nominal(self) -> bool:
        return self.nominal is None

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


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, Law):
        return value.scaled(factor)
    return value if value is None else value * factor
