"""One hypothesis about a model's records: its cost, its normal equations, and the search of every window's start state.

Cost, in units of twice a log-likelihood times the dispersion φ:

    F(z, y) = Σ_w ρ_w(‖r_w(z, y_w)‖²) + φ Σ_known z²,     ρ_w(q) = n_w c ln(1 + q/(n_w c))

The Cauchy loss bounds what one window can hold against the others: where play lets a window's start state be missed,
the window loses its weight 1/(1 + q/(n c)) instead of bending the machine. While a fit goes on, c follows the median
misfit, so that only windows that are worse than most lose weight: an effect that spares a few windows would otherwise
be fitted to those alone. Windows without unknown start states have plain squares, ρ(q) = q: there is nothing to miss.
φ, at least 1, is the median mean square of the windows: what a model gets wrong everywhere is no evidence against what
is known of its parameters (quasi-likelihood; McCullagh and Nelder, Generalized Linear Models, 1989, section 9.2).
Windows are independent given z, so each one keeps the best start state of all that were tried.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence

import numpy as np

from discrepancy.arrow import Arrow, arrow
from discrepancy.grids import by_size
from discrepancy.jobs import Jobs
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point

_GLOBAL_NUDGE, _LOCAL_NUDGE = 1e-3, 1e-2
"""Finite differences in scaled coordinates: far above rounding, far below the distance between two contacts."""

_EASE = 3.0
"""c over the median of the windows' mean square: what is three times worse than most counts half."""

_ROUNDS = 2
"""Steps by which start states near to good ones are refined."""

_POLISHED, _ONE_OF = 3, 56
"""Start states per window, the best of the grid, that are refined before the best of them is kept: so many, and one of
so many where the grid is large."""

_DAMPINGS = np.array([1e-4, 1e-1, 10.0])[:, None, None]
"""With which a start state's step is tried."""

_AT_ONCE = 8192
"""Start states simulated at once, or those of one window, which bounds the memory."""


class Problem:
    """One hypothesis about a model's records, with the operations a fit is made of.

    `caution` multiplies the machine's priors while an effect may be missing, as its misfit repeats in every window;
    rough parameters are held while it is above 1.
    With `frozen`, only what belongs to single records moves: start states and the parameters `of_record`. Parameters
    that are `held` do not move. Priors weigh φ of the place, or the `dispersion` that is given.
    """

    def __init__(
        self, model: Model, hypothesis: Hypothesis, *, frozen: bool = False, caution: float = 1.0,
        held: Sequence[int] = (), dispersion: float | None = None,
    ) -> None:  # fmt: skip
        self.model, self.hypothesis, self.ease = model, hypothesis, 1.0
        self.dispersion = dispersion
        self.parameters = model.parameters + hypothesis.parameters
        fixed = [not p.of_record and (frozen or (p.rough and caution > 1.0)) for p in self.parameters]
        self.movable = ~np.array(fixed)
        self.movable[list(held)] = False
        self.known = np.array([p.known for p in self.parameters])
        self.of_machine = ~np.array([p.of_record for p in self.parameters])
        # a play that is held while starts race costs what it costs in the end, so that sets held elsewhere compare
        self.precision = self.known * np.where(self.of_machine & ~np.array(fixed), caution, 1.0)
        bounds = np.array([p.bounds for p in self.parameters])
        self.low, self.high = bounds[:, 0], bounds[:, 1]
        self.all = np.arange(len(model.counts))
        self.stateful = model.local_count(hypothesis) > 0
        self.columns = self._columns()

    def _columns(self) -> list[list[int]]:
        """Movable parameters, those together that belong to different records and so never touch one window."""
        columns: dict[object, list[int]] = {}
        counted: dict[int, int] = {}
        for k in np.flatnonzero(self.movable).tolist():
            record = self.parameters[k].record
            if record is None:
                columns["global", k] = [k]
            else:
                counted[record] = counted.get(record, 0) + 1
                columns.setdefault(("record", counted[record]), []).append(k)
        return list(columns.values())

    def point(self, z: np.ndarray, states: np.ndarray) -> Point:
        """The place (z, states) with its cost."""
        return self.points(z[None], states[None])[0]

    def points(self, z: np.ndarray, states: np.ndarray) -> list[Point]:
        """Places (p, g), (p, w, l) with their costs."""
        squares = self.model.squares(self.hypothesis, self._everywhere(z, states)).reshape(states.shape[:2])
        return [self._scored(*place) for place in zip(z, states, squares, strict=True)]

    def adopted(self, place: Point) -> Point:
        """A place of a problem that differs in caution alone, with the cost it has here."""
        return self._scored(place.z, place.states, place.squares)

    def _scored(self, z: np.ndarray, states: np.ndarray, squares: np.ndarray) -> Point:
        return Point(self.hypothesis, z, states, squares, float(self.losses(squares).sum()) + float(self.prior(z)))

    def losses(self, squares: np.ndarray, windows: np.ndarray | None = None) -> np.ndarray:
        """ρ_w (…, w) of squares (…, w) of all windows, or of these (w,)."""
        if not self.stateful:
            return squares
        n = self.model.counts[self.all if windows is None else windows] * self.ease
        return n * np.log1p(squares / n)

    def weights(self, squares: np.ndarray) -> np.ndarray:
        """dρ_w/dq of squares (..., w)."""
        if not self.stateful:
            return np.ones_like(squares)
        return 1.0 / (1.0 + squares / (self.model.counts * self.ease))

    def eased(self, place: Point) -> Problem:
        """The same problem with c = a few times the median misfit of a place, at least 1, and with its dispersion."""
        phi = place.dispersion(self.model)
        problem = copy.copy(self)
        problem.ease = max(1.0, _EASE * phi)
        problem.precision = self.precision * (self.dispersion or phi)
        return problem

    def deviance(self, place: Point, dispersion: float) -> float:
        """Twice a negative log-likelihood of a place under a dispersion φ that all places compared have in common:
        Σ_w ρ_w/φ with c = φ, plus Σ_known z²."""
        problem = copy.copy(self)
        problem.ease = dispersion
        return float(problem.losses(place.squares).sum()) / dispersion + float((self.known * place.z**2).sum())

    def prior(self, z: np.ndarray) -> np.ndarray:
        """Σ z² (...) of places (..., g) over the parameters that are known to their scale, times the caution where they
        are the machine's."""
        return (self.precision * z**2).sum(axis=-1)

    def residuals(self, z: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Residuals (p, w, n) of all windows at places (p, g), (p, w, l)."""
        return self.model.residuals(self.hypothesis, self._everywhere(z, states)).reshape(*states.shape[:2], -1)

    def left(self, place: Point) -> np.ndarray:
        """Residuals (w, n) of all windows at a place."""
        return self.residuals(place.z[None], place.states[None])[0]

    def _everywhere(self, z: np.ndarray, states: np.ndarray) -> Jobs:
        """All windows at places (p, g), (p, w, l)."""
        p, w = len(z), len(self.all)
        return Jobs(z, np.repeat(np.arange(p), w), np.tile(self.all, p), states.reshape(p * w, -1))

    def linearised(self, place: Point, nudge: float = _GLOBAL_NUDGE) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residuals (w, n) and their derivatives by the globals (g, w, n), by differences of `nudge`, and by the local
        states (l, w, n)."""
        columns, size = self.columns, place.states.shape[1]
        g = len(columns)
        outside = (place.z + nudge > self.high) | (place.z + nudge < self.low)
        inward = np.where(outside, -nudge, nudge)
        z = np.repeat(place.z[None], 1 + g + size, axis=0)
        states = np.repeat(place.states[None], 1 + g + size, axis=0)
        for row, column in enumerate(columns, start=1):
            z[row, column] += inward[column]
        states[1 + g + np.arange(size), :, np.arange(size)] += _LOCAL_NUDGE
        r = self.residuals(z, states)
        changes = r[1:] - r[0]
        by_global = np.zeros((len(place.z), *r[0].shape))
        for change, column in zip(changes, columns, strict=False):
            for k in column:
                record = self.parameters[k].record
                mine = True if record is None else (self.model.groups == record)[:, None]
                np.divide(change, inward[k], out=by_global[k], where=mine)
        return r[0], by_global, changes[g:] / _LOCAL_NUDGE

    def equations(self, place: Point) -> Arrow:
        """Weighted normal equations at a place, priors included."""
        return self.system(*self.linearised(place), place.z)

    def system(self, r: np.ndarray, by_global: np.ndarray, by_local: np.ndarray, z: np.ndarray) -> Arrow:
        """The same, given what `linearised` gives there."""
        system = arrow(r, by_global, by_local, self.weights(np.einsum("wn,wn->w", r, r)))
        return self.informed(system, z)

    def informed(self, system: Arrow, z: np.ndarray) -> Arrow:
        """Normal equations at z with the priors added."""
        return Arrow(system.A + np.diag(self.precision), system.a + self.precision * z, system.B, system.b, system.C)

    def free(self, place: Point, system: Arrow) -> np.ndarray:
        """Globals (g,) that may move: not those at a bound that the cost pushes against."""
        outward = ((place.z >= self.high) & (system.a < 0.0)) | ((place.z <= self.low) & (system.a > 0.0))
        return self.movable & ~outward & (np.diag(system.A) > 1e-12)

    def settled(self, place: Point, rounds: int = _ROUNDS, which: np.ndarray | None = None) -> Point:
        """The place with its windows' start states refined, the globals held."""
        windows = self.all if which is None else which
        states, squares = self._refined(Jobs.at(place.z, windows, place.states[windows]), rounds)
        return self._replaced(place, windows, states, squares)

    def settled_together(self, z: np.ndarray, states: np.ndarray) -> np.ndarray:
        """States (p, w, l) of places (p, g), (p, w, l) after one step of `settled`, faster than place by place."""
        return self._refined(self._everywhere(z, states), 1)[0].reshape(states.shape)

    def started(self, z: np.ndarray, states: np.ndarray, windows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Start states (p, k, l) of some windows (k,) at places (p, g), (p, w, l), looked for over their grids and
        refined, and their squares (p, k)."""
        p, k, size = len(z), len(windows), states.shape[2]
        found, squares = np.empty((p, k, size)), np.empty((p, k))
        grids = [self.model.state_grid(self.hypothesis, row, shaken=True) for row in z]
        apart = any(map(len, grids))
        for points, each in by_size(grids, _AT_ONCE // max(k, 1)):
            mine = np.repeat(np.arange(len(points)), k)
            own = states[points][:, windows].reshape(len(mine), size)
            jobs = Jobs(z[points], mine, np.tile(windows, len(points)), own, apart)
            if len(each):
                kept = max(_POLISHED, len(each) // _ONE_OF)
                best = self._best_starts(jobs, each[:, mine], own[:0], kept, rounds=1)
            else:
                best = self._refined(jobs, _ROUNDS)
            found[points], squares[points] = best[0].reshape(len(points), k, size), best[1].reshape(len(points), k)
        return found, squares

    def _replaced(self, place: Point, windows: np.ndarray, states: np.ndarray, squares: np.ndarray) -> Point:
        better = squares < place.squares[windows]
        all_states, all_squares = place.states.copy(), place.squares.copy()
        all_states[windows[better]], all_squares[windows[better]] = states[better], squares[better]
        return self._scored(place.z, all_states, all_squares)

    def _refined(self, jobs: Jobs, rounds: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss–Newton on the start states (k, l) of jobs in one or more rounds; refined states and their squares."""
        states = jobs.states
        k, size = states.shape
        if not size:
            return states, self.model.squares(self.hypothesis, jobs)
        for _ in range(rounds):
            nudged = np.repeat(states[None], size + 1, axis=0)
            nudged[1 + np.arange(size), :, np.arange(size)] += _LOCAL_NUDGE
            r = self.model.residuals(self.hypothesis, jobs.each(nudged)).reshape(size + 1, k, -1)
            squares = np.einsum("wn,wn->w", r[0], r[0])
            slope = np.moveaxis((r[1:] - r[0]) / _LOCAL_NUDGE, 0, 1)
            B, b = slope @ np.swapaxes(slope, 1, 2), (slope @ r[0][:, :, None])[:, :, 0]
            diagonal = np.einsum("wii->wi", B)
            damped = B + np.eye(size) * (_DAMPINGS * diagonal + 1e-4)[..., None]
            tried = states - np.linalg.solve(damped, np.broadcast_to(b[..., None], (*damped.shape[:3], 1)))[..., 0]
            costs = np.concatenate([squares[None], self._tried(jobs, tried)])
            best = costs.argmin(axis=0)
            states = np.concatenate([states[None], tried])[best, np.arange(k)]
            squares = costs[best, np.arange(k)]
        return states, squares

    def _tried(self, jobs: Jobs, states: np.ndarray) -> np.ndarray:
        """Sums of squares (c, k) of jobs (k,) from each of the states (c, k, l) that are tried."""
        return self.model.squares(self.hypothesis, jobs.each(states)).reshape(states.shape[:2])

    def searched(self, place: Point, which: np.ndarray | None = None) -> Point:
        """The place with the windows' start states looked for over the whole grid, then refined; of windows that are
        named, also where other windows start: they repeat each other."""
        windows = self.all if which is None else which
        grid = self.model.state_grid(self.hypothesis, place.z, shaken=True)
        if not len(windows):
            return place
        if not len(grid):
            return self.settled(place, which=windows)
        kept = max(_POLISHED, len(grid) // _ONE_OF)
        others = place.states if which is not None else place.states[:0]
        at_once = max(1, _AT_ONCE // (len(grid) + len(others)))
        for part in np.array_split(windows, math.ceil(len(windows) / at_once)):
            jobs = Jobs.at(place.z, part, place.states[part])
            place = self._replaced(place, part, *self._best_starts(jobs, grid[:, None], others, kept))
        return place

    def _best_starts(
        self, jobs: Jobs, grids: np.ndarray, others: np.ndarray, kept: int, rounds: int = 3
    ) -> tuple[np.ndarray, np.ndarray]:
        """Start states (k, l) of jobs (k,) and their squares: the best of grids (c, k, 2), or of one for all (c, 1, 2),
        and of other states (o, l) after the best `kept` are refined, the best of those in all rounds."""
        k = len(jobs.window)
        states = np.repeat(jobs.states[None], len(grids), axis=0)
        states[:, :, : grids.shape[2]] = grids
        states = np.concatenate([states, np.repeat(others[:, None], k, axis=1)])
        order = np.argsort(self._tried(jobs, states), axis=0)[:kept]
        polished, squares = self._refined(jobs.each(states[order, np.arange(k)]), rounds=1)
        squares = squares.reshape(-1, k)
        first = squares.argmin(axis=0)
        states, squares = polished.reshape(len(order), k, -1)[first, np.arange(k)], squares[first, np.arange(k)]
        if rounds > 1:
            states, squares = self._refined(jobs.each(states[None]), rounds - 1)
        return states, squares

    def merged(self, a: Point, b: Point) -> Point:
        """Of two places with equal globals, the better start state of each window."""
        return self._replaced(a, self.all, b.states, b.squares)

    def pooled(self, place: Point, others: Iterable[Point]) -> Point:
        """The place with the best start state of each window, of its own and of those found under other hypotheses."""
        for other in others:
            states = self.model.states_for(self.hypothesis, other.states)
            place = self.merged(place, self.point(place.z, states))
        return place
