"""A case through the search."""

from __future__ import annotations

import time

from discrepancy.drives.door import subject_of
from discrepancy.explain import explain
from discrepancy.grades import NAMED
from indexer_experiments.challenge.drives.draw import Case
from indexer_experiments.challenge.drives.score import Judged


def judged(case: Case) -> Judged:
    """What the search says of a case."""
    begun = time.process_time()
    subject = subject_of(case.drive, case.records)
    answer = explain(subject.model, subject.held_out, forms=subject.forms())
    named = tuple(tuple(e.name for e in f.effects) for f in answer.findings if f.grade in NAMED)
    hints = tuple(f.name for f in answer.findings if f.grade not in NAMED)
    return Judged(
        case.number, case.hidden, case.unknown, named, hints, answer.before, answer.after, answer.remains.level,
        time.process_time() - begun,
    )  # fmt: skip
