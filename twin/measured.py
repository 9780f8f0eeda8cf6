"""How large physics measures a fault that networks think possible and its own search does not find.

A search names what closes a good share of the gap. Whether a small fault beside a large one is there is another
question: it is fitted beside those found from the size that the networks give, and has a size with its interval. With
all sizes t from nothing to the largest being as likely before, the Bayes factor of the fault is

    B = exp(½ Δ) √(2π) σ,    √(2π) σ ≤ 1

(Laplace), with σ the standard deviation of t and Δ by how much twice the negative log-likelihood falls under the
dispersion of the better fit, less what the other unknowns that come with the fault gain by chance: one each. Where the
interval of t holds nothing, no more than (t/σ)² counts: the rest is another minimum's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy import Explanation
from discrepancy.dispersion import dispersion_of
from discrepancy.estimates import estimates_of
from discrepancy.fits import Fits
from discrepancy.model import Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.machine import Machine
from twin.calibrate import SD_OF_95
from twin.diagnosis import FaultSeen
from twin.faults import Fault

_BEGUN = 0.03
"""Least share of the largest size from which a fault begins: at nothing its other numbers, as a phase, do not show."""

FINEST = 1e-3
"""Least standard deviation of a size: a bound may hold it."""


@dataclass(frozen=True)
class Measured:
    """A fault as physics measures it beside what it found.

    Attributes
    ----------
    fault : str
    size, low, high : float
        As share of the fault's largest size, with its 95 % interval.
    fall : float
        Δ.
    nothing : float
        The size of none, at which a fit may end.
    """

    fault: str
    size: float
    low: float
    high: float
    fall: float
    nothing: float = 0.0

    @property
    def evidence(self) -> float:
        """ln B."""
        spread = max((self.high - self.low) / SD_OF_95, FINEST)
        fall = self.fall
        if self.low <= self.nothing <= self.high:
            fall = min(fall, ((self.size - self.nothing) / spread) ** 2)
        return 0.5 * fall + min(math.log(math.sqrt(2.0 * math.pi) * spread), 0.0)


def measured(
    answer: Explanation, suspected: Sequence[FaultSeen], faults: Mapping[str, Fault], machine: Machine
) -> tuple[Measured, ...]:  # fmt: skip
    """Faults measured from the sizes at which the networks see them; none of an effect that the machine has already,
    whose growth was measured. `faults` is the table by name."""
    if not suspected:
        return ()
    fits = Fits(answer.model, answer.selection.model)
    fits.kept(answer.selection.best.place, answer.selection.best.converged)
    looks = (_measured(answer, fits, faults[one.name], one, machine) for one in suspected)
    return tuple(look for look in looks if look is not None)


def suggested(
    fits: Fits, named: Sequence[FaultSeen], faults: Mapping[str, Fault], machine: Machine
) -> tuple[Point, ...]:  # fmt: skip
    """Where the set of all faults that the networks name may be fitted; nothing where they name none, or one of an
    effect that the machine has already."""
    place = fits.begun.place
    for seen in named:
        begun = _beside(fits, place, faults[seen.name], seen, machine)
        if begun is None:
            return ()
        place = begun
    return (place,) if named else ()


def _beside(fits: Fits, place: Point, fault: Fault, seen: FaultSeen, machine: Machine) -> Point | None:
    """The best place of a fault of the size that the networks give beside others; None where it is not looked for."""
    library, at = fits.model.hypotheses().get(fault.effect, ()), seen.station
    hypotheses = [h for h in library if at is None or h.fixed.get("station", at) == at]
    value = fault.before + fault.value(math.copysign(max(abs(seen.share), _BEGUN), seen.share), machine)
    begun = (_begun(fits, place, h, fault, value) for h in hypotheses)
    return min(begun, key=lambda p: p.cost, default=None)


def _measured(answer: Explanation, fits: Fits, fault: Fault, seen: FaultSeen, machine: Machine) -> Measured | None:
    best = answer.selection.best
    if fault.effect in best.place.hypothesis.names:
        fitted = fits.fit(best.place)
    else:
        begun = _beside(fits, best.place, fault, seen, machine)
        if begun is None:
            return None
        fitted = fits.fit(begun)
    own = fitted.place.hypothesis.names.index(fault.effect)
    whole, without = _alike(answer.model, *(fits.on_all(one).place for one in (fitted, fits.without(fitted, own))))
    effect = estimates_of(answer.model, whole).effect(fault.effect, ())
    size = next(one for one in effect.parameters if one.name == fault.parameter)
    value, *ends, nothing = (
        fault.share(number - fault.before, machine)
        for number in (size.value, size.low, size.high, max(size.nominal, fault.before))
    )  # fmt: skip
    return Measured(fault.name, value, min(ends), max(ends), _fall(answer, whole, without), nothing)


def _alike(model: Model, *places: Point) -> list[Point]:
    """Places of two sets, each with the better start state of either in each window."""
    return [
        Problem(model, one.hypothesis).pooled(one, [other])
        for one, other in zip(places, reversed(places), strict=True)
    ]  # fmt: skip


def _fall(answer: Explanation, whole: Point, without: Point) -> float:
    """Δ between the set with a fault and the set without it."""
    model, places = answer.model, (whole, without)
    dispersion = min(dispersion_of(model, place) for place in places)
    after, before = (Problem(model, place.hypothesis).deviance(place, dispersion) for place in places)
    more, fewer = (
        len(place.hypothesis.parameters) + len(model.counts) * model.freed(place.hypothesis) for place in places
    )
    return before - after - (more - fewer - 1)


def _begun(fits: Fits, place: Point, hypothesis: Hypothesis, fault: Fault, value: float) -> Point:
    """The best place of a fault of this size beside what was found, from any start of its other numbers."""
    both = together(place.hypothesis, hypothesis)
    problem, states = Problem(fits.model, both), fits.model.states_for(both, place.states)
    of_size = [p.name == f"{fault.effect}.{fault.parameter}" for p in hypothesis.parameters]
    starts = {tuple(np.where(of_size, value, start).tolist()) for start in hypothesis.starts}
    z = np.array([np.concatenate([place.z, hypothesis.coordinates(start)]) for start in sorted(starts)])
    begun = problem.points(z, np.repeat(states[None], len(z), axis=0))
    return problem.searched(min(begun, key=lambda point: point.cost))
