"""What a standard effect of a drive is: a law over the measured motion, its parameters in multiples of the record.

Everything an effect is sized by comes from the record itself (`Scales`), so that an effect knows no unit:

    F   rms of the force          Q   half of the stroke          V   rms speed          A   rms acceleration
    T = V/A, the time in which the drive changes its speed
    D   half the range of the deflection between drive and load, where the load has an encoder of its own
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from discrepancy.model import Parameter

if TYPE_CHECKING:
    from discrepancy.drives.scales import Scales
    from discrepancy.drives.track import Track

_TOKEN = re.compile(r"([FQVATD])(-?\d+)?")

PHASES = tuple(0.5 * math.pi * k for k in range(4))
"""Starts of a phase whose right one nothing proposes."""


@dataclass(frozen=True)
class Size:
    """One parameter of an effect, in multiples of what `dimension` names.

    Attributes
    ----------
    name, meaning : str
    dimension : str
        Product of scales with their exponents: "F", "F V-1", "T"; "" for a plain number (an angle is one).
    starts : tuple of float
        Where a fit may begin.
    low, high : float
        Bounds.
    null : float or None
        Value at which the effect is nothing; None for a parameter that gives its shape.
    step : float
        Scale of the fit's coordinate; 0: half the smallest start other than the null.
    """

    name: str
    meaning: str
    dimension: str
    starts: tuple[float, ...]
    low: float = -math.inf
    high: float = math.inf
    null: float | None = None
    step: float = 0.0

    def parameter(self, effect: str, scales: Scales) -> Parameter:
        """As a parameter of a fit, in the record's units."""
        unit = scales.of(self.dimension)
        step = self.step or 0.5 * min(abs(s - (self.null or 0.0)) for s in self.starts if s != self.null)
        nominal = self.starts[0] if self.null is None else self.null
        return Parameter(
            f"{effect}.{self.name}", scales.unit(self.dimension), nominal * unit, step * unit, self.low * unit,
            self.high * unit,
        )  # fmt: skip


Law = Callable[..., np.ndarray]
"""See `DriveEffect.law`."""


@dataclass(frozen=True, eq=False)
class DriveEffect:
    """One effect.

    Attributes
    ----------
    name, sentence, equation, source : str
    sizes : tuple of Size
    law : callable
        (track, p, base) -> array (n,). What it gives is said by `acts`; `p` holds the values [units] by name, `base` is
        the model's own force as a function of the motion, base(q, v, a) -> (n,), and of inputs in the record's place.
    acts : str
        "force": the law is a force [F] that the drive must give in addition. "dry": the law is the level of a dry
        friction [F], called with a further argument, the direction ±1 (n,); at rest any force up to it may act.
        "reading": the law turns the force that is given, a further argument (n,), into the force that is read.
    alike : tuple of str
        Effects that some records cannot tell from it.
    limits : tuple of str
        Effects that it becomes where its shape comes to an end: where it is no better than one of them, it is no rival.
    over : str
        The table over the variable of which it is a smooth law, by its name in `TABLES`; "" where there is none.
    load : str
        "seen": only where the load's position is measured; "unseen": only where it is not; "": whether or not.
    rotary : bool
        True where it makes sense for an angle alone.
    placed : bool
        True where the law depends on where the position is 0.
    of_base : bool
        True where a standard law calls `base`, so that it changes with the model's own parameters; one of a user's own
        is taken to.
    starts : callable or None
        Further starts that the record itself proposes: (track, what the model leaves) -> tuples of values [units].
    begins : callable or None
        What the unknown state in which it begins a record adds to the force, linear in that: (track, p, base) -> arrays
        (k, n), each for one standard deviation of what is unknown.
    forward : str
        Its name in the integrator of the forward form; "" where it acts in the inverse form only.
    choices : tuple of mapping
        Discrete choices, each a hypothesis of its own.
    """

    name: str
    sentence: str
    equation: str
    source: str
    sizes: tuple[Size, ...]
    law: Law
    acts: str = "force"
    alike: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    over: str = ""
    load: str = ""
    rotary: bool = False
    placed: bool = False
    of_base: bool = False
    starts: Callable[[Track, np.ndarray], list[tuple[float, ...]]] | None = None
    begins: Callable[..., np.ndarray] | None = None
    forward: str = ""
    choices: tuple[Mapping[str, float], ...] = field(default=({},))


def exponents(dimension: str) -> list[tuple[str, int]]:
    """("F", 1), ("V", -1) of "F V-1"."""
    found = [(letter, int(power or 1)) for letter, power in _TOKEN.findall(dimension)]
    if " ".join(f"{a}{'' if n == 1 else n}" for a, n in found) != dimension:
        raise ValueError(f"{dimension!r} is no product of scales such as 'F V-1'.")
    return found


EFFECTS: dict[str, DriveEffect] = {}
"""The standard effects by name; filled by `standard` when the families are imported."""


def standard(effect: DriveEffect) -> DriveEffect:
    """Enter an effect into `EFFECTS`."""
    EFFECTS[effect.name] = effect
    return effect
