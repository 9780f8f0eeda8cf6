"""What places fitted to some records predict of others: their physics stays, what belongs to single records moves; and
how two of them compare there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.fit import fit
from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.errors import refuse

_STEPS, _MORE = 12, 3
"""Steps of a fit on records held out, and those after states of other places were tried."""

_ELSEWHERE = 0.1
"""Standard deviations by which a number of a record must differ for a fit to begin there, too."""

_QUARTILE = 0.25
"""Of the differences between repeats: what a missed start state or station adds to single ones must not count."""

_LEAST_PAIRS = 2
"""Pairs of windows that see the same below which nothing is said of what repeats: of one alone, a missed start state
would be all."""

_LEAST_WINDOWS = 4
"""Windows up to which none is left out."""


def held_places(fitted: Sequence[Point], held_out: Model, found: Sequence[Point] = ()) -> list[Point]:
    """The physics of places on the records held out. What one of them, or of those `found` there before, has of the
    records and of the windows' start states is tried by all: a state that was missed must not decide."""
    places: list[Point] = []
    for place in fitted:
        places.append(held_place(place, held_out, [*found, *places]))
    pooled = []
    for place in places:
        problem, others = Problem(held_out, place.hypothesis, frozen=True), [*places, *found]
        begun = [problem.pooled(place, others), *_as_of(others, problem, place.z)]
        pooled.append(fit(problem, min(begun, key=lambda p: p.cost), steps=_MORE).place)
    return pooled


def _as_of(others: Sequence[Point], problem: Problem, z: np.ndarray) -> list[Point]:
    """Places of a problem with the physics of z (g,) and what belongs to records as other places on them have it, where
    that is elsewhere, all windows searched: of what turns with the motor a slightly other speed makes another phase, so
    that a whole effect at a wrong one leads nowhere."""
    of_records = [k for k, p in enumerate(problem.model.parameters) if p.of_record]
    made, tried = list[Point](), [z[of_records]]
    for other in others:
        own = other.z[of_records]
        if all(np.abs(own - one).max(initial=0.0) > _ELSEWHERE for one in tried):
            tried.append(own)
            there = z.copy()
            there[of_records] = own
            states = problem.model.states_for(problem.hypothesis, other.states)
            made.append(problem.searched(problem.point(there, states)))
    return made


def carried(place: Point, problem: Problem) -> np.ndarray:
    """Global parameters (g,) of a problem on other records: the physics of a place, what belongs to records at 0."""
    physics = np.array([not p.of_record for p in problem.parameters])
    # what belongs to records stands together, behind the machine's own; there may be more of them here or there
    of_records = np.flatnonzero(~physics)
    records = len(place.z) - int(physics.sum())
    apart = len(of_records) and of_records[-1] - of_records[0] >= len(of_records)
    if apart or (records and not len(of_records)):
        rule = "those that belong to records side by side, of the records held out as well"
        names = ", ".join(p.name for p in problem.parameters)
        raise refuse("Model", "parameters", rule, names, "put them behind the machine's own")
    first = int(of_records[0]) if len(of_records) else len(physics)
    z = np.zeros(len(physics))
    z[physics] = np.delete(place.z, slice(first, first + records))
    return z


def adapted(held: Point, held_out: Model) -> Point:
    """A place on the records held out with the machine's own parameters fitted to them; those of its effects stay.
    Other records know some of them only so well, and what is missing has bent others."""
    own = len(held_out.parameters)
    effects = [own + k for k, p in enumerate(held.hypothesis.parameters) if not p.of_record]
    problem = Problem(held_out, held.hypothesis, held=effects)
    return fit(problem, problem.adopted(held), steps=_STEPS).place


def held_place(place: Point, held_out: Model, found: Sequence[Point] = ()) -> Point:
    """The physics of a place on the records held out; only start states and what belongs to single records move. They
    begin where one of those `found` there has them, or as they are stated."""
    problem = Problem(held_out, place.hypothesis, frozen=True)
    z = carried(place, problem)
    states = np.zeros((len(held_out.counts), held_out.local_count(place.hypothesis)))
    begun = [problem.searched(problem.point(z, states)), *_as_of(found, problem, z)]
    return fit(problem, min(begun, key=lambda p: p.cost), steps=_STEPS, thorough=True).place


def counted(place: Point, other: Point, model: Model, share: float) -> np.ndarray:
    """Windows (w,) by which two places are compared. Of those that have start states the one that speaks most against
    the first place's closing all but a share does not count: a start state that was missed spoils one window, and an
    effect may act in one alone."""
    against = (place.squares - share * other.squares) / model.counts
    may_miss = place.states.shape[1] > 0 and len(against) > _LEAST_WINDOWS
    return np.arange(len(against)) != int(against.argmax()) if may_miss else np.full(len(against), True)


def steadily(place: Point, other: Point, model: Model, share: float, criteria: Criteria) -> float:
    """Share of what an effect changes that it makes better, the least over the records, given places with and without
    it. Only windows whose mean square it changes by `at_noise` or more count, and, up to `much`, by `slight` of what it
    changes most: a roller of the turret acts in one of many, and elsewhere little differs. A record without such
    windows does not count."""
    gained = (other.squares - place.squares) / model.counts
    kept = counted(place, other, model, share)
    largest = float(np.abs(gained[kept]).max(initial=0.0))
    least = max(criteria.at_noise, min(criteria.slight * largest, criteria.much))
    changed = (np.abs(gained) >= least) & kept
    records = (gained[changed & (model.groups == g)] for g in np.unique(model.groups[changed]))
    return min((float(one.clip(0.0).sum() / np.abs(one).sum()) for one in records), default=0.0)


def closed(before: float, after: float) -> float:
    """Share that is closed of a mean square above what does not repeat; 0 where nothing is."""
    return max(0.0, 1.0 - max(after, 0.0) / before) if before > 0.0 else 0.0


def chance(model: Model, floor: float, dispersion: float) -> float:
    """Standard deviation of the mean square of what does not repeat, E_r √(2 τ/N) with D = E_r τ, as N samples tell as
    much as N/τ of white noise: nobody knows better what is left above it."""
    return math.sqrt(2.0 * dispersion * floor / float(model.counts.sum()))


def unrepeated(places: Sequence[tuple[Model, Point]]) -> float:
    """Mean square of what differs between windows that see the same, in units of the noise's: half the lower quartile
    of the differences' mean squares; 0 where there are too few such windows."""
    found: list[float] = []
    for model, place in places:
        residual = Problem(model, place.hypothesis).left(place)
        for a, b in model.repeats():
            n = int(min(model.counts[a], model.counts[b]))
            found.append(0.5 * float(((residual[a, :n] - residual[b, :n]) ** 2).mean()))
    return float(np.quantile(found, _QUARTILE)) if len(found) >= _LEAST_PAIRS else 0.0


def excess(
    place: Point, other: Point, model: Model, floor: float, share: float, dispersion: float
) -> tuple[float, float]:
    """Mean squares above the floor that two places leave, of the windows `counted`, with Σ z² of what was stated of the
    records, in units of the dispersion D: a place that has a record begin elsewhere than was measured, or run faster,
    predicts it no better for that; nor for what it sets free in every window."""
    kept = counted(place, other, model, share)

    def left(p: Point) -> float:
        samples = max(float(model.told(p.hypothesis, p.z)[kept].sum()), 1.0)
        strain = float((p.pulls(model) ** 2).sum()) + kept.sum() * model.freed(p.hypothesis)
        return max((float(p.squares[kept].sum()) + dispersion * strain) / samples - floor, 0.0)

    return left(place), left(other)
