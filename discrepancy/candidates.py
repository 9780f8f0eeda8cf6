"""The hypotheses that compete, and how far each of them is fitted."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.escape import escaped
from discrepancy.fit import Fit, fit, rested
from discrepancy.model import NONE, Hypothesis, Model
from discrepancy.problem import Point, Problem
from discrepancy.scan import Scanner, Start
from discrepancy.starts import LEADING, chosen, overlooked, surveyed

_SHORT, _LONG = 6, 60
"""Steps of the fits that choose among candidates, and of those that are compared."""

_CAREFUL = 15
"""Steps of the first fit of the base model, which may lack what matters most, and of any fit before it is looked at."""

CAUTIONS = (100.0, 10.0, 1.0)
"""Weights of the priors, stage by stage. While the effect is missing the priors must hold the machine against a misfit
that repeats in every window; with the effect found they need no more than their own weight."""

_FINALISTS = 3

_ESCAPES = (2, 1)
"""How often a way out of a local minimum is looked for: from the leader, and from the second, while none explains the
records."""

FLOOR = 1.1
"""Level at which a candidate leaves hardly anything to explain."""

_FAR, _FALLING = 2.0, 0.9
"""A fit that is left above this level after `_CAREFUL` steps, and above this share of its cost before them, ends. A
leader below this level is fitted to the end before more starts are tried."""

_SAME = 0.05
"""Difference of an effect's scaled parameters, also relative, below which two starts have led to one place."""

_NEAR = 2.0
"""A base model whose level is so many times the best candidate's is not fitted to the end."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One hypothesis after its fit.

    Attributes
    ----------
    name : str
    place : Point
    score : float
        Cost with the price of its parameters and choices added (BIC): lower is better.
    level : float
        rms of the normalised residuals of the records fitted; 1 is the noise.
    held_out : float
        The same of the records held out, the physics frozen.
    converged : bool
    typical : float
        Median level of the windows, the larger one of the records fitted and those held out: a few windows whose start
        state was missed do not show in it.
    losses : ndarray (w,)
        What each window of the records fitted adds to the cost.
    held : Point, optional
        The place on the records held out.
    strange : float
        The largest level of a typical window (the median) in one of the records held out.
    """

    name: str
    place: Point
    score: float
    level: float
    held_out: float
    converged: bool
    typical: float
    losses: np.ndarray
    held: Point | None = None
    strange: float = math.nan

    def lead(self, other: Candidate) -> float:
        """How far another one is behind, if all windows were like the typical one (the median): what a few windows
        have missed does not count."""
        return len(self.losses) * float(np.median(other.losses - self.losses))


def careful_base(model: Model, start: Point | None) -> Point:
    problem = Problem(model, NONE, caution=CAUTIONS[0])
    z = np.zeros(len(problem.parameters))
    states = np.zeros((len(model.counts), model.local_count(NONE)))
    if start is not None:
        z, states = start.z, model.states_for(NONE, start.states)
    return fit(problem, problem.searched(problem.point(z, states)), steps=_CAREFUL).place


def relaxed(model: Model, place: Point) -> Fit:
    """Fit on from a place, what is known losing weight in stages."""
    *stages, last = CAUTIONS[1:]
    for caution in stages:
        problem = Problem(model, place.hypothesis, caution=caution)
        place = fit(problem, problem.adopted(place), steps=_SHORT).place
    problem = Problem(model, place.hypothesis, caution=last)
    place = problem.adopted(place)
    first = fit(problem, place, steps=_CAREFUL)
    if first.place.level(model) > _FAR and first.place.cost > _FALLING * place.cost:
        return first
    return fit(problem, first.place, steps=_LONG, damping=first.damping, thorough=True)


def finalists(
    scanner: Scanner, starts: list[Start], more: Mapping[str, Sequence[Start]], base: float
) -> list[Candidate]:
    """The candidates worth comparing, fitted to the end, best first.

    Of the leading effects also starts of `more` are fitted while none explains the records; `base` is the base model's
    cost.
    """
    model = scanner.model
    leaders = _leading(model, starts)
    early = _finished(model, leaders[0]) if leaders[0].level(model) < _FAR else None
    if early is not None and early.level < FLOOR:
        best, (first, *leaders) = early, leaders[:_FINALISTS]
    else:
        seed, tried = leaders[0], {start.hypothesis.name for start in starts}
        first, *leaders = _explored(scanner, leaders, more, tried)
        best = early if early is not None and _same(first, seed) else _finished(model, first)
        if early is not None and early.name == best.name:
            best = min(best, early, key=lambda c: c.score)
    # one that got not half as far as the best one is no rival, unless that one leaves a gap as well
    bar = 0.5 * (base + first.cost) if best.level < FLOOR else base
    rivals = [place for place in leaders if place.cost < bar]
    candidates = sorted([best, *(_finished(model, place) for place in rivals)], key=lambda c: c.score)
    return candidates if candidates[0].level < FLOOR else _found_elsewhere(scanner, candidates)


def _found_elsewhere(scanner: Scanner, candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, the leading ones fitted again, while none explains the records, from where all starts of their
    effects together show the least misfit."""
    model, found = scanner.model, {candidate.name: candidate for candidate in candidates}
    for candidate in candidates[:LEADING]:
        if min(c.level for c in found.values()) >= FLOOR:
            (place,) = _leading(model, surveyed(scanner, candidate.name))
            cautious = Problem(model, place.hypothesis, caution=CAUTIONS[0])
            place = escaped(cautious, place, rounds=_ESCAPES[0], enough=FLOOR)
            if Problem(model, place.hypothesis).adopted(place).cost < candidate.place.cost:
                found[candidate.name] = min(candidate, _finished(model, place), key=lambda c: c.score)
    return sorted(found.values(), key=lambda c: c.score)


def _explored(
    scanner: Scanner, leaders: list[Point], more: Mapping[str, Sequence[Start]], tried: Container[str]
) -> list[Point]:
    """The leaders, or what more starts of their effects, effects that were not `tried` and ways out of local minima
    lead to."""
    model = scanner.model
    for name in [place.hypothesis.name for place in leaders[:LEADING]]:
        if not _explained(model, leaders):
            others = _leading(model, [scanner.sharpened(start) for start in chosen(scanner, more[name])])
            leaders = _distinct([*leaders, *others])
    if not _explained(model, leaders):
        leaders = _distinct([*leaders, *_leading(model, scanner.turned(leaders[0])[:1])])
    if not _explained(model, leaders):
        others = overlooked(scanner, [starts for name, starts in more.items() if name not in tried])
        leaders = _distinct([*leaders, *_leading(model, others)])
    leaders = leaders[:_FINALISTS]
    for rounds in _ESCAPES:
        if not _explained(model, leaders):
            problem = Problem(model, leaders[0].hypothesis, caution=CAUTIONS[0])
            leaders[0] = escaped(problem, leaders[0], rounds=rounds, enough=FLOOR)
            leaders.append(leaders.pop(0))
    return sorted(leaders, key=lambda place: place.cost)


def _explained(model: Model, places: Sequence[Point]) -> bool:
    return min(place.level(model) for place in places) <= FLOOR


def _leading(model: Model, starts: Sequence[Start]) -> list[Point]:
    """The best place of each effect after a few steps from every start and more from the best ones, best first."""
    tried: list[Point] = []
    for start in starts:
        # what explains the records leaves other effects one start each, to show whether they do as well
        explained = any(place.level(model) < FLOOR for place in tried)
        if not (explained and any(place.hypothesis.name == start.hypothesis.name for place in tried)):
            tried.append(_tried(model, start))
    differing: list[Point] = []
    for place in sorted(tried, key=lambda place: place.cost):
        if not any(_one_place(place, other) for other in differing):
            differing.append(place)
    return _distinct([_pursued(model, place) for place in differing[: _FINALISTS + 1]])


def _same(a: Point, b: Point) -> bool:
    return a.hypothesis == b.hypothesis and np.array_equal(a.z, b.z) and np.array_equal(a.states, b.states)


def _one_place(a: Point, b: Point) -> bool:
    own = len(a.z) - len(a.hypothesis.parameters)
    return a.hypothesis == b.hypothesis and np.allclose(a.z[own:], b.z[own:], rtol=_SAME, atol=_SAME)


def _distinct(places: Sequence[Point]) -> list[Point]:
    """The best place of each effect, best first."""
    seen: dict[str, Point] = {}
    for place in sorted(places, key=lambda place: place.cost):
        seen.setdefault(place.hypothesis.name, place)
    return list(seen.values())


def _tried(model: Model, start: Start) -> Point:
    """A few joint steps from a start, with what is known of the machine weighing heavily."""
    problem = Problem(model, start.hypothesis, caution=CAUTIONS[0])
    place = problem.searched(problem.point(start.place.z, start.place.states))
    return fit(problem, place, steps=_SHORT // 2).place


def _pursued(model: Model, place: Point) -> Point:
    return fit(Problem(model, place.hypothesis, caution=CAUTIONS[0]), place, steps=_SHORT).place


def _finished(model: Model, place: Point) -> Candidate:
    result = relaxed(model, place)
    return _candidate(model, result.place, result.converged)


def refitted(model: Model, hypothesis: Hypothesis, z: np.ndarray, states: np.ndarray) -> Candidate:
    """The candidate that a place (g,), (w, l) leads to."""
    problem = Problem(model, hypothesis)
    result = fit(problem, problem.searched(problem.point(z, states)), steps=_LONG, thorough=True)
    return _candidate(model, result.place, result.converged)


def brought_to_rest(model: Model, candidate: Candidate) -> Candidate:
    """The candidate after a patient search for what its fit has missed."""
    place = rested(Problem(model, candidate.place.hypothesis), candidate.place, patient=True)
    return _candidate(model, place, candidate.converged)


def base_candidate(model: Model, careful: Point, best: Candidate) -> Candidate:
    """The base model fitted from where it was calibrated and from the best candidate's parameters, to the end where it
    comes near: a poor base fit must not make an effect look needed."""
    problem = Problem(model, NONE)
    other = problem.point(best.place.z[: len(careful.z)], model.states_for(NONE, best.place.states))
    places = [problem.adopted(careful), problem.searched(other)]
    fits = [fit(problem, place, steps=_SHORT) for place in places]
    result = min(fits, key=lambda f: f.place.cost)
    if result.place.level(model) < _NEAR * max(1.0, best.level):
        result = fit(problem, result.place, steps=_LONG, damping=result.damping, thorough=True)
    return _candidate(model, result.place, result.converged)


def _candidate(model: Model, place: Point, converged: bool) -> Candidate:
    samples = float(model.counts.sum())
    choices = len(model.hypotheses().get(place.hypothesis.name, (NONE,)))
    price = len(place.hypothesis.parameters) * math.log(samples) + 2.0 * math.log(choices)
    level = place.level(model)
    losses = Problem(model, place.hypothesis).losses(place.squares)
    return Candidate(
        place.hypothesis.name, place, place.cost + price, level, math.nan, converged, _typical(place, model), losses
    )


def tested(candidate: Candidate, held: Point, held_out: Model) -> Candidate:
    level = held.squares / held_out.counts
    strange = math.sqrt(max(float(np.median(level[held_out.groups == k])) for k in np.unique(held_out.groups)))
    typical = max(candidate.typical, _typical(held, held_out))
    return dataclasses.replace(candidate, held_out=held.level(held_out), typical=typical, held=held, strange=strange)


def _typical(place: Point, model: Model) -> float:
    return math.sqrt(float(np.median(place.squares / model.counts)))
