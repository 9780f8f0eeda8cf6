"""What a drive's records are measured by, so that an effect's size knows no unit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.effects.base import exponents

if TYPE_CHECKING:
    from discrepancy.drives.track import Track


@dataclass(frozen=True, eq=False)
class Scales:
    """What a drive's records are measured by: rms force F, half the stroke Q and its middle, rms speed V, rms
    acceleration A, T = V/A; half the range of the deflection in a record D, 0 where the load is not measured; and the
    units of force and position."""

    F: float
    Q: float
    V: float
    A: float
    middle: float
    force_unit: str
    position_unit: str
    D: float = 0.0

    @property
    def T(self) -> float:
        """Time in which the drive changes its speed [s]."""
        return self.V / self.A

    def of(self, dimension: str) -> float:
        """A product of scales, "F V-1", in the record's units."""
        return math.prod(getattr(self, letter) ** power for letter, power in exponents(dimension))

    def unit(self, dimension: str) -> str:
        """Its unit, "N s/m"."""
        powers = {"F": 0, "Q": 0, "s": 0}
        for letter, n in exponents(dimension):
            powers["F"] += n * (letter == "F")
            powers["Q"] += n * (letter in "QVAD")
            powers["s"] += n * {"V": -1, "A": -2, "T": 1}.get(letter, 0)
        if not any(powers.values()):
            return "-"
        names = {"F": self.force_unit, "Q": self.position_unit, "s": "s"}
        up = [names[k] + _power(n) for k, n in powers.items() if n > 0]
        down = [names[k] + _power(-n) for k, n in powers.items() if n < 0]
        below = "" if not down else f"/{down[0]}" if len(down) == 1 else f"/({' '.join(down)})"
        return (" ".join(up) or "1") + below


def _power(n: int) -> str:
    return "" if n == 1 else f"^{n}"


def scales_of(tracks: Sequence[Track], force_unit: str, position_unit: str) -> Scales:
    """Scales over all samples of these records."""

    def rms(name: str) -> float:
        return math.sqrt(float(np.mean(np.concatenate([getattr(t, name) for t in tracks]) ** 2)))

    q = np.concatenate([t.q for t in tracks])
    middle = 0.5 * float(q.min() + q.max())
    deflected = max((0.5 * float(np.ptp(t.deflection)) for t in tracks if t.deflection is not None), default=0.0)
    return Scales(
        rms("force"), 0.5 * float(np.ptp(q)), rms("v"), rms("a"), middle, force_unit, position_unit, deflected
    )  # fmt: skip
