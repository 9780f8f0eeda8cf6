"""Which effect is missing: every effect and "none" compete for the same records, and for records they never saw.

scan every start → fit the promising ones jointly → refit the base from the winner's place → compare, also on records
held out.
All rules are relative: to the base model's misfit, to the noise floor and to each other.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from discrepancy.blackbox import black_box_level
from discrepancy.escape import escaped
from discrepancy.findings import Ranked, ranked
from discrepancy.fit import Fit, Point, Problem, fit
from discrepancy.model import NONE, Model
from discrepancy.scan import Scanner, Start

VERDICTS = ("named", "none", "ambiguous", "unexplained", "not_converged")
"""named: an effect is clearly ahead, or effects found one after the other close the gap; none: there is no gap;
ambiguous: several effects explain it alike; unexplained: there is a gap that no effect of the library closes;
not_converged: the base fit never came to rest, so nothing can be said."""

_SHORT, _LONG = 6, 30
"""Steps of the fits that choose among candidates, and of those that are compared."""

CAUTIONS = (100.0, 10.0, 1.0)
"""Weights of the priors, stage by stage. While the effect is missing the priors must hold the machine against a misfit
that repeats in every window; with the effect found they need no more than their own weight."""

_CANDIDATES, _FINALISTS = 6, 3

_ESCAPES = (2, 1)
"""How often a way out of a local minimum is looked for: from the leader, and from the second, while none explains the
records."""

_MARGIN = 30.0
"""Least gain in cost (twice a log-likelihood) beyond the price of an effect's parameters."""

_SHARE = 0.05
"""Share of the winner's gain by which the next effect must stay behind; nearer ones are ambiguous."""

_FLOOR = 1.1
"""Level at which a candidate leaves hardly anything to explain."""

_NEAR = 2.0
"""A base model whose level is so many times the best candidate's is not fitted to the end."""

_TEMPER = 5.0
"""Factor by which evidence is taken for less than the sum over samples says: what a model gets wrong repeats."""

SLIGHT = 0.2
"""Mean square above the noise, in units of it, below which there is hardly a gap: 1.095 in rms."""


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
    """

    name: str
    place: Point
    score: float
    level: float
    held_out: float
    converged: bool


@dataclass(frozen=True, eq=False)
class Naming:
    """The answer.

    Attributes
    ----------
    verdict : str
        One of VERDICTS.
    names : tuple of str
        The effect named, or those that cannot be told apart.
    candidates : tuple of Candidate
        Those fitted to the end, best first; "none" among them.
    black_box : float
        Level of the black-box control on the records held out.
    reason : str
    """

    verdict: str
    names: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    black_box: float
    reason: str

    @property
    def ranking(self) -> tuple[Ranked, ...]:
        """Posterior probabilities, tempered by the misfit that even the best candidate leaves."""
        rows = [(c.name, c.score, c.held_out) for c in self.candidates]
        return ranked(rows, max(1.0, self.candidates[0].level ** 2) * _TEMPER)


def calibrate(model: Model, start: Point | None = None) -> tuple[Point, Fit]:
    """Fit the base model from its nominal parameters, or from a place of the model it extends.

    Returns the place where what is known weighs heavily, and the fit reached from there when it weighs as stated.
    """
    careful = _careful(model, start)
    return careful, _relaxed(model, careful)


def _careful(model: Model, start: Point | None) -> Point:
    problem = Problem(model, NONE, caution=CAUTIONS[0])
    z = np.zeros(len(problem.parameters))
    states = np.zeros((len(model.counts), model.local_count(NONE)))
    if start is not None:
        z, states = start.z, model.states_for(NONE, start.states)
    return fit(problem, problem.searched(problem.point(z, states)), steps=_LONG // 2).place


def _relaxed(model: Model, place: Point) -> Fit:
    """Fit on from a place, what is known losing weight in stages."""
    *stages, last = CAUTIONS[1:]
    for caution in stages:
        problem = Problem(model, place.hypothesis, caution=caution)
        place = fit(problem, problem.adopted(place), steps=_SHORT).place
    problem = Problem(model, place.hypothesis, caution=last)
    return fit(problem, problem.adopted(place), steps=_LONG)


def name_effect(model: Model, held_out: Model, start: Point | None = None) -> Naming:
    """Name the one effect that a model lacks most to explain its records.

    Parameters
    ----------
    model : Model
        With the records to fit.
    held_out : Model
        The same model with records at other conditions, on which the candidates are compared with their physics frozen.
    start : Point, optional
        Where the base fit begins: the place reached by the model that this one extends.
    """
    careful = _careful(model, start)
    scanner = Scanner(model, careful, CAUTIONS[0])
    finalists = _finalists(model, _promising(model, scanner), careful.cost)
    none = _base(model, careful, finalists[0])
    candidates = sorted([none, *finalists], key=lambda c: c.score)
    held = [held_place(c.place, held_out) for c in candidates]
    tested = [_tested(c, place, held_out) for c, place in zip(candidates, held, strict=True)]
    of_none = next(place for place in held if place.hypothesis.name == NONE.name)
    return _verdict(tested, black_box_level(model, none.place, held_out, of_none))


def _promising(model: Model, scanner: Scanner) -> list[Start]:
    """The best start of each effect, those effects first that promise most; and a second one of the leaders."""
    best: list[list[Start]] = []
    for hypotheses in model.hypotheses().values():
        best.append(sorted((s for h in hypotheses for s in scanner.starts(h)), key=lambda s: s.promised))
    best.sort(key=lambda starts: starts[0].promised)
    leaders = [starts[0] for starts in best[:_CANDIDATES]] + [starts[1] for starts in best[:2] if len(starts) > 1]
    return sorted((scanner.sharpened(start) for start in leaders), key=lambda s: s.promised)


def _finalists(model: Model, starts: list[Start], base: float) -> list[Candidate]:
    """The candidates worth comparing, fitted to the end, best first; `base` is the base model's cost."""
    tried = sorted((_tried(model, start) for start in starts), key=lambda place: place.cost)
    tried = sorted((_pursued(model, place) for place in tried[: _FINALISTS + 1]), key=lambda place: place.cost)
    leaders = _distinct(tried)[:_FINALISTS]
    for rounds in _ESCAPES:
        if leaders[0].level(model) > _FLOOR:
            problem = Problem(model, leaders[0].hypothesis, caution=CAUTIONS[0])
            leaders[0] = escaped(problem, leaders[0], rounds=rounds, enough=_FLOOR)
            leaders.append(leaders.pop(0))
    leaders.sort(key=lambda place: place.cost)
    finished: list[Candidate] = []
    for place in leaders:
        # one that got not half as far as the best one, which leaves nothing to explain, is no rival
        done = finished and finished[0].level < _FLOOR
        if done and place.cost > 0.5 * (base + finished[0].place.cost):
            continue
        finished.append(_finished(model, place))
        finished.sort(key=lambda c: c.score)
    return finished


def _distinct(places: list[Point]) -> list[Point]:
    """The best place of each effect."""
    seen: dict[str, Point] = {}
    for place in places:
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
    result = _relaxed(model, place)
    return _candidate(model, result.place, result.converged)


def _base(model: Model, careful: Point, best: Candidate) -> Candidate:
    """The base model fitted from where it was calibrated and from the best candidate's parameters, to the end where it
    comes near: a poor base fit must not make an effect look needed."""
    problem = Problem(model, NONE)
    other = problem.point(best.place.z[: len(careful.z)], model.states_for(NONE, best.place.states))
    places = [problem.adopted(careful), problem.searched(other)]
    fits = [fit(problem, place, steps=_SHORT) for place in places]
    result = min(fits, key=lambda f: f.place.cost)
    if result.place.level(model) < _NEAR * max(1.0, best.level):
        result = fit(problem, result.place, steps=_LONG, damping=result.damping)
    return _candidate(model, result.place, result.converged)


def _candidate(model: Model, place: Point, converged: bool) -> Candidate:
    samples = float(model.counts.sum())
    choices = len(model.hypotheses().get(place.hypothesis.name, (NONE,)))
    price = len(place.hypothesis.parameters) * math.log(samples) + 2.0 * math.log(choices)
    level = place.level(model)
    return Candidate(place.hypothesis.name, place, place.cost + price, level, math.nan, converged)


def held_place(place: Point, held_out: Model) -> Point:
    """The candidate's physics on the records held out; only start states and what belongs to single records move."""
    problem = Problem(held_out, place.hypothesis, frozen=True)
    own = len(place.hypothesis.parameters)
    z = np.array([0.0] * len(problem.parameters))
    physics = [k for k, p in enumerate(held_out.parameters) if not p.of_record]
    z[physics] = place.z[physics]
    if own:
        z[-own:] = place.z[-own:]
    states = np.zeros((len(held_out.counts), held_out.local_count(place.hypothesis)))
    return fit(problem, problem.searched(problem.point(z, states)), steps=_SHORT * 2).place


def _tested(candidate: Candidate, held: Point, held_out: Model) -> Candidate:
    level = math.sqrt(held.squares.sum() / held_out.counts.sum())
    return dataclasses.replace(candidate, held_out=level)


def _verdict(candidates: list[Candidate], box: float) -> Naming:
    none = next(c for c in candidates if c.name == NONE.name)
    best = candidates[0]
    gap, gain = none.level**2 - 1.0, none.score - best.score

    def answer(verdict: str, names: tuple[str, ...], reason: str) -> Naming:
        return Naming(verdict, names, tuple(candidates), box, reason)

    if gain < _MARGIN or (gap < SLIGHT and none.held_out <= 1.05 * best.held_out):
        if gap < SLIGHT:
            return answer("none", (), "the base model alone reaches the noise floor")
        verdict = "unexplained" if none.converged else "not_converged"
        return answer(verdict, (), "the base model leaves a gap, and no effect of the library lessens it")
    near = [
        c.name for c in candidates[1:] if c.name != NONE.name and c.score - best.score < max(_MARGIN, _SHARE * gain)
    ]
    if near:
        return answer("ambiguous", (best.name, *near), "these effects explain the records alike")
    if best.held_out > none.held_out:
        return answer("unexplained", (best.name,), f"{best.name} does not predict the records held out")
    return answer("named", (best.name,), f"{best.name} explains the records best, also those it never saw")
