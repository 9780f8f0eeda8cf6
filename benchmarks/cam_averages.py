"""Naming by cam-synchronous averages and a synthetic likelihood: no start state is fitted, only the mean cam turn.

With play a machine's turns differ, its mean turn hardly does. The statistic s is the mean over a record's cam turns of
(simulated - measured)/noise in each of `BINS` cells of the cam's phase, or in those of each station. The machine is
simulated over whole records from several start states drawn anywhere in the play; s is then the mean of these repeats,
and

    F(z) = sᵀ C⁻¹ s + Σ_known z²,     C = N + (1 + 1/R) ((1 - a) V + a diag V)

with V the covariance of s among many such repeats of the nominal machine, N that of the measuring noise, R the repeats
of a simulation (Wood, Nature 466 (2010) 1102; C is held, so that its determinant plays no part). There are fewer
repeats than cells, so V is shrunk by a towards its diagonal: what no repeat showed is not impossible. F is minimised by
`scipy.optimize.least_squares` over the base and the effect's parameters jointly, and hypotheses are compared by BIC.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
import scipy.sparse

from benchmarks.whole_record import WholeRecordModel
from discrepancy.model import NONE, Hypothesis, Jobs
from discrepancy.problem import Problem

BINS = 128
"""Cells of a cam turn; about 8 ms each at the reference speed."""

_REPEATS, _OF_COVARIANCE = 8, 48
"""Repeats of a simulation, and those that the covariance comes from."""

_SHRINKAGE = 0.3
"""a."""

_NUDGE, _SMOOTH_NUDGE = 0.1, 0.01
"""Step of the differences in scaled coordinates, and without play: with it the averages are rough on smaller ones."""

_FITTED = 4
"""Effects that are fitted: those of which a start promises most."""

_EVALUATIONS = 20
_CHUNK = 16


@dataclass(frozen=True, eq=False)
class Fitted:
    """A hypothesis after its fit: scaled global parameters, and F with the price of its parameters (BIC)."""

    hypothesis: Hypothesis
    z: np.ndarray
    score: float


class CamAverages:
    """The likelihood of a machine's mean cam turn, or of that of each station, from records in a `WholeRecordModel`."""

    def __init__(self, model: WholeRecordModel, rng: np.random.Generator, *, by_station: bool = False) -> None:
        self.model = model
        self.averaging = [_averaging(model, k, by_station) for k in range(len(model.counts))]
        z = np.zeros(len(model.parameters))
        # without play no start is drawn: every repeat is the same
        grid = model.state_grid(NONE, z)
        self.nudge = _NUDGE if len(grid) else _SMOOTH_NUDGE
        repeats = _OF_COVARIANCE if len(grid) else 1
        self.starts = np.zeros((repeats, len(model.counts), model.local_count(NONE)))
        if len(grid):
            drawn = rng.uniform(grid.min(axis=0), grid.max(axis=0), (*self.starts.shape[:2], grid.shape[1]))
            self.starts[:, :, : grid.shape[1]] = drawn
        scatter = self._averages(NONE, z[None], self.starts)[0]
        scatter = scatter - scatter.mean(axis=0)
        self.starts = self.starts[:_REPEATS]
        of_play = scatter.T @ scatter / max(1, repeats - 1)
        of_noise = np.concatenate([1.0 / np.diff(average.indptr) for average in self.averaging])
        of_play = (1.0 - _SHRINKAGE) * of_play + _SHRINKAGE * np.diag(np.diag(of_play))
        covariance = np.diag(of_noise) + (1.0 + 1.0 / len(self.starts)) * of_play
        self.whitener = np.linalg.inv(np.linalg.cholesky(covariance))

    def _averages(self, hypothesis: Hypothesis, z: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """s of each repeat (p, r, cells) at places (p, g), from starts (r, records, l)."""
        r, w = starts.shape[:2]
        size = self.model.local_count(hypothesis)
        states = np.zeros((len(z) * r, w, size))
        states[:, :, : starts.shape[2]] = np.tile(starts, (len(z), 1, 1))
        every = np.tile(np.arange(w), len(z) * r)
        jobs = Jobs(z, np.repeat(np.arange(len(z)), r * w), every, states.reshape(-1, size))
        residuals = self.model.residuals(hypothesis, jobs).reshape(len(z) * r, w, -1)
        means = [(average @ residuals[:, k].T).T for k, average in enumerate(self.averaging)]
        return np.concatenate(means, axis=1).reshape(len(z), r, -1)

    def terms(self, hypothesis: Hypothesis, z: np.ndarray) -> np.ndarray:
        """What F is the sum of squares of (p, n) at places (p, g): whitened averages, then the priors."""
        known = np.array([p.known for p in self.model.parameters + hypothesis.parameters])
        rows = []
        for first in range(0, len(z), _CHUNK):
            part = z[first : first + _CHUNK]
            mean = self._averages(hypothesis, part, self.starts).mean(axis=1)
            rows.append(np.concatenate([mean @ self.whitener.T, part[:, known]], axis=1))
        return np.concatenate(rows)

    def slope(self, hypothesis: Hypothesis, z: np.ndarray) -> np.ndarray:
        """Differences of the terms by the global parameters (n, g), inward at an upper bound."""
        nudges = np.where(z + self.nudge > Problem(self.model, hypothesis).high, -1.0, 1.0) * self.nudge
        terms = self.terms(hypothesis, np.concatenate([z[None], z + np.diag(nudges)]))
        return ((terms[1:] - terms[0]) / nudges[:, None]).T

    def fit(self, hypothesis: Hypothesis, z: np.ndarray) -> Fitted:
        """F minimised from a place."""
        problem = Problem(self.model, hypothesis)
        result = scipy.optimize.least_squares(
            lambda x: self.terms(hypothesis, x[None])[0],
            np.clip(z, problem.low, problem.high),
            jac=lambda x: self.slope(hypothesis, x),  # pyright: ignore[reportArgumentType]
            bounds=(problem.low, problem.high),
            max_nfev=_EVALUATIONS,
            ftol=1e-4,
        )
        price = len(hypothesis.parameters) * math.log(len(self.whitener))
        choices = len(self.model.hypotheses().get(hypothesis.name, (NONE,)))
        return Fitted(hypothesis, result.x, 2.0 * float(result.cost) + price + 2.0 * math.log(choices))

    def starts_of(self, hypotheses: Sequence[Hypothesis], base: np.ndarray, slope: np.ndarray) -> tuple[float, Fitted]:
        """What the best start of an effect promises once the base model has adapted along its slope, and the start."""
        found = []
        basis = np.linalg.qr(slope)[0]
        for h in hypotheses:
            z = np.array([np.concatenate([base, h.coordinates(values)]) for values in h.starts])
            terms = self.terms(h, z)
            left = (terms**2).sum(axis=1) - ((terms @ basis) ** 2).sum(axis=1)
            found.append((float(left.min()), Fitted(h, z[int(left.argmin())], math.nan)))
        return min(found, key=lambda pair: pair[0])


def _averaging(model: WholeRecordModel, window: int, by_station: bool) -> scipy.sparse.csr_matrix:
    """What takes a record's samples (n,) to its averages (cells,). The first turn, in which the start state still
    shows, is left out."""
    record = model.windows.record[window]
    point, rate = model.experiments[record].operating_point, model.experiments[record].signal.sample_rate
    speed = model.machine.reduction * point.motor_speed / rate
    sample = np.arange(math.ceil(2.0 * math.pi / speed), model.counts[window])
    turns = (point.start_angle + speed * (model.windows.first[window] + sample)) / (2.0 * math.pi)
    repeats_after = model.machine.stations if by_station else 1
    cell = (np.mod(turns, repeats_after) * BINS).astype(int)
    # a short record may not reach every station
    _, row, samples = np.unique(cell, return_inverse=True, return_counts=True)
    return scipy.sparse.csr_matrix((1.0 / samples[row], (row, sample)), shape=(len(samples), int(model.counts.max())))


def name_by_averages(model: WholeRecordModel, rng: np.random.Generator, *, by_station: bool) -> list[Fitted]:
    """All hypotheses that were fitted, best first; "none" among them."""
    averages = CamAverages(model, rng, by_station=by_station)
    none = averages.fit(NONE, np.zeros(len(model.parameters)))
    slope = averages.slope(NONE, none.z)
    starts = [averages.starts_of(h, none.z, slope) for h in model.hypotheses().values()]
    starts.sort(key=lambda pair: pair[0])
    effects = [averages.fit(start.hypothesis, start.z) for _, start in starts[:_FITTED]]
    best = min(effects, key=lambda fitted: fitted.score)
    again = averages.fit(NONE, best.z[: len(none.z)])
    return sorted([*effects, min(none, again, key=lambda fitted: fitted.score)], key=lambda fitted: fitted.score)
