"""Joint fit of global parameters and of every window's start state: damped Gauss–Newton on an arrow-shaped system."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import numpy as np

from discrepancy.place import Point
from discrepancy.problem import Problem

_log = logging.getLogger(__name__)

_LARGEST_STEP = 1.0
"""Largest change of a global parameter in one step, in its scale or in `_REACH` times its distance from nominal."""

_REACH = 0.5

_GAIN = 1.0
"""A smaller fall of twice the negative log-likelihood is none."""

_LAST = 10
"""Steps that may follow the search of all windows."""

_IDLE = 2
"""Steps without gain that end a fit."""

_STRETCHES = (1.0, 3.0)
"""How much further than one step is tried, in units of the step."""

_SLIGHT = 0.2
"""A fall of the cost that ends a thorough fit: a fifth of what makes one standard deviation of one parameter."""

_UNDAMPED = 1e-6
"""Damping with which directions are crossed that the records tell little of, such as all torques' common scale: damping
is measured by each parameter's own curvature, next to which the curvature along such a direction is nothing."""

_CROSSINGS = 12
"""Steps that cross such directions, at most."""

_ROUNDS = 4
"""Most times that a place is crossed and searched to come to rest."""

_STRANGE = 2.0
"""Standard deviations of what was known beforehand beyond which a parameter is doubted."""

_NEAR = 2.0
"""Level from which on a place is too far from explaining the records to be brought to rest: no number of it counts."""

_SEARCH_EVERY = 3
"""Steps until the windows that stand out are first searched anew."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A converged, or stopped, fit.

    Attributes
    ----------
    place : Point
    converged : bool
    """

    place: Point
    converged: bool


def fit(problem: Problem, place: Point, *, steps: int, thorough: bool = False) -> Fit:
    """Minimise F from a place, in at most so many steps; steps that win less than `_GAIN` end it.

    Every few steps the windows that stand out are searched anew over their whole grid, ever more rarely where that
    gains nothing. Where it is `thorough`, all windows are searched before the end: a start state that is a little wrong
    does not stand out, and bends play and damping. Then what the records tell little of is brought to rest as well.
    """
    unsearched, searched, damping = thorough, None, 1e-2
    wait, due, idle, exact = _SEARCH_EVERY, _SEARCH_EVERY, 0, problem
    number, limit = 0, steps
    while number < limit and idle < _IDLE:
        number += 1
        problem = exact.eased(place)
        place = problem.adopted(place)
        best, damping = _step(problem, place, damping)
        gain = _GAIN * place.dispersion(exact.model)
        idle = idle + 1 if best is None or place.cost - best.cost < gain else 0
        place = best or place
        if number >= due or idle:
            found = problem.searched(place, stand_out(problem, place))
            if place.cost - found.cost > gain:
                idle, damping = 0, min(damping, 1e-1)
            else:
                wait *= 2
            place, due = found, number + wait
        if unsearched and (idle >= _IDLE or number == limit):
            found, unsearched, limit = problem.searched(place), False, number + _LAST
            idle = 0 if place.cost - found.cost > gain else idle
            place, searched, damping = found, found, min(damping, 1e-2)
    place, settled = exact.adopted(place), idle >= _IDLE
    if thorough and place.level(exact.model) < _NEAR:
        place = _doubted(exact, rested(exact, place, searched))
    _log.debug("%s at %.2f times the noise", place.hypothesis.name, place.level(exact.model))
    return Fit(place, settled)


def rested(exact: Problem, place: Point, searched: Point | None = None) -> Point:
    """The place at rest in all directions: crossed, its windows searched and its kin tried, until all win next to
    nothing. Where they were `searched` at a place already, they are so again only where the cost has fallen since."""
    problem = exact.eased(place)
    place, at_search = problem.adopted(place), problem.adopted(searched).cost if searched else math.inf
    for _ in range(_ROUNDS):
        before, place = place.cost, _crossed(problem, place)
        gain = _GAIN * place.dispersion(exact.model)
        if at_search - place.cost > gain:
            place = problem.searched(place)
            at_search = place.cost
        place = _among_kin(problem, place)
        if before - place.cost < gain:
            break
    return exact.adopted(place)


def crossed(exact: Problem, place: Point) -> Point:
    """The place at the bottom of the valleys that the records tell little of."""
    problem = exact.eased(place)
    return exact.adopted(_crossed(problem, problem.adopted(place)))


def _among_kin(problem: Problem, place: Point) -> Point:
    """The place, or a better one beyond what a symmetry of the model's equations leads to."""
    z = problem.model.kin(place.hypothesis, place.z)
    z = np.clip(np.where(problem.movable, z, place.z), problem.low, problem.high)
    # where what the symmetry moves is held, there is nowhere else to go
    z = z[(z != place.z).any(axis=1)]
    if not len(z):
        return place
    found = [problem.settled(p) for p in problem.points(z, np.repeat(place.states[None], len(z), axis=0))]
    best = _crossed(problem, min(found, key=lambda p: p.cost))
    return best if best.cost < place.cost else place


def _doubted(exact: Problem, place: Point) -> Point:
    """The place, or a better one found with its strange parameters at nominal: what is far from what was believed, and
    explains the records nevertheless, may be a local minimum."""
    strange = (exact.precision > 0.0) & (np.abs(place.z) > _STRANGE) & exact.of_machine & exact.movable
    if not strange.any():
        return place
    again = exact.searched(exact.point(np.where(strange, 0.0, place.z), place.states))
    other = rested(exact, fit(exact, again, steps=_CROSSINGS).place)
    return other if other.cost < place.cost else place


def _crossed(problem: Problem, place: Point) -> Point:
    """The place after steps that are hardly damped, until one wins next to nothing."""
    damping = _UNDAMPED
    for _ in range(_CROSSINGS):
        before = place
        best, damping = _step(problem, place, damping)
        place = best or place
        if before.cost - place.cost < _SLIGHT * before.dispersion(problem.model):
            break
    return place


def stand_out(problem: Problem, place: Point) -> np.ndarray:
    """Windows whose misfit stands out: above one and a half times the median."""
    level = place.squares / problem.model.counts
    return np.flatnonzero(level > max(1.5 * float(np.median(level)), 1.2 * float(level.min())))


def _step(problem: Problem, place: Point, damping: float) -> tuple[Point | None, float]:
    """The best place one damped step away, or None; and the damping to go on with."""
    system = problem.equations(place)
    free = problem.free(place, system)
    for _ in range(4):
        ladder = damping * np.array([0.1, 1.0, 10.0])
        z, states = [], []
        for value in ladder:
            step, local = system.step(value, free)
            largest = (np.abs(step) / np.maximum(1.0, _REACH * np.abs(place.z))).max(initial=0.0)
            share = min(1.0, _LARGEST_STEP / largest) if largest > 0.0 else 1.0
            z.append(np.clip(place.z + share * step, problem.low, problem.high))
            states.append(place.states + share * local)
        # each window may keep its old start state where the linear one does it harm
        places = problem.points(np.repeat(z, 2, axis=0), np.array([s for new in states for s in (new, place.states)]))
        merged = [problem.merged(a, b) for a, b in zip(places[::2], places[1::2], strict=True)]
        best = min(range(len(merged)), key=lambda k: merged[k].cost)
        merged[best] = problem.settled(merged[best], rounds=1)
        if merged[best].cost < place.cost:
            return _stretched(problem, place, merged[best]), float(np.clip(ladder[best], 1e-7, 1e3))
        damping *= 100.0
    return None, min(damping, 1e3)


def _stretched(problem: Problem, place: Point, best: Point) -> Point:
    """The step from `place` to `best`, or a longer one the same way where that is better: valleys are narrow and bent,
    so that single steps in them are short."""
    z = np.array([np.clip(best.z + k * (best.z - place.z), problem.low, problem.high) for k in _STRETCHES])
    states = np.array([best.states + k * (best.states - place.states) for k in _STRETCHES])
    return min([best, *problem.points(z, states)], key=lambda p: p.cost)
