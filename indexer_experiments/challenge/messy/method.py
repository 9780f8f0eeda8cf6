"""The method under test: the files of a case -> a neutral answer. All that the messy challenge knows of `explain`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from discrepancy.explain import Explanation, explain
from discrepancy.findings import Estimate
from discrepancy.locate import Where, locate
from discrepancy.locate.result import Cell
from discrepancy.model import in_turn
from discrepancy.naming import NAMING
from discrepancy.records.experiments import experiments
from discrepancy.records.quality import check_records
from discrepancy.records.reading import read_records
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.errors import ParameterError, SignalError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.messy.answer import CaseAnswer, Finding, Interval, Remains, Solved
from indexer_records.conditions import Pulse

_KINDS = {
    "cam phase": "phase", "sign of the torque": "phase", "station": "station", "motor speed": "speed", "load": "speed",
    "fixed frequency": "frequency", "table": "station", "cam": "phase", "motor shaft": "frequency",
}  # fmt: skip
"""Axes of cells and kinds of lines in the challenge's words."""


def solved_by_explain(folder: Path, nominal: Machine, uncertainty: Mapping[str, float]) -> Solved:
    """The answer of `indexer explain` to the files of a folder."""
    try:
        records = read_records(str(folder), None, {}, Pulse(), [])
        check_records(records, nominal)
        given = experiments(records, nominal, Sensor())
    except (SignalError, ParameterError) as error:
        return Solved(CaseAnswer("turned away", str(error)))
    subject = IndexerSubject(nominal, Sensor(), given, uncertainty)
    answer = explain(subject.model, subject.held_out)
    named = answer.verdict in NAMING
    model = in_turn(subject.model, answer.effects[:-1] if named else ())
    where = locate(model, answer.believed.place, subject.view(model), np.random.default_rng(0))
    machine, sensor = model.machine_at(answer.believed.place.hypothesis, answer.believed.place.z)  # type: ignore[attr-defined]
    return Solved(_neutral(answer, where), machine, sensor)


def _neutral(answer: Explanation, where: Where) -> CaseAnswer:
    findings = []
    for k, found in enumerate(answer.found if answer.verdict in NAMING else ()):
        alike = answer.rounds[-1].names if answer.verdict == "ambiguous" and k == len(answer.found) - 1 else ()
        members = tuple(dict.fromkeys((found.name, *alike)))
        ranking = answer.rounds[min(k, len(answer.rounds) - 1)].ranking
        probability = sum(row.probability for row in ranking if row.name in members)
        place = ", ".join(f"{name} {value:g}" for name, value in found.choices)
        grade = "established" if len(members) == 1 else "family"
        intervals = tuple(_interval(f"{found.name}.{estimate.name}", estimate) for estimate in found.parameters)
        findings.append(Finding(grade, members, place, min(max(probability, 0.0), 1.0), intervals))
    machine = tuple(_interval(e.name, e) for e in answer.calibration.estimates)
    return CaseAnswer(answer.verdict, answer.reason, tuple(findings), _remains(where), machine)


def _interval(name: str, estimate: Estimate) -> Interval:
    return Interval(name, estimate.low, estimate.high)


def _remains(where: Where) -> Remains | None:
    """The kind of the most extreme cell or line; today's answer names no joint."""
    if not where.significant:
        return None
    first = where.significant[0]
    return Remains("", _KINDS[first.axis if isinstance(first, Cell) else first.kind])
