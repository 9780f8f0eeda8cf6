"""Tables, not laws: a missing torque over one variable or two, or an error of the cam's motion, as read off records.

They are in `TABLES` and not in `EFFECTS`: a machine, a campaign or a second look takes them by name like any effect,
but no search proposes one, as a table fits whatever it is given and explains nothing.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from indexer_env.effects.base import MachineEffect, parameter
from indexer_env.effects.spline import Axis, spline_numbers
from indexer_env.errors import refuse
from indexer_env.kernels.layout import COEFFICIENT_NAMES

if TYPE_CHECKING:
    from indexer_env.machine import Machine

PLACES = 9
"""Places along the only variable of a table."""

OPEN_PLACES, TURN_PLACES = 5, 7
"""Places along one of two variables, and of a turn: the kernel has room for seven by seven coefficients."""

_FIRST = COEFFICIENT_NAMES.index("tabulated_first_1")


class Variable(NamedTuple):
    """What a table may be over: its number in the kernel, words, symbol, unit, whether it is a turn."""

    number: int
    words: str
    symbol: str
    unit: str
    closed: bool


VARIABLES = {
    "speed": Variable(0, "the table's speed", "φ̇", "rad/s", False),
    "angle": Variable(1, "a turn of the table", "φ", "rad", True),
    "cam": Variable(2, "a turn of the cam", "α", "rad", True),
    "deflection": Variable(3, "the output joint's deflection", "δ2", "rad", False),
    "rate": Variable(4, "its rate", "δ̇2", "rad/s", False),
}
"""By name."""


@dataclass(frozen=True)
class Tabulated(MachineEffect):
    """A cubic spline through values at evenly spaced places, over one variable or two."""

    source = "de Boor, A Practical Guide to Splines (1978), chapters IX to XI and XVII"
    over: ClassVar[tuple[str, ...]] = ()
    """Names of its variables."""
    moves: ClassVar[bool] = False
    """Whether its values are an error of the cam's motion [rad]; else a torque against the table [N m]."""
    grid: ClassVar[tuple[str, ...]] = ()
    """Names of its values, those of the last variable side by side."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for axis, (low, high) in zip(self.axes, ENDS, strict=False):
            if not axis.low < axis.high:
                raise refuse(self.name, high, f"above {low}, {axis.low:g}", axis.high)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """Its variables' places."""
        found = []
        for name, ends, count in zip(self.over, ENDS, places_of(self.over), strict=False):
            closed = VARIABLES[name].closed
            low_high = {} if closed else dict(zip(("low", "high"), (getattr(self, end) for end in ends), strict=True))
            found.append(Axis(count, closed=closed, **low_high))
        return tuple(found)

    @property
    def values(self) -> np.ndarray:
        """Its values, an axis for each variable."""
        return np.reshape([getattr(self, name) for name in self.grid], places_of(self.over))

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        if coefficients["tabulated_over_1"] >= 0.0:
            rule, remedy = "the only table of a machine", "leave out all tables but one"
            raise refuse("Machine", "effects", rule, self.name, remedy)
        for n, name in enumerate(self.over, start=1):
            coefficients[f"tabulated_over_{n}"] = float(VARIABLES[name].number)
        coefficients["tabulated_moves"] = float(self.moves)
        numbers = spline_numbers(self.axes, self.values.ravel().tolist())
        coefficients.update(zip(COEFFICIENT_NAMES[_FIRST : _FIRST + len(numbers)], numbers, strict=True))


TABLES: dict[str, type[Tabulated]] = {}
"""All tables by name: loaded like effects, but proposed by no search."""

ENDS = (("low", "high"), ("low_2", "high_2"))
"""Fields of the ends of its first and of its second variable."""


def places_of(over: Sequence[str]) -> tuple[int, ...]:
    """How many places a table over these variables has along each."""
    if len(over) == 1:
        return (PLACES,)
    return tuple(TURN_PLACES if VARIABLES[name].closed else OPEN_PLACES for name in over)


def grid_names(value: str, counts: Sequence[int]) -> tuple[str, ...]:
    """Names of values at places of these numbers: torque_1 …, torque_1_1 …"""
    return tuple("_".join([value, *map(str, at)]) for at in itertools.product(*(range(1, n + 1) for n in counts)))


def _table(
    cls: str, name: str, over: tuple[str, ...], sentence: str, equation: str, *, moves: bool = False
) -> type[Tabulated]:
    """A table by the name of its class, entered into `TABLES`."""
    value, unit, bound = ("error", "rad", 0.05) if moves else ("torque", "N m", None)
    grid = grid_names(value, places_of(over))
    meaning = f"{value} at each place" + (", those of the second variable side by side" if len(over) == 2 else "")
    rules = parameter(meaning, unit, null=0.0, low=None if bound is None else -bound, high=bound)
    fields = [(field, float, dataclasses.field(metadata=rules.metadata)) for field in grid]
    for variable, ends, which in zip(over, ENDS, ("", " of the second variable"), strict=False):
        own = VARIABLES[variable]
        fields += [
            (end, float, parameter(f"value{which} at the {place} place", own.unit))
            for end, place in zip(ends, ("first", "last"), strict=True)
            if not own.closed
        ]
    told = {
        "name": name, "over": over, "moves": moves, "grid": grid, "sentence": f"{sentence}: a table, not a law.",
        "equation": equation, "enters": "motion law" if moves else "table torque",
        "__doc__": f"{sentence}.", "__module__": __name__,
    }  # fmt: skip
    TABLES[name] = dataclasses.make_dataclass(cls, fields, bases=(Tabulated,), namespace=told, frozen=True)
    return TABLES[name]


def _torque(cls: str, name: str, *over: str) -> type[Tabulated]:
    """A table of a torque against the table."""
    variables = [VARIABLES[variable] for variable in over]
    words = " and ".join(variable.words for variable in variables)
    symbols = ", ".join(variable.symbol for variable in variables)
    told = [
        f"{v.symbol} closed over a turn" if v.closed else f"{v.symbol} from `{low}` to `{high}`"
        for v, (low, high) in zip(variables, ENDS, strict=False)
    ]
    sentence = f"A torque that is tabulated over {words} acts on the table"
    return _table(cls, name, over, sentence, f"T_L += spline({symbols}), {', '.join(told)}")


OverSpeed = _torque("OverSpeed", "tabulated.speed", "speed")
OverAngle = _torque("OverAngle", "tabulated.angle", "angle")
OverCam = _torque("OverCam", "tabulated.cam", "cam")
OverDeflection = _torque("OverDeflection", "tabulated.deflection", "deflection")
OverSpeedAndAngle = _torque("OverSpeedAndAngle", "tabulated.speed_angle", "speed", "angle")
OverSpeedAndCam = _torque("OverSpeedAndCam", "tabulated.speed_cam", "speed", "cam")
OverDeflectionAndRate = _torque("OverDeflectionAndRate", "tabulated.deflection_rate", "deflection", "rate")
Profile = _table(
    "Profile", "tabulated.profile", ("cam",),
    "An error of the cam's motion that is tabulated over a turn of the cam moves the follower",
    "β += spline(α), α closed over a turn; β', β'' with it", moves=True,
)  # fmt: skip
