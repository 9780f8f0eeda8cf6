"""Sets of effects fitted to the end, and the one score by which they are compared.

    score = Σ_w ρ_w / D + Σ_known z² + Σ_effects (k ln N + 2 ln m)

with the Cauchy loss ρ of `problem`, k parameters and m discrete choices of an effect, N samples and the dispersion D of
the best set compared: the median mean square of its windows, at least 1, times the integrated autocorrelation time of
what it leaves (quasi-likelihood with an effective number of samples). The score is the Bayesian information criterion
under that dispersion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.problem import Problem


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
    """

    place: Point
    converged: bool
    price: float
    dispersion: float

    @property
    def effects(self) -> tuple[Hypothesis, ...]:
        return self.place.hypothesis.effects

    @property
    def name(self) -> str:
        return self.place.hypothesis.name


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
    """

    base: Fitted
    best: Fitted
    without: tuple[Fitted, ...]
    instead: tuple[tuple[Fitted, ...], ...]
    tried: tuple[Fitted, ...]
    complete: bool
    model: Model

    def other(self, fitted: Fitted, k: int) -> str:
        """Name of the effect that a set has instead of the k-th of the best one."""
        kept = {name for j, name in enumerate(self.best.place.hypothesis.names) if j != k}
        return next(name for name in reversed(fitted.place.hypothesis.names) if name not in kept)

    @property
    def dispersion(self) -> float:
        """D of the set selected."""
        return self.best.dispersion

    def gap(self, fitted: Fitted) -> float:
        """By how much a set scores worse than the best one."""
        own, best = scores((fitted, self.best), self.model)
        return own - best


def scores(sets: Sequence[Fitted], model: Model) -> list[float]:
    """Scores of sets under the dispersion of that one which leaves least, lower is better."""
    dispersion = min(sets, key=_cost).dispersion
    return [Problem(model, one.place.hypothesis).deviance(one.place, dispersion) + one.price for one in sets]


def _cost(fitted: Fitted) -> float:
    return fitted.place.cost
