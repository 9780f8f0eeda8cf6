"""The method under test: the files of a case -> a neutral answer. All that the messy challenge knows of `explain`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from discrepancy.criteria import Criteria
from discrepancy.estimates import Estimate
from discrepancy.explain import Explanation, explain
from discrepancy.indexer import IndexerModel
from discrepancy.origin import Origin
from discrepancy.records.experiments import experiments
from discrepancy.records.quality import check_records
from discrepancy.records.reading import read_records
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.errors import ParameterError, SignalError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.messy.answer import CaseAnswer, Finding, Interval, Remains, Solved
from indexer_records.conditions import Pulse


def solved_by_explain(
    folder: Path, nominal: Machine, uncertainty: Mapping[str, float], criteria: Criteria | None = None
) -> Solved:
    """The answer of `indexer explain` to the files of a folder."""
    try:
        records = read_records(str(folder), None, {}, Pulse(), [])
        check_records(records, nominal)
        given = experiments(records, nominal, Sensor())
    except (SignalError, ParameterError) as error:
        return Solved(CaseAnswer("turned away", str(error)))
    subject = IndexerSubject(nominal, Sensor(), given, uncertainty)
    answer = explain(subject.model, subject.held_out, criteria, subject.forms(), subject.elsewhere)
    model, place = answer.model, answer.written.place
    assert isinstance(model, IndexerModel)
    origin = subject.origin(model, answer.accepted.place)
    machine, sensor = model.machine_at(place.hypothesis, place.z)
    return Solved(_neutral(answer, origin), machine, sensor)


def _neutral(answer: Explanation, origin: Origin | None) -> CaseAnswer:
    findings = []
    for finding in answer.findings:
        first = finding.effects[0]
        findings.append(Finding(
            finding.grade, tuple(effect.name for effect in finding.effects),
            ", ".join(f"{name} {value:g}" for name, value in first.choices), finding.probability,
            tuple(_interval(f"{e.name}.{p.name}", p) for e in finding.effects for p in e.parameters),
        ))  # fmt: skip
    machine = tuple(_interval(e.name, e) for e in answer.calibration.estimates)
    why = " ".join(finding.why for finding in answer.findings)
    return CaseAnswer(answer.verdict, why, tuple(findings), _remains(answer, origin), machine)


def _interval(name: str, estimate: Estimate) -> Interval:
    return Interval(name, estimate.low, estimate.high)


def _remains(answer: Explanation, origin: Origin | None) -> Remains | None:
    """Where what is left comes from."""
    if origin is not None:
        return Remains(origin.first.joint, origin.first.kind)
    if answer.remains.times_noise**2 - 1.0 < answer.criteria.at_noise:
        return None
    return Remains("", "")
