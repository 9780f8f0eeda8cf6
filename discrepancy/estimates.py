"""What a fit says in numbers: how large an effect is, and how the machine moved.

Under a dispersion D a parameter follows Student's law, W - 1 degrees of freedom for W windows, about the best place
under D, with the variance

    max(S⁻¹, S⁻¹ M S⁻¹)_kk,     S = I/D + P,     M = P + W/(W - 1) Σ_w u_w u_wᵀ/D²

from the normal equations with the windows' start states eliminated (`Arrow.reduced`). I is the information of the
records, P that of what was known beforehand: what a model gets wrong, and noise that is correlated, tell as little as
so many fewer samples. The second one is the sandwich (White, Econometrica 48 (1980) 817, by windows as clusters): u_w
is what window w alone pulls at the parameters, so windows that disagree among each other widen what they disagree
about. A prior of precision P pulls with a variance of P, as the truth is one draw from it.

D is not known. The interval is that of all D together, each with its probability (`dispersion`), about the place that
is best under the typical one: what predicts best is not what is true where a model is wrong (Brynjarsdóttir and
O'Hagan, Inverse Problems 30 (2014) 114007).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from discrepancy.arrow import arrow
from discrepancy.dispersion import Dispersions, dispersion_of, dispersions
from discrepancy.fit import fit
from discrepancy.model import Model, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem

_TYPICAL = 4.0 / 3.0
"""One over the weight of a window whose misfit is the median one."""

_NUDGE = 1e-4
"""Central differences in scaled coordinates. All torques times one factor leave the motion as it is, next to which the
error of one-sided or larger differences, squared, looks like information."""

_SIDE = 0.975
"""Probability below the upper end of an interval."""

_WEAK = 1.0
"""Information about a direction of the known parameters, in units of what was known beforehand, below which the records
do not determine it."""

_STEPS = 12
"""Steps of the last fit."""

_HALVINGS = 50
"""Of the range in which the end of an interval is looked for."""

_PART = 0.3
"""Share of a direction (of unit length) above which a parameter is named as part of it."""

_AT_BOUND = 1e-3
"""Distance from a bound, in scaled coordinates, at which a parameter counts as held by it."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval.

    Attributes
    ----------
    name, unit : str
    value, low, high : float
        [unit]
    nominal : float
        Value it would have if nothing had been measured [unit]: a machine's nominal value, an effect's null value.
    moved : float or None
        (value - nominal) in units of the uncertainty it was known with (of ln where it is logarithmic); None where
        nothing was known beforehand.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    nominal: float
    moved: float | None


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was found.

    Attributes
    ----------
    name : str
    parameters : tuple of Estimate
        Under their own names, without the effect's.
    choices : tuple of (str, float)
        Discrete choices that were made (a station, say).
    bound : str
        Parameters that are held at a bound of what is possible, with their values; "" where none is.
    """

    name: str
    parameters: tuple[Estimate, ...]
    choices: tuple[tuple[str, float], ...]
    bound: str

    @property
    def shown(self) -> bool:
        """Whether the interval of its size leaves out none."""
        size = self.parameters[0]
        return not size.low <= size.nominal <= size.high


@dataclass(frozen=True)
class Calibration:
    """The machine's own parameters after the fit that was accepted.

    Attributes
    ----------
    estimates : tuple of Estimate
    bounds_hit : tuple of str
        Parameters held by a bound of what is believable.
    undetermined : tuple of str
        Directions the records tell less about than was known beforehand, as "name +0.71, other name -0.70": shares of
        a direction of unit length in the parameters' own uncertainties.
    """

    estimates: tuple[Estimate, ...]
    bounds_hit: tuple[str, ...]
    undetermined: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Estimates:
    """All parameters of a fitted place, the model's and the hypothesis's, with what the records tell about them.

    Attributes
    ----------
    parameters : tuple of Parameter
    estimates : tuple of Estimate
    at_bound : tuple of bool
        Whether the fit is at a bound of it.
    information : ndarray (g, g)
        Of the records alone, in scaled coordinates, start states eliminated.
    dispersion : float
        The typical D.
    """

    parameters: tuple[Parameter, ...]
    estimates: tuple[Estimate, ...]
    at_bound: tuple[bool, ...]
    information: np.ndarray
    dispersion: float

    def effect(self, name: str, choices: Sequence[tuple[str, float]] = ()) -> FoundEffect:
        """One effect of the place, its parameters known by their prefix."""
        mine = [k for k, p in enumerate(self.parameters) if p.name.startswith(f"{name}.")]
        held = [self.estimates[k] for k in mine if self.at_bound[k]]
        bound = " and ".join(f"{e.name} {e.value:.4g} {e.unit}" for e in held)
        own = tuple(_renamed(self.estimates[k], name) for k in mine)
        return FoundEffect(name, own, tuple(choices), bound)

    def calibration(self, count: int) -> Calibration:
        """The first `count` parameters, those that belong to single records left out."""
        mine = [k for k in range(count) if not self.parameters[k].of_record]
        hit = tuple(self.parameters[k].name for k in mine if self.at_bound[k])
        known = [k for k in mine if self.parameters[k].known]
        names = [self.parameters[k].name for k in known]
        directions = _undetermined(self.information[np.ix_(known, known)], names)
        return Calibration(tuple(self.estimates[k] for k in mine), hit, directions)


def estimates_of(model: Model, place: Point) -> Estimates:
    """Estimates of all parameters of a set that was fitted."""
    problem, least = Problem(model, place.hypothesis), dispersion_of(model, place)
    most = place.dispersion(model) * float(model.counts.sum())
    told = _Told(problem, place)
    typical = told.dispersions(least, most).typical
    problem = Problem(model, place.hypothesis, dispersion=typical)
    believed = _Told(problem, fit(problem, problem.adopted(place), steps=_STEPS).place)
    found = believed.dispersions(least, most)
    # the place believed may lie at a bound where the fitted one, whose priors weigh less, does not
    near = [np.minimum(z - problem.low, problem.high - z) < _AT_BOUND for z in (place.z, believed.z)]
    at_bound = tuple((near[0] | near[1]).tolist())
    return Estimates(problem.parameters, believed.estimates(found), at_bound, told.information, found.typical)


class _Told:
    """What the records tell about all parameters near a place.

    Attributes
    ----------
    information : ndarray (g, g)
        Start states eliminated.
    pull : ndarray (g,)
        Half the slope of the squares.
    pulls : ndarray (w, g)
        The same of each window.
    free : ndarray (g,)
        Those that move. A bound on what is known is no knowledge: the others are as uncertain as if it were not there.
    held : ndarray (g,)
        Those of them that a bound holds.
    """

    def __init__(self, problem: Problem, place: Point) -> None:
        self.problem, self.z = problem, place.z
        r, ahead, by_local = problem.linearised(place, _NUDGE)
        by_global = 0.5 * (ahead + problem.linearised(place, -_NUDGE)[1])
        # a window that is as bad as most has its whole weight, a missed one little
        weights = np.minimum(1.0, problem.eased(place).weights(place.squares) * _TYPICAL)
        system = arrow(r, by_global, by_local, weights)
        within_bounds = problem.free(place, problem.informed(system, place.z))
        self.free = within_bounds | (problem.movable & problem.known)
        self.held = self.free & ~within_bounds
        self.information, self.pull, inverse = system.reduced()
        own = np.einsum("gwn,wn,w->wg", by_global, r, weights)
        self.pulls = own - np.einsum("wgi,wij,wj->wg", system.C, inverse, system.b)

    def dispersions(self, least: float, most: float) -> Dispersions:
        """What D may be."""
        free = np.flatnonzero(self.free & (np.diag(self.information) > 1e-12))
        return dispersions(
            self.information[np.ix_(free, free)], self.pull[free], self.problem.precision[free], self.z[free],
            least, most,
        )  # fmt: skip

    def estimates(self, found: Dispersions) -> tuple[Estimate, ...]:
        """All parameters with the intervals under all D together."""
        rows = [self._under(value) for value in found.values]
        centre, spread = (np.array(part) for part in zip(*rows, strict=True))
        low, high = (_end(found.shares, centre, spread, side, len(self.pulls)) for side in (1.0 - _SIDE, _SIDE))
        ends = np.minimum(low, self.z), self.z, np.maximum(high, self.z)
        return tuple(_estimate(p, *z) for p, z in zip(self.problem.parameters, zip(*ends, strict=True), strict=True))

    def _under(self, dispersion: float) -> tuple[np.ndarray, np.ndarray]:
        """The best place (g,) under D, by linear theory, and standard deviations (g,)."""
        free, z, precision = self.free, self.z, self.problem.precision
        within, prior = np.ix_(free, free), np.diag(precision[free])
        inverse, windows = np.linalg.pinv(self.information[within] / dispersion + prior), len(self.pulls)
        pulls = self.pulls[:, free] / dispersion
        between = prior + windows / max(1, windows - 1) * pulls.T @ pulls
        variances = np.maximum(np.diag(inverse), np.diag(inverse @ between @ inverse))
        centre, spread = z.copy(), np.zeros(len(z))
        centre[free] -= inverse @ (self.pull[free] / dispersion + precision[free] * z[free])
        spread[free] = np.sqrt(np.maximum(variances, 0.0))
        # what a bound holds is known no better than before
        centre[self.held] = z[self.held]
        spread[self.held] = np.maximum(spread[self.held], 1.0 / np.sqrt(precision[self.held]))
        return centre, spread


def _end(shares: np.ndarray, centre: np.ndarray, spread: np.ndarray, side: float, windows: int) -> np.ndarray:
    """Values (g,) below which a mixture of Student's laws, centres and spreads (d, g) with shares (d,), lies with the
    probability `side`; few windows tell little of how far they differ."""
    freedom = max(1, windows - 1)
    # the mixture's quantile lies among those of its parts
    each = centre + stdtrit(freedom, side) * spread
    low, high = each.min(axis=0), each.max(axis=0)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = shares @ stdtr(freedom, (middle - centre) / np.maximum(spread, 1e-300)) < side
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def _estimate(parameter: Parameter, low: float, z: float, high: float) -> Estimate:
    ends = (float(parameter.value(coordinate)) for coordinate in (low, z, high))
    moved = float(z) if parameter.known else None
    low, value, high = ends
    return Estimate(parameter.name, parameter.unit, value, low, high, parameter.nominal, moved)


def _renamed(estimate: Estimate, effect: str) -> Estimate:
    name = estimate.name.removeprefix(f"{effect}.")
    return Estimate(
        name, estimate.unit, estimate.value, estimate.low, estimate.high, estimate.nominal, estimate.moved
    )  # fmt: skip


def _undetermined(information: np.ndarray, names: Sequence[str]) -> tuple[str, ...]:
    """Directions of weak information, the weakest first."""
    values, vectors = np.linalg.eigh(information)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value < _WEAK:
            vector = vector * np.sign(vector[np.abs(vector).argmax()])
            parts = sorted(zip(vector.tolist(), names, strict=True), key=lambda part: -abs(part[0]))
            found.append(", ".join(f"{name} {share:+.2f}" for share, name in parts if abs(share) > _PART))
    return tuple(found)
