"""Which measurement would tell ambiguous effects apart: the one in which their predictions differ most.

Each effect's machine, as the records so far left it, is simulated at the imagined conditions. The other one may adapt:
its parameters x within what the records so far allow (information S, start states eliminated), its windows' start
states y freely, both linearised:

    separation = 1/s² · min over x, y of ‖(r_other - r_true)/σ + G x + L y‖² + xᵀ S x

in units of twice a log-likelihood, the smaller one of the two ways round. s, at least 1, is the level that the best of
them leaves on the records so far: what a model gets wrong does not average out as noise does.
"""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np

from discrepancy.arrow import arrow
from discrepancy.explain import Explanation
from discrepancy.model import Hypothesis, Jobs, Model, in_turn
from discrepancy.naming import MARGIN
from discrepancy.problem import Point, Problem
from discrepancy.subjects.base import Measurement, Subject

ENOUGH = MARGIN
"""Separation from which on one of two effects would be named: the margin of `naming`."""


@dataclass(frozen=True)
class Separation:
    """How far one imagined measurement separates the effects.

    Attributes
    ----------
    measurement : str
    separation : float
        Of the pair that it separates least, in units of twice a log-likelihood.
    pair : (str, str)
        That pair.
    """

    measurement: str
    separation: float
    pair: tuple[str, str]


@dataclass(frozen=True, eq=False)
class _Rival:
    """One effect as the records so far left it: its place, by parameter name, and the information S about them."""

    hypothesis: Hypothesis
    names: tuple[str, ...]
    z: np.ndarray
    information: np.ndarray


def separations(subject: Subject, answer: Explanation, effects: tuple[Hypothesis, ...]) -> tuple[Separation, ...]:
    """Every measurement of the subject by how far it separates the effects of an ambiguous answer, the best first."""
    last = answer.rounds[-1]
    model = in_turn(subject.model, effects[:-1])
    rivals = [_rival(model, c.place) for c in last.candidates if c.name in last.names]
    scale = max(1.0, last.candidates[0].level ** 2)
    found = []
    for measurement in subject.measurements(effects[:-1]):
        pairs = {
            (a.hypothesis.name, b.hypothesis.name): min(_separation(measurement, a, b), _separation(measurement, b, a))
            for a, b in itertools.combinations(rivals, 2)
        }
        pair = min(pairs, key=lambda names: pairs[names])
        found.append(Separation(measurement.name, pairs[pair] / scale, pair))
    return tuple(sorted(found, key=lambda s: -s.separation))


def _rival(model: Model, place: Point) -> _Rival:
    """What the records tell of the physics, what belongs to single records eliminated."""
    problem = Problem(model, place.hypothesis)
    whole = problem.equations(place).reduced()[0]
    of_record = np.array([p.of_record for p in problem.parameters])
    own, other = np.flatnonzero(~of_record), np.flatnonzero(of_record)
    across = whole[np.ix_(own, other)]
    information = whole[np.ix_(own, own)]
    if len(other):
        information = information - across @ np.linalg.solve(whole[np.ix_(other, other)], across.T)
    names = tuple(problem.parameters[k].name for k in own)
    return _Rival(place.hypothesis, names, place.z[own], information)


def _separation(measurement: Measurement, true: _Rival, other: _Rival) -> float:
    """How much worse `other` explains the measurement, simulated with `true`, after it has adapted."""
    model, scale = measurement.model, measurement.scale
    _, truth = _at(model, true)
    windows = np.arange(len(model.counts))
    jobs = Jobs(truth.z[None], np.zeros_like(windows), windows, truth.states)
    made = model.recording(model.readings(true.hypothesis, jobs))
    problem, place = _at(made, other)
    difference, by_global, by_local = (scale * part for part in problem.linearised(place))
    system = arrow(difference, by_global, by_local, np.ones(len(difference)))
    at = [k for k, p in enumerate(problem.parameters) if not p.of_record]
    known = np.zeros_like(system.A)
    known[np.ix_(at, at)] = other.information
    known += np.diag([float(p.known and p.of_record) for p in problem.parameters])
    system = dataclasses.replace(system, A=system.A + known)
    step, local = system.step(0.0, np.diag(system.A) > 0.0)
    left = difference + np.tensordot(step, by_global, 1) + np.einsum("wl,lwn->wn", local, by_local)
    return float((left**2).sum() + step @ known @ step)


def _at(model: Model, rival: _Rival) -> tuple[Problem, Point]:
    """The rival in a model with other records, each window started from rest in the middle of the play."""
    problem = Problem(model, rival.hypothesis)
    values = dict(zip(rival.names, rival.z, strict=True))
    z = np.array([values.get(p.name, 0.0) for p in problem.parameters])
    states = np.zeros((len(model.counts), model.local_count(rival.hypothesis)))
    return problem, problem.point(z, states)
