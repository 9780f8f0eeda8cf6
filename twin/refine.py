"""Sizes that fit a turn: what the networks estimate, moved until the simulated turn is the measured one.

    t̂ = argmin q(t),   q as `synthesis` has it

by Levenberg and Marquardt's method, sizes within their range. There are several minima, so it starts at all subsets of
the faults that the networks think possible, looks to both sides along each size, and goes on from the best.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env import Machine, OperatingPoint, Sensor, simulate_batch
from indexer_env.effects import MachineEffect, SensorEffect
from indexer_env.errors import ParameterError
from twin.synthesis import Synthesis, effect_of
from twin.turns import behind_lead_in, lead_in

POSSIBLE = -4.0
"""Logit above which a fault is thought possible: 2 %."""

_MOST = 4
"""Faults of a turn that are thought possible at once; 16 subsets."""

_ROUNDS = ((3, 3), (1, 5))
"""Starts that go on, and for how many steps."""

_FACTORS = (0.7, 0.8, 0.9, 1.1, 1.25, 1.4)
"""By which sizes are multiplied, one at a time, before steps are taken: in play q is rough, and steps get stuck."""

_STEP = 0.01
"""Step of a size by which its derivative is taken; the motion is not smooth in play, so not smaller."""

_LEAST, LARGEST = 2e-3, 0.99
"""Sizes between which faults are simulated; a base less loose than the first is too stiff for the step in time."""

_STRIDE = 0.3
"""Largest change of a size in a step."""

_TURN_STEP = 0.05
"""rad; step of a phase."""

_PHASES = 8
"""Phases from which a fault that has one starts."""

TOGETHER = 64
"""Turns fitted at once, which bounds the memory."""

BAD = 1e12
"""q of what cannot be simulated."""


@dataclass(frozen=True, eq=False)
class Fits:
    """Turns fitted.

    Attributes
    ----------
    size, error : ndarray (n, faults)
        Sizes and their standard deviations; 0 and infinite where a fault was not thought possible.
    left : ndarray (n,)
        q at the sizes.
    """

    size: np.ndarray
    error: np.ndarray
    left: np.ndarray


def fitted(
    of: Synthesis, x: np.ndarray, points: Sequence[OperatingPoint], told: Mapping[str, np.ndarray],
    advance: Callable[[int], None] = lambda turns: None,
) -> Fits:  # fmt: skip
    """Turns x (n, stations, cells) fitted from what networks say of them."""
    parts = []
    for first in range(0, len(x), TOGETHER):
        part = slice(first, first + TOGETHER)
        parts.append(_fitted(of, x[part], points[part], {name: value[part] for name, value in told.items()}))
        advance(len(x[part]))
    return Fits(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("size", "error", "left")))


def _fitted(of: Synthesis, x: np.ndarray, points: Sequence[OperatingPoint], told: Mapping[str, np.ndarray]) -> Fits:
    n, f = told["faults"].shape
    ranked = np.argsort(-told["faults"], axis=1)
    possible = told["faults"] > POSSIBLE
    possible[np.arange(n), ranked[:, 0]] = True
    for row, order in zip(possible, ranked, strict=True):
        row[order[_MOST:]] = False
    sign = np.where([fault.signed for fault in of.faults], np.sign(told["size"]), 1.0)
    size = sign * np.clip(sign * told["size"], _STEP, LARGEST)
    station = np.argmax(told["station"], axis=1) if "station" in told else np.zeros(n, dtype=int)
    work = Work(of, of.seen(x), points, possible, station)
    phases = work.phases(np.where(possible, size, 0.0))
    rows, starts = [], []
    for k in range(n):
        mine = np.flatnonzero(possible[k])
        for subset in _subsets(len(mine)):
            start = np.zeros(f)
            start[mine] = size[k, mine] * subset
            rows.append(k)
            starts.append([*start, *phases[k]])
    at, t = np.array(rows), np.array(starts)
    q, curvature = work.at(t, at).q, np.zeros((len(at), t.shape[1], t.shape[1]))
    for kept, steps in _ROUNDS:
        best = _best(at, q, kept)
        at, t, q, curvature = work.moved(work.scanned(t[best], at[best], q[best]), at[best], steps)
    best = _best(at, q, 1)
    errors = np.array([_errors(c, work.free[k])[:f] for c, k in zip(curvature[best], at[best], strict=True)])
    return Fits(t[best, :f], errors, q[best])


def _subsets(count: int) -> Iterable[tuple[float, ...]]:
    """1 for what is in and 0 for what is not, of all subsets."""
    return itertools.product((0.0, 1.0), repeat=count)


def _best(at: np.ndarray, q: np.ndarray, kept: int) -> np.ndarray:
    """Places of the best few of each turn."""
    order = np.lexsort((q, at))
    rank = np.arange(len(at)) - np.searchsorted(at[order], at[order])
    return order[rank < kept]


def _errors(curvature: np.ndarray, free: np.ndarray) -> np.ndarray:
    errors = np.full(len(free), np.inf)
    within = curvature[np.ix_(free, free)]
    errors[free] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(within + 1e-9 * np.eye(len(within)))), 0.0))
    return errors


@dataclass
class _At:
    m: np.ndarray
    weight: np.ndarray
    off: np.ndarray
    q: np.ndarray


class Work:
    """Turns that are fitted together. Unknown are the sizes, then the phases of the faults that have one."""

    def __init__(
        self, of: Synthesis, m: np.ndarray, points: Sequence[OperatingPoint], possible: np.ndarray, station: np.ndarray
    ) -> None:
        self.of, self.m, self.points, self.station = of, m, points, station
        self.open = of.open_at(m)
        self.phased = [place for place, fault in enumerate(of.faults) if "phase" in fault.others]
        self.free = np.concatenate([possible, possible[:, self.phased]], axis=1)
        f, p = possible.shape[1], len(self.phased)
        signed = np.array([fault.signed for fault in of.faults])
        self.low = np.concatenate([np.where(signed, -LARGEST, 0.0), np.full(p, -math.inf)])
        self.high = np.concatenate([np.full(f, LARGEST), np.full(p, math.inf)])
        self.step = np.array([_STEP] * f + [_TURN_STEP] * p)
        self.reference = of.healthy.turns(points)
        self.shapes = np.array([of.shapes(r) for r in self.reference])

    def phases(self, size: np.ndarray) -> np.ndarray:
        """Phases (n, phased) that fit best of some tried, one fault after the other."""
        found = np.zeros((len(size), len(self.phased)))
        for column, place in enumerate(self.phased):
            mine = np.flatnonzero(self.free[:, place])
            if len(mine):
                at = np.repeat(mine, _PHASES)
                tried = np.concatenate([size[at], found[at]], axis=1)
                phases = 2.0 * math.pi * np.arange(_PHASES) / _PHASES
                tried[:, size.shape[1] + column] = np.tile(phases, len(mine))
                found[mine, column] = phases[np.argmin(self.at(tried, at).q.reshape(-1, _PHASES), axis=1)]
        return found

    def at(self, t: np.ndarray, at: np.ndarray) -> _At:
        """The turns `at` at the unknowns t (n, u) beside their measured ones."""
        x = self.simulated(t, at)
        own = x @ self.of.axes
        m = math.sqrt(x.shape[1]) * own.mean(axis=1)
        own -= own.mean(axis=1, keepdims=True)
        chance = np.einsum("nsi,nsj->nij", own, own) / (x.shape[1] - 1)
        bad = ~np.isfinite(m).all(axis=1)
        chance[bad], m[bad] = 0.0, 0.0
        weight = np.linalg.inv(self.open[at] + chance) / m.shape[1]
        off = self.m[at] - m
        q = np.einsum("ni,nij,nj->n", off, weight, off)
        q[bad] = BAD
        return _At(m, weight, off, q)

    def scanned(self, t: np.ndarray, at: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Unknowns t (n, u), one size of each turn changed where that lessens q."""
        row, place = np.nonzero(self.free[at] & (t != 0.0) & np.isfinite(self.high))
        if not len(row):
            return t
        factor = np.tile(_FACTORS, len(row))
        row, place = np.repeat(row, len(_FACTORS)), np.repeat(place, len(_FACTORS))
        tried = t[row].copy()
        tried[np.arange(len(row)), place] *= factor
        tried = np.clip(tried, self.low, self.high)
        found = self.at(tried, at[row]).q
        best = t.copy()
        for k in range(len(t)):
            mine = np.flatnonzero(row == k)
            if len(mine) and found[mine].min() < q[k]:
                best[k] = tried[mine[np.argmin(found[mine])]]
        return best

    def moved(self, t: np.ndarray, at: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Unknowns after so many steps, with the turns, q and the curvature of k q at them."""
        n, u = t.shape
        sizes = np.arange(u) < len(self.of.faults)
        now, damping, curvature = self.at(t, at), np.full(n, 1e-2), np.zeros((n, u, u))
        for _ in range(steps):
            slopes = self._slopes(t, at, now)
            curvature = np.einsum("nki,nkl,nlj->nij", slopes, now.weight, slopes)
            pull = np.einsum("nki,nkl,nl->ni", slopes, now.weight, now.off)
            held = ~self.free[at] | ((t <= self.low) & (pull <= 0.0))
            matrix = np.where(held[:, :, None] | held[:, None, :], 0.0, curvature)
            diagonal = np.einsum("nii->ni", matrix)
            matrix = matrix + (damping[:, None] * diagonal + held + 1e-6)[:, :, None] * np.eye(u)
            step = np.linalg.solve(matrix, np.where(held, 0.0, pull)[:, :, None])[:, :, 0]
            new = np.clip(t + np.clip(step, -_STRIDE, _STRIDE), self.low, self.high)
            new[sizes & (np.abs(new) < _LEAST)] = 0.0
            then = self.at(new, at)
            better = then.q < now.q
            t = np.where(better[:, None], new, t)
            for name in ("m", "weight", "off", "q"):
                old = getattr(now, name)
                chosen = better.reshape((-1,) + (1,) * (old.ndim - 1))
                setattr(now, name, np.where(chosen, getattr(then, name), old))
            damping = np.where(better, damping / 5.0, damping * 8.0)
        return at, t, now.q, curvature * now.m.shape[1]

    def _slopes(self, t: np.ndarray, at: np.ndarray, now: _At) -> np.ndarray:
        """dm/dt (n, k, u)."""
        n, u = t.shape
        row, place = np.nonzero(self.free[at])
        step = np.where(t[row, place] > self.high[place] - self.step[place], -1.0, 1.0) * self.step[place]
        moved = t[row].copy()
        moved[np.arange(len(row)), place] += step
        beside = self.at(moved, at[row])
        slopes = np.zeros((n, now.m.shape[1], u))
        fine = beside.q < BAD
        slopes[row, :, place] = np.where(fine[:, None], (beside.m - now.m[row]) / step[:, None], 0.0)
        return slopes

    def simulated(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """x (n, stations, cells) at the unknowns t (n, u); NaN where it cannot be simulated."""
        healthy, cells = self.of.healthy, self.of.healthy.cells
        made = [self._machine(*row) for row in zip(t, self.station[at].tolist(), strict=True)]
        points = [self.points[k] for k in at]
        factor = healthy.load_factor
        leads = [lead_in(healthy.machine, cells, p.motor_speed, factor * p.load_torque) for p in points]
        longest = max((run for _, run in leads), key=lambda run: run.samples or 0)
        batch = simulate_batch([machine for machine, _ in made], [point for point, _ in leads], longest)
        x = np.full((len(at), *self.reference.shape[1:]), np.nan)
        for k, (acceleration, point) in enumerate(zip(batch.channels["table_acceleration"], points, strict=True)):
            if k not in batch.rejected:
                # A bracket that hardly gives resonates above what the rate can show.
                with contextlib.suppress(ParameterError):
                    values = made[k][1].read(acceleration, cells.rate).values
                    x[k] = behind_lead_in(healthy.machine, cells, values, point.motor_speed)
        x = (x - self.reference[at]) / self.of.noise
        D = self.shapes[at].reshape(len(at), 2, -1)
        flat = x.reshape(len(at), -1)
        shift = np.linalg.solve(D @ D.transpose(0, 2, 1) + np.eye(2), D @ flat[:, :, None])
        return (flat - (shift.transpose(0, 2, 1) @ D)[:, 0]).reshape(x.shape)

    def _machine(self, t: np.ndarray, station: int) -> tuple[Machine, Sensor]:
        sound, sensor = self.of.healthy.machine, self.of.healthy.sensor
        machine, f = sound, len(self.of.faults)
        phase = dict(zip(self.phased, t[f:].tolist(), strict=True))
        for place, size in enumerate(t[:f].tolist()):
            if size != 0.0:
                effect = effect_of(self.of.faults[place], size, sound, phase.get(place, 0.0), station)
                if isinstance(effect, MachineEffect):
                    machine = machine.with_effects(effect)
                elif isinstance(effect, SensorEffect):
                    sensor = effect.extend_sensor(sensor)
        return machine, sensor
