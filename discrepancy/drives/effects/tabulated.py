"""Tables, not laws: a missing force as a spline over speed, position or deflection, as it was read off records.

They stand in `TABLES` and not among the standard effects: machine.yaml may name one, but no search proposes one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.effects.base import DriveEffect, Size
from indexer_env.effects.tabulated import PLACES

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

_SIZES = tuple(
    Size(f"force_{k}", f"force at place {k} of {PLACES} from low to high", "F", (0.1,), null=0.0)
    for k in range(1, PLACES + 1)
)


def _spline(x: np.ndarray, p) -> np.ndarray:
    """The natural cubic spline through nine values evenly spaced from `low` to `high`, constant beyond: the same as of
    the indexing machine's tables."""
    from scipy.interpolate import CubicSpline

    values = [getattr(p, size.name) for size in _SIZES]
    spline = CubicSpline(np.linspace(p.low, p.high, PLACES), values, bc_type="natural")
    return spline(np.clip(x, p.low, p.high))


def _over_speed(m: Track, p, base) -> np.ndarray:
    return _spline(m.v, p)


def _over_position(m: Track, p, base) -> np.ndarray:
    return _spline(m.q, p)


def _over_deflection(m: Track, p, base) -> np.ndarray:
    return _spline(m.q - m.u.q_load, p)


TABLES = {
    name: DriveEffect(
        name, f"A force that is tabulated over the {over} acts: a table, not a law.", f"F += spline({symbol})",
        "de Boor, A Practical Guide to Splines (1978)", _SIZES, law, load=load, forward="" if load else "tabulated",
    )
    for name, over, symbol, law, load in (
        ("tabulated.speed", "speed", "v", _over_speed, ""),
        ("tabulated.position", "position", "q", _over_position, ""),
        ("tabulated.deflection", "deflection of a joint", "q - q_load", _over_deflection, "seen"),
    )
}  # fmt: skip
"""By name; each needs `low` and `high` beside its values."""
