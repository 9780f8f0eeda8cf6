"""What a fit says in numbers: how large an effect is, and how the machine moved.

An interval (`intervals`) is that under all dispersions D together, each with its probability (`dispersion`), about the
place that is best under the typical one: what fits best is not what is true where a model is wrong (Brynjarsdóttir
and O'Hagan, Inverse Problems 30 (2014) 114007).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.dispersion import dispersion_of
from discrepancy.fit import fit
from discrepancy.intervals import Told
from discrepancy.model import Model, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.units import behind_number

_WEAK = 1.0
"""Information about a direction of the known parameters, in units of what was known beforehand, below which the records
do not determine it."""

_STEPS = 12
"""Steps of the last fit."""

_PART = 0.3
"""Share of a direction (of unit length) above which a parameter is named as part of it."""

_ASTRAY = 4.0
"""Standard deviations from what was stated of a parameter above which it, or a unit, is wrong."""


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
    null : float or None
        An effect's null value where the search's bounds leave it out, so that `nominal` is the nearest one within them.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    nominal: float
    moved: float | None
    null: float | None = None

    @property
    def none(self) -> float:
        """Value that stands for what was there before: nominal, or no effect [unit]."""
        return self.nominal if self.null is None else self.null


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
        Parameters that are held at a bound of what is possible, with that bound; "" where none is.
    untold : bool
        Whether nothing can be told of its size, whose interval is then all that is possible.
    """

    name: str
    parameters: tuple[Estimate, ...]
    choices: tuple[tuple[str, float], ...]
    bound: str
    untold: bool = False

    @property
    def shown(self) -> bool:
        """Whether the interval of its size leaves out none."""
        size = self.parameters[0]
        return not size.low <= size.nominal <= size.high

    @property
    def span(self) -> float:
        """Factor between the ends of the interval of its size, both taken from no effect; infinite where it holds
        none."""
        size = self.parameters[0]
        near, far = sorted(abs(end - size.none) for end in (size.low, size.high))
        return far / near if self.shown and near > 0.0 else math.inf


@dataclass(frozen=True)
class Calibration:
    """The machine's own parameters after the fit that was accepted.

    Attributes
    ----------
    estimates : tuple of Estimate
    bounds_hit : tuple of str
        Parameters that a bound of what is believable holds where the values are.
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
    untold : tuple of bool
        Whether nothing is told of it.
    information : ndarray (g, g)
        Of the records alone, in scaled coordinates, start states eliminated.
    believed : Point
        Where the values are: the fit whose priors weigh the typical dispersion.
    dispersion : float
        That dispersion.
    """

    parameters: tuple[Parameter, ...]
    estimates: tuple[Estimate, ...]
    at_bound: tuple[bool, ...]
    untold: tuple[bool, ...]
    information: np.ndarray
    believed: Point
    dispersion: float

    def effect(self, name: str, choices: Sequence[tuple[str, float]] = ()) -> FoundEffect:
        """One effect of the place, its parameters known by the name before theirs: `inertia.position` is another effect
        than `inertia`."""
        mine = [k for k, p in enumerate(self.parameters) if p.name.rpartition(".")[0] == name]
        bound = " and ".join(_at_bound(self.parameters[k], self.believed.z[k]) for k in mine if self.at_bound[k])
        own = (self.estimates[k] for k in mine)
        own = tuple(dataclasses.replace(e, name=e.name.removeprefix(f"{name}.")) for e in own)
        return FoundEffect(name, own, tuple(choices), bound, self.untold[mine[0]])

    def calibration(self, count: int) -> Calibration:
        """The first `count` parameters, those that belong to single records left out."""
        mine = [k for k in range(count) if not self.parameters[k].of_record]
        hit = tuple(self.parameters[k].name for k in mine if self.parameters[k].held(self.believed.z[k]))
        known = [k for k in mine if self.parameters[k].known]
        names = [self.parameters[k].name for k in known]
        directions = _undetermined(self._told_alone(known), names)
        return Calibration(tuple(self.estimates[k] for k in mine), hit, directions)

    def _told_alone(self, mine: list[int]) -> np.ndarray:
        """What the records tell under D of these parameters (m, m), all others as uncertain as they are: eliminated,
        with what was known of them."""
        told = self.information / self.dispersion
        others = [k for k in range(len(told)) if k not in mine]
        between = told[others][:, mine]
        prior = np.diag([float(self.parameters[k].known) for k in others])
        eliminated = np.linalg.pinv(told[others][:, others] + prior, hermitian=True)
        return told[mine][:, mine] - between.T @ eliminated @ between


def estimates_of(model: Model, place: Point) -> Estimates:
    """Estimates of all parameters of a set that was fitted."""
    problem, least = Problem(model, place.hypothesis), dispersion_of(model, place)
    most = place.dispersion(model) * float(model.counts.sum())
    told = Told(problem, place)
    typical = told.dispersions(least, most).typical
    problem = Problem(model, place.hypothesis, dispersion=typical)
    there = fit(problem, problem.adopted(place), steps=_STEPS).place
    believed = Told(problem, there)
    found = believed.dispersions(least, most)
    # the place believed may lie at a bound where the fitted one, whose priors weigh less, does not
    ends = zip(problem.parameters, place.z, there.z, strict=True)
    at_bound = tuple(p.held(fitted) or p.held(z) for p, fitted, z in ends)
    low, high = believed.ends(found)
    rows = zip(problem.parameters, low, believed.z, high, strict=True)
    estimates, untold = tuple(_estimate(*row) for row in rows), tuple(believed.untold.tolist())
    return Estimates(problem.parameters, estimates, at_bound, untold, told.information, there, typical)


def astray(calibration: Calibration) -> tuple[str, ...]:
    """A sentence for each parameter that has left what was stated of it far behind."""
    return tuple(
        f"{e.name} is {e.value:.4g}{behind_number(e.unit)}, {abs(e.moved):.0f} standard deviations from the "
        f"{e.nominal:.4g} stated: look for a wrong unit, factor or gain, or state how little is known of it."
        for e in calibration.estimates
        if e.moved is not None and abs(e.moved) > _ASTRAY
    )


def _estimate(parameter: Parameter, low: float, z: float, high: float) -> Estimate:
    ends = (float(parameter.value(coordinate)) for coordinate in (low, z, high))
    moved = float(z) if parameter.known else None
    low, value, high = ends
    return Estimate(parameter.name, parameter.unit, value, low, high, parameter.nominal, moved, parameter.null)


def _at_bound(parameter: Parameter, z: float) -> str:
    """A parameter that a bound holds, and the bound, the nearer one."""
    low, high = parameter.bounds
    bound = parameter.low if z - low < high - z else parameter.high
    return f"{parameter.name} {bound:.4g}{behind_number(parameter.unit)}"


def _undetermined(information: np.ndarray, names: Sequence[str]) -> tuple[str, ...]:
    """Directions of weak information, the weakest first."""
    values, vectors = np.linalg.eigh(information)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value < _WEAK:
            vector = vector * np.sign(vector[np.abs(vector).argmax()])
            parts = sorted(zip(vector.tolist(), names, strict=True), key=lambda part: -abs(part[0]))
            least = min(_PART, abs(parts[0][0]))
            found.append(", ".join(f"{name} {share:+.2f}" for share, name in parts if abs(share) >= least))
    return tuple(found)
