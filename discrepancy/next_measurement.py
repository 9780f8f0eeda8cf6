"""Which measurement would settle what is open: the one in which two explanations of the records differ most.

Each set of effects, as the records so far left it, is simulated at the imagined conditions. The other one may adapt:
its parameters x within what the records so far tell (information I, start states eliminated) and what was known before
(precision P), its windows' start states y freely, both linearised:

    separation = min over x, y of ‖(r_other - r_true)/σ + G x + L y‖²/D + xᵀ (I/D + P) x

in units of twice a log-likelihood, the smaller one of the two ways round. D is the dispersion under which the search
compared its sets: what a model gets wrong does not average out as noise does.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.arrow import arrow
from discrepancy.explain import Explanation
from discrepancy.finding import Finding
from discrepancy.grades import ESTABLISHED, FAMILY
from discrepancy.jobs import Jobs
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.selection import Fitted
from discrepancy.subjects.base import Measurement, Subject

_MOST = 3
"""Sets that are compared at most: the members of a family that lead."""


@dataclass(frozen=True, eq=False)
class Question:
    """What is open, and the sets of effects that answer it differently.

    Attributes
    ----------
    about : str
        A sentence without its full stop.
    rivals : tuple of Fitted
        Two or more; none where no set of the library predicts what is open.
    """

    about: str
    rivals: tuple[Fitted, ...]


@dataclass(frozen=True)
class Separation:
    """How far one imagined measurement separates the sets.

    Attributes
    ----------
    measurement : str
    separation : float
        Of the pair that it separates least, in units of twice a log-likelihood.
    pair : (str, str)
        What the two sets do not share.
    """

    measurement: str
    separation: float
    pair: tuple[str, str]


@dataclass(frozen=True, eq=False)
class _Rival:
    """One set as the records so far left it: its place, by parameter name, the information I + P about them, and D."""

    hypothesis: Hypothesis
    names: tuple[str, ...]
    z: np.ndarray
    information: np.ndarray
    dispersion: float


def question_of(answer: Explanation) -> Question | None:
    """The question that an answer leaves; of several the one about a family comes first."""
    if answer.verdict == "nothing missing":
        return None
    selection = answer.selection
    for finding in answer.findings:
        if finding.grade == FAMILY:
            k, names = _index(answer, finding), {effect.name for effect in finding.effects[1:]}
            members = [one for one in selection.instead[k] if selection.other(one, k) in names]
            return Question(f"which one of {finding.name} it is", (selection.best, *members)[:_MOST])
    for finding in answer.findings:
        if finding.grade != ESTABLISHED:
            k = _index(answer, finding)
            if selection.instead[k]:
                other = selection.instead[k][0]
                about = f"whether {finding.name} or {apart(other, selection.best)} stands for what is missing"
                return Question(about, (selection.best, other))
            about = f"whether {finding.name} is needed at all, though not what it stands in for"
            return Question(about, (selection.best, selection.without[k]))
    if answer.at_noise:
        return None
    if not selection.tried:
        return Question("with what the remainder grows", ())
    first, *others = selection.tried
    if others:
        rivals = " or ".join(apart(one, selection.best) for one in (first, others[0]))
        return Question(f"whether {rivals} comes nearer to what remains", (first, others[0]))
    return Question(f"whether {apart(first, selection.best)} is a part of what remains", (first, selection.best))


def _index(answer: Explanation, finding: Finding) -> int:
    return answer.best.place.hypothesis.names.index(finding.effects[0].name)


def apart(one: Fitted, other: Fitted) -> str:
    """The effects of a set that another one has not."""
    shared = other.place.hypothesis.names
    return " + ".join(name for name in one.place.hypothesis.names if name not in shared) or "nothing more"


def separations(subject: Subject, answer: Explanation, question: Question) -> tuple[Separation, ...]:
    """Every measurement of the subject that all rivals of a question can make, by how far it separates them, the best
    first."""
    if len(question.rivals) < 2:
        return ()
    rivals = [_rival(answer.selection.model, one.place, answer.selection.dispersion) for one in question.rivals]
    pairs = list(itertools.combinations(range(len(rivals)), 2))
    found = []
    for measurement in subject.measurements(answer.model):
        both = [[_separation(measurement, rivals[a], rivals[b]) for a, b in ((i, j), (j, i))] for i, j in pairs]
        if not np.isfinite(both).all():
            continue
        far = np.min(both, axis=1)
        one, other = (question.rivals[k] for k in pairs[int(far.argmin())])
        value = float(far.min()) / answer.selection.dispersion
        found.append(Separation(measurement.name, value, (apart(one, other), apart(other, one))))
    return tuple(sorted(found, key=lambda s: -s.separation))


def _rival(model: Model, place: Point, dispersion: float) -> _Rival:
    """What the records tell of the physics, what belongs to single records eliminated."""
    problem = Problem(model, place.hypothesis)
    whole = problem.equations(place).reduced()[0]
    of_record = np.array([p.of_record for p in problem.parameters])
    own, other = np.flatnonzero(~of_record), np.flatnonzero(of_record)
    across = whole[np.ix_(own, other)]
    information = whole[np.ix_(own, own)]
    if len(other):
        information = information - across @ np.linalg.pinv(whole[np.ix_(other, other)], hermitian=True) @ across.T
    names = tuple(problem.parameters[k].name for k in own)
    return _Rival(place.hypothesis, names, place.z[own], _positive(information), dispersion)


def _positive(information: np.ndarray) -> np.ndarray:
    """The matrix without negative curvature, which is finite differences' alone."""
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T


def _separation(measurement: Measurement, true: _Rival, other: _Rival) -> float:
    """How much worse `other` explains the measurement, simulated with `true`, after it has adapted."""
    model, scale = measurement.model, measurement.scale
    _, truth = _at(model, true)
    jobs = Jobs.at(truth.z, np.arange(len(model.counts)), truth.states)
    made = model.recording(model.readings(true.hypothesis, jobs))
    problem, place = _at(made, other)
    difference, by_global, by_local = (scale * part for part in problem.linearised(place))
    system = arrow(difference, by_global, by_local, np.ones(len(difference)))
    at = [k for k, p in enumerate(problem.parameters) if not p.of_record]
    known = np.zeros_like(system.A)
    known[np.ix_(at, at)] = other.information
    # D divides all in the end, but what was known beforehand is no less known for it
    more = (other.dispersion - (0.0 if p.of_record else 1.0) for p in problem.parameters)
    known += np.diag([float(p.known) * d for p, d in zip(problem.parameters, more, strict=True)])
    system = dataclasses.replace(system, A=system.A + known)
    step, local = _least(system.reduced(), system.b, system.C)
    left = difference + np.tensordot(step, by_global, 1) + np.einsum("wl,lwn->wn", local, by_local)
    return float((left**2).sum() + step @ known @ step)


def _least(reduced: Sequence[np.ndarray], b: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The step (g,), (w, l) to the least squares; directions of which nothing is told stay."""
    matrix, right, inverse = reduced
    if not np.isfinite(matrix).all():
        return np.full(len(right), np.nan), np.zeros(b.shape)
    step = -np.linalg.pinv(matrix, hermitian=True) @ right
    return step, -np.einsum("wij,wj->wi", inverse, b + np.einsum("wgi,g->wi", C, step))


def _at(model: Model, rival: _Rival) -> tuple[Problem, Point]:
    """The rival in a model with other records, each window started from rest in the middle of the play."""
    problem = Problem(model, rival.hypothesis)
    values = dict(zip(rival.names, rival.z, strict=True))
    z = np.array([values.get(p.name, 0.0) for p in problem.parameters])
    states = np.zeros((len(model.counts), model.local_count(rival.hypothesis)))
    return problem, problem.point(z, states)
