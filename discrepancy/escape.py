"""Out of a local minimum: one parameter of an effect is moved at a time, and bad windows look for their start anew.

A fit of an effect with the wrong phase or size settles windows into other orders of contacts, from which no small step
leads back. Moved by a share of the way to its neighbours in the library's list, with the worst windows searched, a
better place shows at once.
"""

from __future__ import annotations

import numpy as np

from discrepancy.fit import fit
from discrepancy.problem import Point, Problem
from discrepancy.scan import neighbours

_SHARES = tuple(k / 6 for k in range(1, 7))
"""Shares of the way to the next values of the library's list."""

_STEPS = 6
_WORST = 0.25
"""Share of the windows, the worst ones, in which a move is looked at."""


def escaped(problem: Problem, place: Point, *, rounds: int, enough: float) -> Point:
    """The place, or a better one reached by moves of the effect's parameters; no further once its level is `enough`."""
    place = problem.adopted(place)
    for _ in range(rounds):
        if place.level(problem.model) < enough:
            break
        level = place.squares / problem.model.counts
        worst = np.flatnonzero(level >= np.quantile(level, 1.0 - _WORST))
        moved = min((problem.searched(p, worst) for p in _moves(problem, place)), key=lambda p: p.cost, default=place)
        best = fit(problem, problem.searched(moved), steps=_STEPS).place
        if best.cost >= place.cost - 1.0:
            break
        place = best
    return place


def _moves(problem: Problem, place: Point) -> list[Point]:
    """Places with one parameter of the effect moved."""
    hypothesis = place.hypothesis
    first = len(place.z) - len(hypothesis.parameters)
    found = []
    for k, parameter in enumerate(hypothesis.parameters):
        ladder = sorted({start[k] for start in hypothesis.starts})
        value = parameter.value(place.z[first + k])
        for share in _SHARES:
            for other in neighbours(value, ladder, share):
                z = place.z.copy()
                z[first + k] = min(max(parameter.coordinate(other), problem.low[first + k]), problem.high[first + k])
                found.append(problem.point(z, place.states))
    return found
