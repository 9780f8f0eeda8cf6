"""The stages one after the other: search, locate what disagrees, show the gap, choose the next measurement.

What comes behind the search only adds to its answer: a stage that fails is told in one sentence, and the others go on.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from discrepancy.criteria import Criteria
from discrepancy.estimates import astray
from discrepancy.explain import Explanation, explain
from discrepancy.gap import Gap, gap_of
from discrepancy.locate import Where, locate
from discrepancy.next_measurement import Question, Separation, question_of, separations
from discrepancy.origin import Origin
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.subjects.base import Subject
from discrepancy.table import Table, tabulate

_log = logging.getLogger(__name__)

STAGES = (
    "calibrate and search", "locate what disagrees", "compare on records held out", "tabulate what remains",
    "choose the next measurement",
)  # fmt: skip

_QUIET = (
    "The noise is {:.0f} % of what the records themselves seem to show: the machine rings where they are quiet, as the "
    "calibrated model tells."
)

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Outcome:
    """Everything that a report shows.

    Attributes
    ----------
    subject : Subject
    answer : Explanation
    where, left : Where or None
        Where the model as it came disagrees with the records fitted, and the one with what is accepted; None where the
        stage failed.
    gap : Gap or None
    question : Question or None
        What a further measurement would settle; None where nothing is open.
    next : tuple of Separation
        Measurements by how far they settle it, the best first.
    failures : tuple of str
        One sentence for each stage that failed.
    seed : int
    table : Table or None
        What remains as a table; None where nothing does, or no table earns a hint.
    origin : Origin or None
        The joint at which what remains beside what is accepted enters, and what it varies with; None where nothing
        shows, or the subject cannot tell.
    of_records : tuple of str
        What is accepted says of single records and of their noise, a sentence each.
    asked : bool
        False where the stage failed before the question was formed, so that something may be open.
    """

    subject: Subject
    answer: Explanation
    where: Where | None
    left: Where | None
    gap: Gap | None
    question: Question | None
    next: tuple[Separation, ...]
    failures: tuple[str, ...]
    seed: int
    table: Table | None = None
    origin: Origin | None = None
    of_records: tuple[str, ...] = ()
    asked: bool = True

    @property
    def extended(self) -> bool:
        """Whether an effect is accepted."""
        return bool(self.answer.names)


def run_chain(
    subject: Subject, seed: int, begin: Callable[[str], None] = lambda stage: None, criteria: Criteria | None = None
) -> Outcome:
    """All stages; `begin` is told each of STAGES as it begins."""
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3)]
    failures: list[str] = []

    def attempted(stage: str, make: Callable[[], T], otherwise: T) -> T:
        # The answer took minutes and stands whatever happens from here on, so nothing may take it away.
        try:
            return make()
        except KeyboardInterrupt:
            failures.append(f"The stage “{stage}” was interrupted; the findings stand.")
        except Exception as error:
            _log.exception("%s failed", stage)
            failures.append(f"The stage “{stage}” failed ({type(error).__name__}: {error}); the findings stand.")
        return otherwise

    begin(STAGES[0])
    forms = subject.forms()
    answer = explain(subject.model, subject.held_out, criteria, forms, subject.elsewhere)
    begin(STAGES[1])
    model = answer.model
    where = attempted(STAGES[1], lambda: locate(model, answer.base.place, subject.view(model), streams[0]), None)
    left = where
    if answer.names:
        left = attempted(STAGES[1], lambda: locate(model, answer.accepted.place, subject.view(model), streams[1]), None)
    origin = None
    # what does not differ from noise comes from nowhere
    if left is None or left.significant or not answer.at_noise:
        with threadpool_limits(limits=1, user_api="blas"):
            origin = attempted(STAGES[1], lambda: subject.origin(model, answer.accepted.place), None)
    of_records = attempted(STAGES[1], lambda: subject.of_records(model, answer.accepted.place), ())
    if answer.noise_share < 1.0:
        of_records = (_QUIET.format(100.0 * answer.noise_share), *of_records)
    of_records = (*of_records, *astray(answer.calibration))
    begin(STAGES[2])
    gap = attempted(STAGES[2], lambda: _gap(subject, answer, streams[2]), None)
    begin(STAGES[3])
    table = attempted(STAGES[3], lambda: tabulate(answer, forms), None)
    if table is None and not answer.selection.complete and not answer.at_noise and forms:
        failures.append("What remains was not read off as a table: the time allowed ran out.")
    begin(STAGES[4])
    before = len(failures)
    question = attempted(STAGES[4], lambda: question_of(answer), None)
    asked = len(failures) == before
    following = attempted(STAGES[4], lambda: separations(subject, answer, question) if question else (), ())
    told = tuple(dict.fromkeys(failures))
    return Outcome(
        subject, answer, where, left, gap, question, following, told, seed, table, origin, of_records, asked
    )  # fmt: skip


def _gap(subject: Subject, answer: Explanation, rng: np.random.Generator) -> Gap:
    """Each of the two may take the start states that the other one found: one that was missed must not decide."""
    before, after = (answer.held[name] for name in (answer.base.name, answer.accepted.name))
    if answer.names:
        before, after = _pooled(answer, before, after), _pooled(answer, after, before)
    return gap_of(before, after, answer.held_out, subject.view(answer.held_out), answer.remains.noise**2, rng)


def _pooled(answer: Explanation, place: Point, other: Point) -> Point:
    return Problem(answer.held_out, place.hypothesis, frozen=True).pooled(place, [other])
