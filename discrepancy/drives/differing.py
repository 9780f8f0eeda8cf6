"""Parameters that seem to differ from record to record although nobody said so, read off what a fit leaves.

At the fitted place a parameter's column of the linearised residual is cut into one for each record, and into one for
each window. What the first cut takes off the squares, Δ_r, is judged by what the second takes off beyond it (analysis
of variance with the windows as repetitions):

    F = (Δ_r/(r - 1))/((Δ_w - Δ_r)/(w - r)),   r records, w windows

Parameters are taken up one after the other, the one that takes off most first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.drives.description import Drive
from discrepancy.drives.effects import TABLES
from discrepancy.drives.inverse import InverseModel
from discrepancy.drives.sessions import OFFSET
from discrepancy.model import Hypothesis, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.effects.friction import CoulombFriction

_CHANCE = 1e-3
"""Probability of such an F by chance."""

_ITS_OWN = 0.1
"""Share of the standard dry friction's column, squared, that the drive's own parameters must leave for it to count
beside them: a drive's own dry friction is almost the same."""

_NUDGE = 1e-6
"""Of a scaled coordinate, for the slope of a parameter's value."""


@dataclass(frozen=True)
class Differing:
    """A parameter by record.

    Attributes
    ----------
    name, unit : str
    values : tuple of float
        One for each record [unit].
    effect : mapping of str to mapping
        The effect that it belongs to as `known` states it, where the model does not have that from the start.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    effect: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def differing(model: InverseModel, place: Point, criteria: Criteria) -> tuple[tuple[Differing, ...], float]:
    """What differs between the records fitted, and the share of what remains there that is due to it."""
    records = len(model.measured)
    if records < 2:
        return (), 0.0
    problem, point = _with_friction(model, place)
    left, slopes, _ = problem.linearised(point)
    inside = np.arange(left.shape[1]) < model.counts[:, None]
    window = np.repeat(np.arange(len(model.counts)), left.shape[1]).reshape(left.shape)[inside]
    record, r = model.groups[window], left[inside]
    columns = {p.name: slopes[k][inside] for k, p in enumerate(problem.parameters)}
    if len(point.z) > len(place.z) and not _of_its_own(columns, problem.parameters[-1].name):
        del columns[problem.parameters[-1].name]
    candidates = [name for name in _candidates(model, problem) if name in columns and columns[name].any()]
    if OFFSET not in model.drive.sessions and OFFSET not in columns:
        columns[OFFSET] = 1.0 / model.noise[record]
        candidates.append(OFFSET)
    basis = np.array([column for column in columns.values() if column.any()]).T
    at_first = _off(basis, r)
    gap = float(at_first @ at_first) - len(r)
    if gap <= criteria.at_noise * len(r):
        return (), 0.0
    found: list[str] = []
    while len(found) < criteria.most:
        rest = _off(basis, r)
        taken = {name: _taken(basis, rest, columns[name], record) for name in candidates if name not in found}
        most = max(taken.values(), default=0.0)
        if most < criteria.hint * gap:
            break
        name = next(name for name, square in taken.items() if square == most)
        by_window = _taken(basis, rest, columns[name], window)
        if _chance(taken[name], by_window, records, int(window.max()) + 1) > _CHANCE:
            break
        found.append(name)
        basis = np.hstack([basis, _cut(columns[name], record)])
    if not found:
        return (), 0.0
    rest = _off(basis, r)
    return _valued(found, columns, problem, point, r, record, model), 1.0 - (float(rest @ rest) - len(r)) / gap


def _with_friction(model: InverseModel, place: Point) -> tuple[Problem, Point]:
    """The place with dry friction of nothing beside it, where it has none."""
    name = CoulombFriction.name
    extra = model.hypotheses().get(name, ())
    if not extra or name in place.hypothesis.names:
        return Problem(model, place.hypothesis), place
    problem = Problem(model, together(place.hypothesis, extra[0]))
    z = np.concatenate([place.z, np.zeros(len(extra[0].parameters))])
    return problem, problem.point(z, place.states)


def _of_its_own(columns: Mapping[str, np.ndarray], name: str) -> bool:
    others = np.array([column for key, column in columns.items() if key != name and column.any()]).T
    left = _off(others, columns[name])
    return float(left @ left) > _ITS_OWN * float(columns[name] @ columns[name])


def _candidates(model: InverseModel, problem: Problem) -> list[str]:
    """Parameters that all records share, of effects their sizes alone."""
    sizes = [
        f"{one.name}.{size.name}"
        for one in (*model.known, *problem.hypothesis.effects)
        if one.name not in TABLES
        for size in model.effects[one.name].sizes
        if size.null is not None
    ]
    named = {p.name for p in problem.parameters if not p.of_record}
    return [name for name in (*(p.name for p in model.drive.parameters), *sizes) if name in named]


def _off(basis: np.ndarray, row: np.ndarray) -> np.ndarray:
    """A row (n,) less what columns (n, k) can give of it."""
    size = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    return row - basis / size @ np.linalg.lstsq(basis / size, row, rcond=1e-10)[0]


def _cut(column: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """A column (n,) as one for each owner (n, k)."""
    return np.where(owner[:, None] == np.arange(int(owner.max()) + 1), column[:, None], 0.0)


def _taken(basis: np.ndarray, rest: np.ndarray, column: np.ndarray, owner: np.ndarray) -> float:
    """What a cut of a column takes off the squares."""
    left = _off(np.hstack([basis, _cut(column, owner)]), rest)
    return float(rest @ rest) - float(left @ left)


def _chance(by_record: float, by_window: float, records: int, windows: int) -> float:
    from scipy.stats import f

    if windows <= records:
        return 1.0
    within = max(by_window - by_record, 1e-300) / (windows - records)
    return float(f.sf(by_record / (records - 1) / within, records - 1, windows - records))


def _valued(
    found: Sequence[str], columns: dict[str, np.ndarray], problem: Problem, point: Point, r: np.ndarray,
    record: np.ndarray, model: InverseModel,
) -> tuple[Differing, ...]:  # fmt: skip
    """The parameters with their values, by the linearised fit in which each record has its own."""
    whole = [column[:, None] for name, column in columns.items() if name not in found and column.any()]
    basis = np.hstack([*(_cut(columns[name], record) for name in found), *whole])
    size = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    steps = -np.linalg.lstsq(basis / size, r, rcond=1e-10)[0] / size
    own = steps[: len(found) * len(model.measured)].reshape(len(found), -1)
    at = {p.name: k for k, p in enumerate(problem.parameters)}
    out = []
    for name, row in zip(found, own, strict=True):
        if name not in at:
            out.append(Differing(name, model.scales.unit("F"), tuple(row.tolist())))
            continue
        p, z = problem.parameters[at[name]], float(point.z[at[name]])
        slope = (p.value(z + _NUDGE) - p.value(z)) / _NUDGE
        values = tuple(p.value(z) + slope * float(step) for step in row)
        out.append(Differing(name, p.unit, values, _stated(problem.hypothesis, point, name, float(np.mean(values)))))
    return tuple(out)


def _stated(hypothesis: Hypothesis, point: Point, name: str, mean: float) -> Mapping[str, Mapping[str, float]]:
    values = dict(zip((p.name for p in hypothesis.parameters), point.values, strict=True)) | {name: mean}
    for one in hypothesis.effects:
        own = {p.name: values[p.name] for p in one.parameters}
        if name in own:
            told = {key.removeprefix(f"{one.name}."): float(f"{value:.4g}") for key, value in own.items()}
            return {one.name: told | dict(one.fixed)}
    return {}


def in_words(found: Sequence[Differing], share: float, drive: Drive, names: Sequence[str]) -> str:
    """What differs and how to say so."""
    each = "; ".join(
        f"{one.name} is {', '.join(f'{v:.4g} {one.unit} ({name})' for v, name in zip(one.values, names, strict=True))}"
        for one in found
    )
    sessions = tuple(dict.fromkeys((*drive.sessions, *(one.name for one in found))))
    effects = {name: values for one in found for name, values in one.effect.items()}
    lines = [*([f"known = {dict(drive.known) | effects}"] if effects else []), f"sessions = {sessions}"]
    return (
        f"Records seem to differ: {each}; that is {min(share, 1.0):.0%} of what remains. Unless a wrong law shows "
        f"here, write {' and '.join(lines)} into {drive.path.name}."
    )
