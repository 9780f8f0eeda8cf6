"""Sets of effects fitted to the end, and the one score by which they are compared.

    score = Σ_w ρ_w / D + Σ_known z² + Σ_effects (k ln N + 2 ln m + v W)

with the Cauchy loss ρ of `problem`, k parameters and m discrete choices of an effect, N samples in W windows, v
unknowns that it sets free in each, and the dispersion D of the best set compared: the median mean square of its
windows, at least 1, times the integrated autocorrelation time of what it leaves (quasi-likelihood with an effective
number of samples). The score is the Bayesian information criterion under that dispersion, at the place z that is best
under it. A fit, which shall predict, weighs priors by the mean square φ alone. With I the information of the records
and P that of what was known beforehand, the place under D is better by

    bᵀ (I/D + P)⁻¹ b,     b = (1 - φ/D) P z

in linear theory, but by Σ_known z² at most, or half of Σ_w ρ_w/D where φ > D, or, where that place lies beyond a bound,
by what the way to the bound wins. Left out, every set pays for the bending that its fit was allowed, and those most
that lack an effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.dispersion import dispersion_of
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.problem import Problem

_LINEAR = 0.5
"""Share of Σ ρ/D that linear theory may promise to win under lighter priors: beyond it nothing is linear any more.
Records that begin 140 standard deviations from where they were measured, as behind a slow low-pass that is not in the
set, were promised more than all of it, so that the set with the low-pass, at the noise, was dropped."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A set of effects fitted to the end.

    Attributes
    ----------
    place : Point
    converged : bool
    price : float
        Of the parameters and choices of its effects.
    dispersion : float
        D of what it leaves.
    information : ndarray (g, g) or None
        I of the parameters that a bound does not hold, 0 of the others; None of a place that is no optimum.
    """

    place: Point
    converged: bool
    price: float
    dispersion: float
    information: np.ndarray | None = None

    @property
    def effects(self) -> tuple[Hypothesis, ...]:
        return self.place.hypothesis.effects

    @property
    def name(self) -> str:
        return self.place.hypothesis.name

    @property
    def held(self) -> bool:
        """Whether a bound holds a number of its effects that is not known from elsewhere."""
        own = self.place.hypothesis.parameters
        z = self.place.z[len(self.place.z) - len(own) :]
        return any(p.held(float(at)) for p, at in zip(own, z, strict=True) if not p.known)


@dataclass(frozen=True, eq=False)
class Selection:
    """The set selected and all that it was compared with.

    Attributes
    ----------
    base : Fitted
        The model as it came.
    best : Fitted
        The set selected; the base where none was.
    without : tuple of Fitted
        For each effect of the best set the set without it.
    instead : tuple of tuple of Fitted
        For each effect of the best set those with another one in its place, the best first.
    tried : tuple of Fitted
        What the last round would have added and did not.
    complete : bool
        False where the time ran out before the search ended.
    model : Model
        With the part of the records that was searched.
    margin : float
        By which a set that a bound holds stands back behind others.
    """

    base: Fitted
    best: Fitted
    without: tuple[Fitted, ...]
    instead: tuple[tuple[Fitted, ...], ...]
    tried: tuple[Fitted, ...]
    complete: bool
    model: Model
    margin: float

    def other(self, fitted: Fitted, k: int) -> str:
        """Name of the effect that a set has instead of the k-th of the best one."""
        return more_than(fitted, self.without[k])

    def share(self, fitted: Fitted, k: int) -> float:
        """How much more a set with another effect instead of the k-th one leaves, over what that one closes, in mean
        squares."""
        left, open_, best = (float(one.place.squares.sum()) for one in (fitted, self.without[k], self.best))
        return (left - best) / max(open_ - best, 1e-300)

    @property
    def dispersion(self) -> float:
        """D of the set selected."""
        return self.best.dispersion

    def gap(self, fitted: Fitted) -> float:
        """By how much a set scores worse than the best one, `standings` of both."""
        own, best = standings((fitted, self.best), self.model, self.margin)
        return own - best


def more_than(fitted: Fitted, base: Fitted) -> str:
    """Name of the effect that a set has more than a base."""
    names = base.place.hypothesis.names
    return next(name for name in fitted.place.hypothesis.names if name not in names)


def key_of(hypothesis: Hypothesis) -> str:
    """What tells sets apart: their effects with their choices, in any order."""
    return " + ".join(sorted(f"{one.name} {sorted(one.fixed.items())}" for one in hypothesis.effects))


def fitted_set(model: Model, place: Point, converged: bool, price: float, *, optimum: bool = True) -> Fitted:
    """A set at a place where a fit has ended; with `optimum`, one in which priors weigh φ."""
    dispersion = dispersion_of(model, place)
    if not optimum:
        return Fitted(place, converged, price, dispersion)
    problem = Problem(model, place.hypothesis).eased(place)
    system = problem.equations(place)
    within = np.where(problem.free(place, system), 1.0, 0.0)
    information = (system.reduced()[0] - np.diag(problem.precision)) * within * within[:, None]
    return Fitted(place, converged, price, dispersion, information)


def scores(sets: Sequence[Fitted], model: Model) -> list[float]:
    """Scores of sets under the dispersion of that one which leaves least, lower is better."""
    dispersion = min(sets, key=lambda one: one.place.cost).dispersion
    return [_score(one, model, dispersion) for one in sets]


def standings(sets: Sequence[Fitted], model: Model, margin: float) -> list[float]:
    """Scores of sets of which one shall stand for what is missing: what a bound holds stands in for another effect, and
    counts the margin less."""
    return [score + margin * one.held for score, one in zip(scores(sets, model), sets, strict=True)]


def _score(one: Fitted, model: Model, dispersion: float) -> float:
    problem, place = Problem(model, one.place.hypothesis), one.place
    deviance = problem.deviance(place, dispersion)
    if one.information is None:
        return deviance + one.price
    within = np.flatnonzero(np.diag(one.information) > 0.0)
    prior = problem.known[within].astype(float)
    b = (1.0 - place.dispersion(model) / dispersion) * prior * place.z[within]
    curvature = one.information[np.ix_(within, within)] / dispersion + np.diag(prior)
    step, z = -np.linalg.lstsq(curvature, b)[0], place.z[within]
    # a set that leaves much would go far beyond the bounds, where no fit may
    room = np.where(step > 0.0, problem.high[within] - z, z - problem.low[within])
    way = float(np.clip(room / np.maximum(np.abs(step), 1e-300), 0.0, 1.0).min(initial=1.0))
    won, pull = -(2.0 * way - way**2) * float(b @ step), float(place.z[problem.known] @ place.z[problem.known])
    # where priors weigh more than in the fit they alone can shrink, where they weigh less what is left alone
    most = pull if dispersion >= place.dispersion(model) else _LINEAR * (deviance - pull)
    return deviance - min(won, most) + one.price
