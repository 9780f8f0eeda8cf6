"""Tables, not laws: a missing force as a spline over speed, position or deflection, or over two of these, as it was
read off records.

They stand in `TABLES` and not among the standard effects: machine.yaml may name one, but no search proposes one.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from discrepancy.drives.effects.base import DriveEffect, Size
from indexer_env.effects.spline import Axis
from indexer_env.effects.tabulated import ENDS, OPEN_PLACES, PLACES, grid_names

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

VARIABLES: dict[str, tuple[str, str, str, Callable[[Track], np.ndarray]]] = {
    "speed": ("speed", "v", "V", lambda m: m.v),
    "position": ("position", "q", "Q", lambda m: m.q),
    "deflection": ("deflection of a joint", "q - q_load", "D", lambda m: m.q - m.u.q_load),
    "rate": ("its rate", "v - v_load", "V", lambda m: m.v - m.u.v_load),
}
"""What a table may be over: words, symbol, what its unit is that of, and its values (n,) in a record."""

OVER = {
    "tabulated.speed": ("speed",), "tabulated.position": ("position",), "tabulated.deflection": ("deflection",),
    "tabulated.speed_position": ("speed", "position"), "tabulated.deflection_rate": ("deflection", "rate"),
}  # fmt: skip
"""Variables of each table."""


def counts_of(name: str) -> tuple[int, ...]:
    """How many places a table has along each of its variables."""
    return (PLACES,) if len(OVER[name]) == 1 else (OPEN_PLACES, OPEN_PLACES)


def ends_of(name: str) -> tuple[str, ...]:
    """Names of the first and of the last value of each of a table's variables."""
    return tuple(itertools.chain(*ENDS[: len(OVER[name])]))


def axes_of(name: str, p: Any) -> list[Axis]:
    """A table's places along each of its variables, `p` its values by their names."""
    ends = [[getattr(p, end) for end in pair] for pair in ENDS[: len(OVER[name])]]
    return [Axis(count, low, high) for count, (low, high) in zip(counts_of(name), ends, strict=True)]


def table_values(name: str, p: Any) -> list[float]:
    """A table's forces, those of its last variable side by side."""
    return [getattr(p, force) for force in grid_names("force", counts_of(name))]


def _law(name: str) -> Callable[..., np.ndarray]:
    """The tensor product of natural cubic splines, constant beyond its ends: the same as of the indexing machine."""

    def law(m: Track, p: Any, base: Any) -> np.ndarray:
        from scipy.interpolate import CubicSpline

        found = np.reshape(table_values(name, p), (1, *counts_of(name)))
        for axis, variable in zip(axes_of(name, p), OVER[name], strict=True):
            spline = CubicSpline(axis.places, np.eye(axis.count), bc_type="natural")
            weights = spline(np.clip(VARIABLES[variable][3](m), axis.low, axis.high))
            found = np.einsum("nk,nk...->n...", weights, np.broadcast_to(found, (len(weights), *found.shape[1:])))
        return found

    return law


def _table(name: str) -> DriveEffect:
    words, symbols, _, _ = zip(*(VARIABLES[variable] for variable in OVER[name]), strict=True)
    load = "seen" if "deflection" in OVER[name] else ""
    meaning = "force at each place" + (", those of the second variable side by side" if len(words) == 2 else "")
    return DriveEffect(
        name, f"A force that is tabulated over the {' and '.join(words)} acts: a table, not a law.",
        f"F += spline({', '.join(symbols)})", "de Boor, A Practical Guide to Splines (1978)",
        tuple(Size(force, meaning, "F", (0.1,), null=0.0) for force in grid_names("force", counts_of(name))),
        _law(name), load=load, placed="position" in OVER[name], forward="" if load else "tabulated",
    )  # fmt: skip


TABLES = {name: _table(name) for name in OVER}
"""By name; each needs `low` and `high` beside its values, one over two variables `low_2` and `high_2` as well."""
