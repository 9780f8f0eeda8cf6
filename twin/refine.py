"""Sizes that fit a turn: what the networks estimate, moved until the simulated turn is the measured one.

    t̂ = argmin q(t),   q as `work` has it

by Levenberg and Marquardt's method, sizes within their range. There are several minima, so it starts at all subsets of
the faults that the networks think possible, looks to both sides along each size, and goes on from the best. The best
few are then fitted together with the machine's own parameters, whose prior is the posterior of the healthy records.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file, save_file

from indexer_env import OperatingPoint
from twin.descend import again, descended
from twin.synthesis import Synthesis
from twin.work import STEP, Work

POSSIBLE = -4.0
"""Logit above which a fault is thought possible: 2 %."""

_MOST = 4
"""Faults of a turn that are thought possible at once; 16 subsets."""

_ROUNDS = ((3, 3), (2, 3))
"""Starts that go on, and for how many steps."""

_JOINT = 15
"""Most steps of the fit with the machine's own parameters; half of the turns are at rest after four."""

TOGETHER = 8
"""Turns fitted at once, which bounds the memory and what a run that is stopped has to fit again."""

_ALIKE = 1e-3
"""Largest difference of what networks say of a turn, as logits and shares, when they are asked again."""

_SIDE_BY_SIDE = 2
"""Threads that fit: the simulator of one has all cores while the other builds its machines in Python."""


@dataclass(frozen=True, eq=False)
class Fits:
    """Turns fitted.

    Attributes
    ----------
    size, error : ndarray (n, faults)
        Sizes and their standard deviations; 0 and infinite where a fault was not thought possible.
    left : ndarray (n,)
        q at the sizes.
    rattling : ndarray (n,)
        How much the cam turns of the measured turn differ by chance: tr C_chance over tr C_noise.
    """

    size: np.ndarray
    error: np.ndarray
    left: np.ndarray
    rattling: np.ndarray


def fitted(
    of: Synthesis, x: np.ndarray, points: Sequence[OperatingPoint], told: Mapping[str, np.ndarray],
    advance: Callable[..., None] = lambda turns, earlier=False: None, folder: Path | None = None,
) -> Fits:  # fmt: skip
    """Turns x (n, stations, cells) fitted from what networks say of them; parts that `folder` holds are read, where the
    networks said the same."""

    parts: dict[int, Fits] = {}

    def of_part(first: int) -> tuple[slice, dict[str, np.ndarray], Path | None]:
        part = slice(first, first + TOGETHER)
        file = None if folder is None else folder / f"{first:05d}.safetensors"
        return part, {name: value[part] for name, value in told.items()}, file

    def part_from(first: int) -> Fits:
        part, mine, file = of_part(first)
        found = _fitted(of, x[part], points[part], mine)
        if file is not None:
            _keep(file, found, mine)
        return found

    firsts = range(0, len(x), TOGETHER)
    for first in firsts:
        _, mine, file = of_part(first)
        kept = None if file is None else _kept(file, mine)
        if kept is not None:
            parts[first] = kept
    if parts:
        advance(sum(len(found.left) for found in parts.values()), earlier=True)
    left, pool = [first for first in firsts if first not in parts], ThreadPoolExecutor(_SIDE_BY_SIDE)
    try:
        for first, found in zip(left, pool.map(part_from, left), strict=True):
            parts[first] = found
            advance(len(found.left))
    finally:
        pool.shutdown(cancel_futures=True)
    names = (field.name for field in dataclasses.fields(Fits))
    return Fits(*(np.concatenate([getattr(parts[first], name) for first in firsts]) for name in names))


def _kept(file: Path, told: Mapping[str, np.ndarray]) -> Fits | None:
    """The fits of a file; None where there is none, or it is of other turns or networks: these say of no two turns the
    same."""
    if not file.exists():
        return None
    held = load_file(file)
    for name, value in told.items():
        before = held.pop(f"told.{name}", None)
        if before is None or before.shape != value.shape or not np.allclose(before, value, atol=_ALIKE):
            return None
    return Fits(**held)


def _keep(file: Path, found: Fits, told: Mapping[str, np.ndarray]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    fresh = file.with_suffix(".part")
    held = {**vars(found), **{f"told.{name}": value for name, value in told.items()}}
    save_file({name: np.ascontiguousarray(value) for name, value in held.items()}, fresh)
    fresh.rename(file)


def _fitted(of: Synthesis, x: np.ndarray, points: Sequence[OperatingPoint], told: Mapping[str, np.ndarray]) -> Fits:
    n, f = told["faults"].shape
    ranked = np.argsort(-told["faults"], axis=1)
    possible = told["faults"] > POSSIBLE
    possible[np.arange(n), ranked[:, 0]] = True
    for row, order in zip(possible, ranked, strict=True):
        row[order[_MOST:]] = False
    sign = np.where([fault.signed for fault in of.faults], np.sign(told["size"]), 1.0)
    most = np.array([fault.simulated for fault in of.faults])
    size = sign * np.clip(sign * told["size"], STEP, most)
    station = np.argmax(told["station"], axis=1) if "station" in told else np.zeros(n, dtype=int)
    chance = of.chance(x)
    work = Work(of, of.seen(x), points, possible, station, chance=chance)
    phases = work.phases(np.where(possible, size, 0.0))
    rows, starts = [], []
    for k in range(n):
        mine = np.flatnonzero(possible[k])
        for subset in _subsets(len(mine)):
            start = np.zeros(f)
            start[mine] = size[k, mine] * subset
            rows.append(k)
            starts.append([*start, *phases[k]])
    at = np.array(rows)
    t = np.concatenate([starts, np.zeros((len(at), of.nuisance.count))], axis=1)
    fit = descended(work, t, at, 0)
    for kept, steps in _ROUNDS:
        fit = fit.part(fit.best(kept))
        fit = descended(work, work.scanned(fit.t, fit.at, fit.q), fit.at, steps)
    if of.nuisance.count:
        work = Work(of, work.m, points, possible, station, joint=True, chance=chance)
        fit = descended(work, fit.t, fit.at, _JOINT)
    fit = again(work, fit.part(fit.best()))
    errors = np.array([_errors(c, work.free[k])[:f] for c, k in zip(fit.curvature, fit.at, strict=True)])
    return Fits(fit.t[:, :f], errors, fit.q, np.einsum("nii->n", chance) / np.trace(of.covariance))


def _subsets(count: int) -> Iterable[tuple[float, ...]]:
    """1 for what is in and 0 for what is not, of all subsets."""
    return itertools.product((0.0, 1.0), repeat=count)


def _errors(curvature: np.ndarray, free: np.ndarray) -> np.ndarray:
    errors = np.full(len(free), np.inf)
    within = curvature[np.ix_(free, free)]
    errors[free] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(within + 1e-9 * np.eye(len(within)))), 0.0))
    return errors
