"""The stages one after the other: calibrate and name, locate, show the gap, choose the next measurement."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from discrepancy.candidates import Candidate
from discrepancy.explain import Explanation, explain
from discrepancy.gap import Gap, gap_of
from discrepancy.locate import Where, locate
from discrepancy.model import Hypothesis, Model, in_turn
from discrepancy.naming import NAMING
from discrepancy.next_measurement import Separation, separations
from discrepancy.problem import Point, Problem
from discrepancy.subjects.base import Subject

STAGES = ("calibrate and name", "locate what disagreed", "compare on records held out", "choose the next measurement")


@dataclass(frozen=True, eq=False)
class Fitted:
    """A place of a model on the records fitted, and on those held out with its physics frozen.

    Attributes
    ----------
    model, held_out : Model
    place, held_place : Point
    """

    model: Model
    place: Point
    held_out: Model
    held_place: Point


@dataclass(frozen=True, eq=False)
class Outcome:
    """Everything that a report shows.

    Attributes
    ----------
    subject : Subject
    answer : Explanation
    effects : tuple of Hypothesis
        Those that the verdict accepts, in the order found.
    before, after : Fitted
        The base model, and with the effects; the same where none is accepted.
    where, where_after : Where
        Where each of the two disagrees with the records fitted.
    gap : Gap
    next : tuple of Separation
        Measurements that would tell ambiguous effects apart, the best first.
    seed : int
    """

    subject: Subject
    answer: Explanation
    effects: tuple[Hypothesis, ...]
    before: Fitted
    after: Fitted
    where: Where
    where_after: Where
    gap: Gap
    next: tuple[Separation, ...]
    seed: int


def run_chain(subject: Subject, seed: int, begin: Callable[[str], None] = lambda stage: None) -> Outcome:
    """All stages; `begin` is told each of STAGES as it begins."""
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3)]
    begin(STAGES[0])
    answer = explain(subject.model, subject.held_out)
    effects = answer.effects if answer.verdict in NAMING else ()
    before = _fitted(subject, answer.base, ())
    after = before
    if effects:
        found = _fitted(subject, answer.rounds[-1].candidates[0], effects[:-1])
        before, after = _pooled(before, found), _pooled(found, before)
    begin(STAGES[1])
    where = locate(before.model, before.place, subject.view(before.model), streams[0])
    where_after = locate(after.model, after.place, subject.view(after.model), streams[1]) if effects else where
    begin(STAGES[2])
    gap = gap_of(before.held_place, after.held_place, subject.view(subject.held_out), streams[2])
    begin(STAGES[3])
    following = separations(subject, answer, effects) if answer.verdict == "ambiguous" else ()
    return Outcome(subject, answer, effects, before, after, where, where_after, gap, following, seed)


def _pooled(fitted: Fitted, other: Fitted) -> Fitted:
    """The same with start states that the other one found: a state that was missed must not decide."""
    problem = Problem(fitted.held_out, fitted.place.hypothesis, frozen=True)
    return dataclasses.replace(fitted, held_place=problem.pooled(fitted.held_place, [other.held_place]))


def _fitted(subject: Subject, candidate: Candidate, known: tuple[Hypothesis, ...]) -> Fitted:
    model, held_out = in_turn(subject.model, known), in_turn(subject.held_out, known)
    assert candidate.held is not None, "what was compared has a place on the records held out"
    return Fitted(model, candidate.place, held_out, candidate.held)
