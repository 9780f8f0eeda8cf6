"""What a place fitted to some records predicts of others: its physics stays, what belongs to single records moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.fit import fit
from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.errors import refuse

_STEPS, _MORE = 12, 3
"""Steps of a fit on records held out, and those after states of other places were tried."""


def held_places(fitted: Sequence[Point], held_out: Model, found: Sequence[Point] = ()) -> list[Point]:
    """The physics of places on the records held out. What one of them, or of those `found` there before, has of the
    windows' start states is tried by all: a state that was missed must not decide."""
    places = [held_place(place, held_out) for place in fitted]
    pooled = []
    for place in places:
        problem = Problem(held_out, place.hypothesis, frozen=True)
        pooled.append(fit(problem, problem.pooled(place, [*places, *found]), steps=_MORE).place)
    return pooled


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


def held_place(place: Point, held_out: Model) -> Point:
    """The physics of a place on the records held out; only start states and what belongs to single records move."""
    problem = Problem(held_out, place.hypothesis, frozen=True)
    z = carried(place, problem)
    states = np.zeros((len(held_out.counts), held_out.local_count(place.hypothesis)))
    return fit(problem, problem.searched(problem.point(z, states)), steps=_STEPS, thorough=True).place
