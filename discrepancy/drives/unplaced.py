"""Whether an equation asks where a position is of which the speed alone is measured.

Such a position is added up and is 0 at each record's first sample, wherever the drive stood. An equation that changes
with a shift of it is another one there, unless its parameters can do the same:

    f(q + d) - f(q) in the span of df/dp,   as with p.q0 in f(q + p.q0)

Of two records or more each begins elsewhere, so that such a parameter must be one of each record.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from discrepancy.drives.both_forms import adrift
from discrepancy.drives.compiled_rates import plain_rates
from discrepancy.drives.description import Drive
from discrepancy.drives.forward import ForwardModel
from discrepancy.drives.inverse import InverseModel
from discrepancy.drives.inverse_library import slopes_of
from discrepancy.drives.library import done_by_model
from indexer_env.errors import ParameterError

_SHIFTS = (1e-6, 1.0)
"""Of half the stroke: so small that what follows is linear, and so large that a step of the equation is met."""

_NUDGE = 1e-4
"""Of a parameter's scale."""

_NOTHING = 1e-9
"""Change of the equation over its size, for a shift of half the stroke, that is rounding."""

_LOOKED_AT = 300
"""Samples of a record at which `rates` are called."""


def check_unplaced(model: InverseModel) -> None:
    """Refuse a `force` that asks where an added-up position is."""
    drive, records = model.drive, len(model.tracks)
    if "q" in drive.channels:
        return
    several = adrift(drive, "q", records)
    slopes = slopes_of(model)[[p.of_record or not several for p in model.parameters]]
    owner = np.repeat(np.arange(len(model.measured)), [len(row) for row in model.measured])
    nominal = tuple(p.nominal for p in drive.parameters)
    for group, k in enumerate(model.windows.tracks):
        track = model.tracks[k]
        base = model.base(track, nominal)
        plain = base(track.q, track.v, track.a)

        def changed(shift: float, track=track, base=base, plain=plain) -> np.ndarray:
            return track.thinned(base(track.q + shift, track.v, track.a) - plain)

        size = float(np.linalg.norm(track.thinned(plain)))
        if _asks(changed, model.scales.Q, size, slopes[:, owner == group]):
            raise _refusal(drive, "q", model.scales.position_unit, several)


def check_unplaced_rates(model: ForwardModel) -> None:
    """Refuse `rates` that ask where an added-up position is."""
    drive = model.drive
    rates = plain_rates(drive, model.courses[0].inputs)
    nominal = np.array([p.nominal for p in drive.parameters])
    for joint, scales in zip(drive.joints, model.scales, strict=True):
        if joint.position in drive.channels:
            continue
        at, several = drive.states.index(joint.position), adrift(drive, joint.position, len(model.courses))
        free = [k for k, p in enumerate(drive.parameters) if not several or p.name in drive.sessions]
        for course in model.courses:
            picked = np.linspace(0, len(course.u) - 1, min(_LOOKED_AT, len(course.u))).astype(int)

            def of(shift: float, row: np.ndarray, course=course, at=at, picked=picked) -> np.ndarray:
                found = np.zeros((len(picked), len(drive.states)))
                for out, k in zip(found, picked, strict=True):
                    x = course.states[k].copy()
                    x[at] += shift
                    rates(x, course.u[k], k / course.rate, row, out)
                return found.reshape(-1)

            plain, slopes = of(0.0, nominal), []
            for k in free:
                row = nominal.copy()
                row[k] = drive.parameters[k].value(_NUDGE)
                slopes.append((of(0.0, row) - plain) / _NUDGE)
            columns = np.array(slopes).reshape(len(free), len(plain))
            size = float(np.linalg.norm(plain))
            if _asks(lambda shift, of=of, plain=plain: of(shift, nominal) - plain, scales.Q, size, columns):
                raise _refusal(drive, joint.position, scales.position_unit, several)


def _asks(changed: Callable[[float], np.ndarray], stroke: float, size: float, slopes: np.ndarray) -> bool:
    small, large = (changed(shift * stroke) for shift in _SHIFTS)
    if float(np.linalg.norm(large)) <= _NOTHING * size:
        return False
    return not done_by_model(small, slopes)


def _refusal(drive: Drive, position: str, unit: str, several: bool) -> ParameterError:
    form, written = ("rates", f"x.{position}") if drive.forward else ("force", position)
    sessions = f", and sessions = ('{position}0',)" if several else ""
    return ParameterError(
        f"{drive.path.name}: {form} must not change with where {written} is 0, as it is added up from the speed and is "
        f"0 at each record's first sample; write {written} + p.{position}0 for {written}, with {position}0: "
        f"(0.0, {unit!r}, UNCERTAINTY) among the parameters{sessions}."
    )
