"""The effects that may be missing from a drive as hypotheses, and which of them its own parameters can do as well."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from itertools import chain, product
from typing import Any

import numpy as np

from discrepancy.drives.description import Drive, named
from discrepancy.drives.effects import TABLES, DriveEffect
from discrepancy.drives.effects.tabulated import OVER, VARIABLES, axes_of, counts_of, ends_of, table_values
from discrepancy.drives.scales import Scales
from discrepancy.drives.track import Track
from discrepancy.form import Form, shaped
from discrepancy.model import Hypothesis, Parameter
from indexer_env.effects.spline import Axis, spline_numbers
from indexer_env.errors import ParameterError

SAME = 1e-3
"""Share of an effect's force, rms, that the model's own parameters leave where they can do the same."""


def hypotheses_of(
    effect: DriveEffect, scales: Scales, proposed: Sequence[tuple[float, ...]] = ()
) -> tuple[Hypothesis, ...]:
    """An effect's hypotheses, one for each discrete choice; starts that the record proposes stand first."""
    own: list[Parameter] = []
    for place, size in enumerate(effect.sizes):
        if not size.starts:
            if not proposed:
                return ()
            found = proposed[0][place] / scales.of(size.dimension)
            nominal = min(max(found, size.low), size.high) if size.null is None else size.null
            size = dataclasses.replace(size, starts=(nominal,))
        own.append(size.parameter(effect.name, scales))
    laid = product(*([s * scales.of(size.dimension) for s in size.starts] for size in effect.sizes))
    starts = (*proposed, *(tuple(row) for row in laid if row))
    inside = tuple(_inside(own, row) for row in dict.fromkeys(starts))
    return tuple(
        Hypothesis(effect.name, tuple(own), dict(c), inside, effect.alike, over=effect.over, limits=effect.limits)
        for c in effect.choices
    )


def _inside(parameters: Sequence[Parameter], values: Sequence[float]) -> tuple[float, ...]:
    return tuple(min(max(v, p.low), p.high) for p, v in zip(parameters, values, strict=True))


def values_of(hypothesis: Hypothesis, values: Sequence[float]) -> Any:
    """An effect's values by its parameters' names, its choices among them, as its law takes them."""
    names = [p.name.removeprefix(f"{hypothesis.name}.") for p in hypothesis.parameters]
    pairs = {**dict(zip(names, values, strict=True)), **hypothesis.fixed}
    return named(tuple(pairs))(*pairs.values())


_WIDE = 10.0
"""Spread of a table's values before the records are looked at, over the rms force: a place that no record passes stays
at nothing."""


def forms_of(
    scales: Scales, passed: Mapping[str, Sequence[np.ndarray]], known: Sequence[Hypothesis]
) -> tuple[Form, ...]:
    """Tables over what the records fitted have passed, of each its variables; none beside a table that is there."""
    if any(one.name in TABLES for one in known):
        return ()
    found = []
    for name, values in passed.items():
        ends = [(float(row.min()), float(row.max())) for row in values]
        parameters = tuple(
            Parameter(f"{name}.{size.name}", scales.unit("F"), 0.0, _WIDE * scales.F, known=True)
            for size in TABLES[name].sizes
        )
        over = " and ".join(f"{variable} [{scales.unit(VARIABLES[variable][2])}]" for variable in OVER[name])
        fixed = dict(zip(ends_of(name), chain(*ends), strict=True))
        axes = tuple(Axis(count, *low_high) for count, low_high in zip(counts_of(name), ends, strict=True))
        found.append(Form(over, OVER[name], Hypothesis(name, parameters, fixed, shaped(axes, scales.F)), axes))
    return tuple(found)


def tabulated_row(name: str, p: Any) -> list[float]:
    """A table's coefficients as the integrator of the forward form has them: its first variable, and its spline's."""
    return [1.0 if OVER[name][0] == "speed" else 2.0, *spline_numbers(axes_of(name, p), table_values(name, p))]


def sensible(
    effects: Sequence[DriveEffect], scales: Scales, known: Mapping[str, Any], placed: bool
) -> list[DriveEffect]:
    """Effects that make sense for the channels: those of angles only where the position is one, those over the position
    only where that is `placed`, those of a joint whose other side is measured only where it is."""
    rotary, load = scales.position_unit == "rad", ("", "seen" if scales.D else "unseen")
    return [
        e for e in effects
        if e.name not in known and (rotary or not e.rotary) and (placed or not e.placed) and e.load in load
    ]  # fmt: skip


def done_by_model(response: np.ndarray, slopes: np.ndarray) -> bool:
    """Whether the slopes (g, n) of the model's own parameters give the response (n,) of an effect."""
    size = float(np.linalg.norm(response))
    if size == 0.0:
        return False
    return float(np.linalg.norm(without(response, slopes))) < SAME * size


def without(response: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """A response (n,) less what slopes (g, n) can give of it."""
    coefficients, *_ = np.linalg.lstsq(slopes.T, response, rcond=1e-10)
    return response - slopes.T @ coefficients


def proposals(effect: DriveEffect, tracks: Sequence[Track], left: Sequence[np.ndarray]) -> list[tuple[float, ...]]:
    """Starts that the longest record proposes, given what the model leaves of each."""
    if effect.starts is None or not tracks:
        return []
    longest = int(np.argmax([len(row) for row in left]))
    return effect.starts(tracks[longest], left[longest])


def sized(
    one: Hypothesis, response: Callable[[Hypothesis, tuple[float, ...]], np.ndarray], left: np.ndarray
) -> Hypothesis:
    """The hypothesis with starts of the size at which each of its shapes lessens most, by linear theory, what a fit has
    left (n,): beside large forces a small one may lie below all sizes of the list. `response` gives what the effect
    adds (n,) at its values."""
    if not one.parameters or one.parameters[0].nominal != 0.0:
        return one
    found = []
    for row in {row[1:]: row for row in one.starts if row[0] != 0.0}.values():
        added = response(one, row)
        power = float(added @ added)
        size = row[0] * float(added @ left) / power if power > 0.0 else 0.0
        size = min(max(size, one.parameters[0].low), one.parameters[0].high)
        if size != 0.0:
            found.append((size, *row[1:]))
    return dataclasses.replace(one, starts=(*found, *one.starts), effects=())


def check_slopes(drive: Drive, slopes: np.ndarray) -> None:
    """Refuse a parameter that does nothing."""
    sizes = np.linalg.norm(slopes, axis=1)
    for parameter, size in zip(drive.parameters, sizes, strict=True):
        if size <= 1e-9 * max(float(sizes.max()), 1e-300):
            raise ParameterError(
                f"{drive.path.name}: the parameter {parameter.name} must change the force on these records, but it "
                "does nothing; leave it out or use it."
            )
