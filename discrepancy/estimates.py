"""What a fit says in numbers: how large an effect is, and how the machine moved.

Intervals come from the normal equations with the windows' start states eliminated (`Arrow.reduced`):

    95 % interval = value at z ± t √max(S⁻¹, S⁻¹ M S⁻¹)_kk,     S = I/D + P,     M = P + W/(W - 1) Σ_w u_w u_wᵀ/D²

I is the information of the records, P that of what was known beforehand, D the dispersion: what a model gets wrong, and
noise that is correlated, tell as little as so many fewer samples. It is that of `dispersion` at least. But what a model
gets wrong in every window bends the machine until little of it is left to see; that the machine is bent is what shows.
With v the parameters' variances in units of those known beforehand, the records determine γ = Σ (1 - v) of them, and
where the model is right Σ z² is γ ± √(2γ) (MacKay, Neural Computation 4 (1992) 415). So D is the least one under which
Σ z² <= γ + √(2γ), and z is the best place under it: what predicts best is not what is true where a model is wrong
(Brynjarsdóttir and O'Hagan, Inverse Problems 30 (2014) 114007). The second one is the sandwich (White, Econometrica 48
(1980) 817, by windows as clusters): u_w is what window w alone pulls at the parameters, so
windows that disagree among each other widen what they disagree about. A prior of precision P pulls with a variance of
P, as the truth is one draw from it. t is Student's, W - 1 degrees of freedom for W windows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.arrow import arrow
from discrepancy.dispersion import dispersion_of
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

_RAISE = 1.5
"""Steps in which the dispersion is raised: intervals are as good as their widths are within a fifth."""

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
    shown : bool
        Whether the interval of its size under the least dispersion, that of the score, leaves out none.
    """

    name: str
    parameters: tuple[Estimate, ...]
    choices: tuple[tuple[str, float], ...]
    bound: str
    shown: bool


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
    shown : tuple of bool
        Whether its interval under the least dispersion leaves out its nominal value.
    information : ndarray (g, g)
        Of the records alone, in scaled coordinates, start states eliminated.
    dispersion : float
        D.
    """

    parameters: tuple[Parameter, ...]
    estimates: tuple[Estimate, ...]
    at_bound: tuple[bool, ...]
    shown: tuple[bool, ...]
    information: np.ndarray
    dispersion: float

    def effect(self, name: str, choices: Sequence[tuple[str, float]] = ()) -> FoundEffect:
        """One effect of the place, its parameters known by their prefix."""
        mine = [k for k, p in enumerate(self.parameters) if p.name.startswith(f"{name}.")]
        held = [self.estimates[k] for k in mine if self.at_bound[k]]
        bound = " and ".join(f"{e.name} {e.value:.4g} {e.unit}" for e in held)
        own = tuple(_renamed(self.estimates[k], name) for k in mine)
        return FoundEffect(name, own, tuple(choices), bound, self.shown[mine[0]])

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
    problem = Problem(model, place.hypothesis)
    least = dispersion_of(model, place)
    own, information, pull = _intervals(problem, place, least)
    dispersion = _believable(problem, place, information, pull, least)
    problem = Problem(model, place.hypothesis, dispersion=dispersion)
    believed = fit(problem, problem.adopted(place), steps=_STEPS).place
    bounds = zip(place.z, problem.low, problem.high, strict=True)
    at_bound = tuple(bool(min(z - low, high - z) < _AT_BOUND) for z, low, high in bounds)
    shown = tuple(not e.low <= e.nominal <= e.high for e in own)
    return Estimates(
        problem.parameters, _intervals(problem, believed, dispersion)[0], at_bound, shown, information, dispersion
    )


def _intervals(
    problem: Problem, place: Point, dispersion: float
) -> tuple[tuple[Estimate, ...], np.ndarray, np.ndarray]:
    """Estimates of all parameters under a dispersion, and of the records the information (g, g) and half the slope (g,)
    of their squares."""
    r, ahead, by_local = problem.linearised(place, _NUDGE)
    by_global = 0.5 * (ahead + problem.linearised(place, -_NUDGE)[1])
    # a window that is as bad as most has its whole weight, a missed one little
    weights = np.minimum(1.0, problem.eased(place).weights(place.squares) * _TYPICAL)
    system = arrow(r, by_global, by_local, weights)
    # a bound on what is known is no knowledge: the others are as uncertain as if it were not there
    within_bounds = problem.free(place, problem.informed(system, place.z))
    free = within_bounds | (problem.movable & problem.known)
    information, pull, inverse = system.reduced()
    prior = np.diag(problem.precision)
    pulls = np.einsum("gwn,wn,w->wg", by_global, r, weights) - np.einsum("wgi,wij,wj->wg", system.C, inverse, system.b)
    within = np.ix_(free, free)
    spread = np.zeros(len(place.z))
    spread[free] = np.sqrt(_variances(information[within] / dispersion, prior[within], pulls[:, free] / dispersion))
    # what a bound holds is known no better than before
    held = problem.known & problem.movable & ~within_bounds
    spread[held] = np.maximum(spread[held], 1.0 / np.sqrt(problem.precision[held]))
    reach = _reach(len(pulls)) * spread
    estimates = (_estimate(p, z, r) for p, z, r in zip(problem.parameters, place.z, reach, strict=True))
    return tuple(estimates), information, pull


def _believable(
    problem: Problem, place: Point, information: np.ndarray, pull: np.ndarray, least: float
) -> float:  # fmt: skip
    """The dispersion, from `least` to that of records that tell as much as one sample, under which the machine is as
    near to what was known of it as it should be, by linear theory."""
    free = np.flatnonzero(problem.movable & (np.diag(information) > 1e-12))
    machine = (problem.known & problem.of_machine)[free]
    information, pull = information[np.ix_(free, free)], pull[free]
    prior, z, dispersion = problem.precision[free], place.z[free], least
    most = place.dispersion(problem.model) * float(problem.model.counts.sum())
    while dispersion < most:
        inverse = np.linalg.pinv(information + dispersion * np.diag(prior))
        moved = (z - inverse @ (pull + dispersion * prior * z))[machine]
        told = float((1.0 - dispersion * np.diag(inverse) * prior)[machine].sum())
        if float(moved @ moved) <= told + math.sqrt(2.0 * max(told, 0.0)):
            break
        dispersion = min(dispersion * _RAISE, most)
    return dispersion


def _variances(information: np.ndarray, prior: np.ndarray, pulls: np.ndarray) -> np.ndarray:
    """Variances (g,) of scaled parameters, by the curvature or by how far the windows' pulls (w, g) differ."""
    inverse, windows = np.linalg.pinv(information + prior), len(pulls)
    between = prior + windows / max(1, windows - 1) * pulls.T @ pulls
    return np.maximum(np.maximum(np.diag(inverse), np.diag(inverse @ between @ inverse)), 0.0)


def _reach(windows: int) -> float:
    """Half width of an interval over its standard deviation: Student's t, as few windows tell how far they differ."""
    from scipy.stats import t

    return float(t.ppf(_SIDE, max(1, windows - 1)))


def _estimate(parameter: Parameter, z: float, reach: float) -> Estimate:
    low, value, high = (float(parameter.value(z + sign * reach)) for sign in (-1.0, 0.0, 1.0))
    moved = float(z) if parameter.known else None
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
