"""Turns beside simulated ones: what is left at some sizes, and how it changes with them.

    q(t, z) = [(m − m(t, z))ᵀ C⁻¹ (m − m(t, z)) + |z|²] / k

t are sizes and phases, z the machine's own parameters in units of the posterior.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env import Machine, OperatingPoint, Sensor, simulate_batch
from indexer_env.effects import MachineEffect, SensorEffect
from indexer_env.errors import ParameterError
from twin.synthesis import Synthesis, effect_of
from twin.turns import behind_lead_in, lead_in

_FACTORS = (0.7, 0.8, 0.9, 1.1, 1.25, 1.4)
"""By which sizes are multiplied, one at a time, before steps are taken: in play q is rough, and steps get stuck."""

STEP = 0.01
"""Step of a size by which its derivative is taken; the motion is not smooth in play, so not smaller."""

LEAST, LARGEST = 2e-3, 1.0
"""Sizes between which faults are simulated; a base less loose than the first is too stiff for the step in time."""

_STRIDE = 0.3
"""Largest change of a size in a step."""

_TURN_STEP = 0.05
"""rad; step of a phase."""

_PHASES = 8
"""Phases from which a fault that has one starts."""

BAD = 1e12
"""q of what cannot be simulated."""

_OWN_STEP, _OWN_STRIDE, _WIDEST = 0.5, 1.0, 4.0
"""Of the machine's own parameters, in standard deviations: step of a derivative, largest change in a step, bound."""


@dataclass
class Beside:
    """Simulated turns beside measured ones: modes m, weight of their remainder, remainder, q."""

    m: np.ndarray
    weight: np.ndarray
    off: np.ndarray
    q: np.ndarray

    def part(self, rows: np.ndarray) -> Beside:
        """Some of the turns."""
        return Beside(self.m[rows], self.weight[rows], self.off[rows], self.q[rows])

    def put(self, rows: np.ndarray, other: Beside) -> None:
        """Other turns in the place of these."""
        for name, given in vars(other).items():
            getattr(self, name)[rows] = given


class Work:
    """Turns that are fitted together. Unknown are the sizes, the phases of the faults that have one, and, where the
    fit is `joint`, the machine's own parameters; else what they leave open widens the covariance."""

    def __init__(
        self, of: Synthesis, m: np.ndarray, points: Sequence[OperatingPoint], possible: np.ndarray, station: np.ndarray,
        joint: bool = False, chance: np.ndarray | float = 0.0,
    ) -> None:  # fmt: skip
        self.of, self.m, self.points, self.station = of, m, points, station
        self.open = (np.repeat(of.covariance[None], len(m), axis=0) if joint else of.open_at(m)) + chance
        self.phased = [place for place, fault in enumerate(of.faults) if "phase" in fault.others]
        f, p, g = possible.shape[1], len(self.phased), of.nuisance.count
        self.sizes, self.own = slice(0, f), slice(f + p, f + p + g)
        own = np.full((len(m), g), joint)
        self.free = np.concatenate([possible, possible[:, self.phased], own], axis=1)
        signed = np.array([fault.signed for fault in of.faults])
        self.low = np.concatenate([np.where(signed, -LARGEST, 0.0), np.full(p, -math.inf), np.full(g, -_WIDEST)])
        most = np.array([fault.simulated for fault in of.faults])
        self.high = np.concatenate([most, np.full(p, math.inf), np.full(g, _WIDEST)])
        self.step = np.array([STEP] * f + [_TURN_STEP] * p + [_OWN_STEP] * g)
        self.stride = np.array([_STRIDE] * (f + p) + [_OWN_STRIDE] * g)
        self.prior = np.array([0.0] * (f + p) + [1.0] * g) / m.shape[1]
        self.reference = of.healthy.turns(points)
        self.sigma = np.array([of.sigma(point) for point in points])
        self.shapes = np.array([of.shapes(r, sigma) for r, sigma in zip(self.reference, self.sigma, strict=True)])

    def phases(self, size: np.ndarray) -> np.ndarray:
        """Phases (n, phased) that fit best of some tried, one fault after the other."""
        found = np.zeros((len(size), len(self.phased)))
        for column, place in enumerate(self.phased):
            mine = np.flatnonzero(self.free[:, place])
            if len(mine):
                at = np.repeat(mine, _PHASES)
                tried = np.concatenate([size[at], found[at], np.zeros((len(at), self.of.nuisance.count))], axis=1)
                phases = 2.0 * math.pi * np.arange(_PHASES) / _PHASES
                tried[:, size.shape[1] + column] = np.tile(phases, len(mine))
                found[mine, column] = phases[np.argmin(self.at(tried, at).q.reshape(-1, _PHASES), axis=1)]
        return found

    def at(self, t: np.ndarray, at: np.ndarray) -> Beside:
        """The turns `at` at the unknowns t (n, u) beside their measured ones."""
        x = self.simulated(t, at)
        m, chance = self.of.seen(x), self.of.components.scatter(x)
        bad = ~np.isfinite(m).all(axis=1)
        chance[bad], m[bad] = 0.0, 0.0
        moved = self.shifted(x, at)
        moved[bad] = 0.0
        weight = np.linalg.inv(self.open[at] + chance + moved.transpose(0, 2, 1) @ moved) / m.shape[1]
        off = self.m[at] - m
        q = np.einsum("ni,nij,nj->n", off, weight, off) + t**2 @ self.prior
        q[bad] = BAD
        return Beside(m, weight, off, q)

    def shifted(self, x: np.ndarray, at: np.ndarray) -> np.ndarray:
        """What one standard deviation of each shift adds along the axes (n, 2, k) to turns x (n, stations, cells): it
        moves what a fault does to the turn, too."""
        shapes = self.of.shapes(x).reshape(len(x), 2, -1)
        still = _without(shapes, np.asarray(self.shapes[at], dtype=float).reshape(len(x), 2, -1))
        return self.of.seen(still.reshape(2 * len(x), *x.shape[1:])).reshape(len(x), 2, -1)

    def scanned(self, t: np.ndarray, at: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Unknowns t (n, u), one size of each turn changed where that lessens q."""
        row, place = np.nonzero((self.free[at] & (t != 0.0))[:, self.sizes])
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

    def slopes(self, t: np.ndarray, at: np.ndarray, now: Beside) -> np.ndarray:
        """dm/dt (n, k, u) at unknowns t (n, u), 0 where one is not free or cannot be simulated beside."""
        row, place = np.nonzero(self.free[at])
        slopes = np.zeros((len(t), self.m.shape[1], t.shape[1]))
        if not len(row):
            return slopes
        step = np.where(t[row, place] > self.high[place] - self.step[place], -1.0, 1.0) * self.step[place]
        moved = t[row].copy()
        moved[np.arange(len(row)), place] += step
        beside = self.at(moved, at[row])
        fine = beside.q < BAD
        slopes[row, :, place] = np.where(fine[:, None], (beside.m - now.m[row]) / step[:, None], 0.0)
        return slopes

    def simulated(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """x (n, stations, cells) at the unknowns t (n, u); NaN where it cannot be simulated."""
        healthy, cells = self.of.healthy, self.of.healthy.cells
        made = [self._machine(*row) for row in zip(t, self.station[at].tolist(), strict=True)]
        points = [self.points[k] for k in at]
        leads = [
            lead_in(healthy.machine, cells, p.motor_speed, factor * p.load_torque)
            for p, (_, _, factor) in zip(points, made, strict=True)
        ]
        longest = max((run for _, run in leads), key=lambda run: run.samples or 0)
        batch = simulate_batch([machine for machine, *_ in made], [point for point, _ in leads], longest)
        x = np.full((len(at), *self.reference.shape[1:]), np.nan)
        for k, (acceleration, point) in enumerate(zip(batch.channels["table_acceleration"], points, strict=True)):
            if k not in batch.rejected:
                # A bracket that hardly gives resonates above what the rate can show.
                with contextlib.suppress(ParameterError):
                    values = made[k][1].read(acceleration, cells.rate).values
                    x[k] = behind_lead_in(healthy.machine, cells, values, point.motor_speed)
        x = (x - self.reference[at]) / self.sigma[at, None, None]
        flat = x.reshape(len(at), 1, -1)
        return _without(flat, self.shapes[at].reshape(len(at), 2, -1)).reshape(x.shape)

    def _machine(self, t: np.ndarray, station: int) -> tuple[Machine, Sensor, float]:
        sound, f = self.of.healthy.machine, len(self.of.faults)
        own = self.of.nuisance.at(t[self.own], sound, self.of.healthy.sensor, self.of.healthy.load_factor)
        machine, sensor, factor = own
        phase = dict(zip(self.phased, t[f : self.own.start].tolist(), strict=True))
        for place, size in enumerate(t[self.sizes].tolist()):
            if size != 0.0:
                effect = effect_of(self.of.faults[place], size, sound, phase.get(place, 0.0), station, *own[:2])
                if isinstance(effect, MachineEffect):
                    machine = machine.with_effects(effect)
                elif isinstance(effect, SensorEffect):
                    sensor = effect.extend_sensor(sensor)
        return machine, sensor, factor


def _without(rows: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Rows (n, r, c) of turns without the most likely shift along shapes (n, 2, c)."""
    across = shapes.transpose(0, 2, 1)
    return (
        rows
        - np.linalg.solve(shapes @ across + np.eye(2), shapes @ rows.transpose(0, 2, 1)).transpose(0, 2, 1) @ shapes
    )
