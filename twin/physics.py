"""All that the twin takes from an explanation of `discrepancy`: the calibrated machine, and faults by physics."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discrepancy import Explanation, explain
from discrepancy import Finding as Found
from discrepancy.grades import ESTABLISHED, NAMED
from discrepancy.indexer import IndexerModel
from discrepancy.indexer.library import Seen, library
from discrepancy.indexer.parameters import UNCERTAINTY
from discrepancy.indexer.windows import cut
from discrepancy.model import Hypothesis, Parameter
from discrepancy.records.experiments import Experiments, experiments
from discrepancy.records.reading import Record
from discrepancy.selection import Fitted
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.effects import EFFECTS, MachineEffect, make_effect
from indexer_env.effects.measures import measures
from indexer_env.machine import Machine
from indexer_env.operating_point import REFERENCE_MOTOR_SPEED
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from twin.faults import Fault, by_effect
from twin.posterior import Uncertain, columns_of, joint_of, logs_of, rescaled, whole

_CLOSES = 0.5
"""Share of the gap on held-out records that an effect without a name must close to stand in."""

_FROM_DAY_TO_DAY = 0.2
"""Relative standard deviation of an effect that the machine had when it was healthy [-]: more of it is a fault, which
the records must show, and not what the search begins with."""

_LEAST_SPREAD = 2e-3
"""Least relative standard deviation of a parameter as a prior [-]: what a machine changes by from day to day."""


@dataclass(frozen=True)
class Finding:
    """An effect that was found.

    Attributes
    ----------
    effect : str
    grade : str
        Of `discrepancy.grades`; what stands in is added as well, as a twin must predict, but is not told as a name.
    values : mapping
        Value of each of its parameters [SI], the discrete ones too.
    interval : (float, float)
        95 % interval of its size parameter [SI].
    size : str
        Name of the size parameter.
    rivals : tuple of str
        The other members of its family.
    """

    effect: str
    grade: str
    values: Mapping[str, float]
    interval: tuple[float, float]
    size: str
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The machine as its healthy records tell it.

    Attributes
    ----------
    machine, sensor : Machine, Sensor
        At the mean of the posterior, with what was found.
    load_factor : float
        Loads over loads as they are stated [-], at that mean.
    paths : tuple of str
        Quantities of the joint draws, by path as `datagen.quantities` has them.
    units : tuple of str
    draws : ndarray (n, k)
        Joint draws [SI].
    findings : tuple of Finding
    verdict, headline : str
        Of the search for what the drawing lacks.
    level : float
        rms of the residual of held-out records over the noise.
    scale_spread : float
        Relative standard deviation of the common scale [-].
    spread : mapping
        Relative standard deviation of each of the machine's parameters beside the common scale [-].
    notes : tuple of str
        What was put right or assumed of the records.
    """

    machine: Machine
    sensor: Sensor
    load_factor: float
    paths: tuple[str, ...]
    units: tuple[str, ...]
    draws: np.ndarray
    findings: tuple[Finding, ...]
    verdict: str
    headline: str
    level: float
    scale_spread: float
    spread: Mapping[str, float]
    notes: tuple[str, ...]


def calibrated(subject: IndexerSubject, uncertain: Uncertain, count: int, seed: int) -> Calibrated:
    """Calibrate and extend the machine of a subject, and draw `count` machines from what its records leave open."""
    answer = explain(subject.model, subject.held_out)
    base, model = _accepted(answer), subject.model
    joint = joint_of(model, base.place, uncertain)
    rng = np.random.default_rng(seed)
    z = rng.multivariate_normal(joint.mean, joint.covariance, size=count, method="eigh")
    columns = columns_of(model, base.place.hypothesis, joint, z, uncertain, subject.machine, rng)
    place = dataclasses.replace(base.place, z=whole(base.place.z, joint))
    machine, sensor = model.machine_at(place.hypothesis, place.z)
    sensor = dataclasses.replace(sensor, gain=sensor.gain * joint.gain)
    paths, units, values = zip(*columns, strict=True)
    if uncertain.scale > 0.0:
        values = rescaled(paths, units, values, np.exp(uncertain.scale * rng.standard_normal(count)))
    drawn = dict(zip(paths, values, strict=True))
    findings = tuple(_in_draws(_finding(found), drawn) for found in _told(answer, base))
    logs = logs_of(model, z)
    scale = np.mean([own for name, own in logs.items()], axis=0)
    spread = {name: max(float(np.std(own - scale)), _LEAST_SPREAD) for name, own in logs.items()}
    for path, column in zip(paths, values, strict=True):
        name = path.removeprefix("machine.")
        if name in UNCERTAINTY and name not in spread:
            spread[name] = max(float(np.std(column) / np.mean(column)), _LEAST_SPREAD)
    headline = _headline(answer, findings)
    return Calibrated(
        machine, sensor, joint.load, paths, units, np.column_stack(values), findings, answer.verdict, headline,
        answer.held[base.name].level(subject.held_out), math.hypot(float(np.std(scale)), uncertain.scale), spread,
        tuple(subject.notes),
    )  # fmt: skip


def _accepted(answer: Explanation) -> Fitted:
    """The set of effects that a twin is extended by: what has a name, else what closes most of the gap without one."""
    if answer.names:
        return answer.accepted
    closes = max((found.closes for found in answer.findings), default=0.0)
    return answer.best if closes > _CLOSES else answer.base


def _told(answer: Explanation, fitted: Fitted) -> tuple[Found, ...]:
    """The findings about the effects of a set."""
    return tuple(found for found in answer.findings if found.effects[0].name in fitted.place.hypothesis.names)


def _finding(found: Found) -> Finding:
    effect, *others = found.effects
    values = {e.name: e.value for e in effect.parameters} | {k: float(v) for k, v in effect.choices}
    size = effect.parameters[0]
    rivals = tuple(other.name for other in others)
    return Finding(effect.name, found.grade, values, (size.low, size.high), size.name, rivals)


def _left(answer: Explanation) -> str:
    """Why nothing more is said, in words."""
    why = " ".join(found.why for found in answer.findings)
    return why or f"{answer.remains.times_noise:.1f} times the noise is left, and no effect of the library lessens it."


def _in_draws(finding: Finding, drawn: Mapping[str, np.ndarray]) -> Finding:
    """The finding with values and interval of the joint draws, in which the common scale and the loads take part."""
    paths = {name: f"effects.{finding.effect}.{name}" for name in finding.values}
    values = {name: float(np.mean(drawn[path])) for name, path in paths.items() if path in drawn}
    low, high = np.quantile(drawn[paths[finding.size]], (0.025, 0.975))
    return dataclasses.replace(finding, values={**finding.values, **values}, interval=(float(low), float(high)))


def _headline(answer: Explanation, findings: Sequence[Finding]) -> str:
    if not findings:
        if answer.verdict == "nothing missing":
            return "The drawing, calibrated, explains the healthy records down to the noise."
        return f"Something remains that no effect of the library explains: {_left(answer)}"
    told = []
    for finding in findings:
        unit = _unit(finding)
        low, high = finding.interval
        name = " or ".join((finding.effect, *finding.rivals))
        told.append(f"{name} ({finding.values[finding.size]:.3g}{unit}, {low:.3g} to {high:.3g}; {finding.grade})")
    return f"The drawing lacks {' and '.join(told)}."


def _unit(finding: Finding) -> str:
    fields = {field.name: field.metadata for field in dataclasses.fields(EFFECTS[finding.effect])}
    unit = fields[finding.size]["unit"]
    return "" if unit == "-" else f" {unit}"


@dataclass(frozen=True)
class PhysicalFault:
    """A fault as physics finds it.

    Attributes
    ----------
    fault : str
        Name in the fault table, or the effect's own where the table lacks it.
    size, low, high : float
        As share of the fault's largest size, with its 95 % interval; the effect's own unit where the table lacks it.
    probability : float
        Among the hypotheses compared.
    grade : str
    station : int or None
    rivals : tuple of str
    """

    fault: str
    size: float
    low: float
    high: float
    probability: float
    grade: str
    station: int | None = None
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Physics:
    """What physics says of one or more turns.

    Attributes
    ----------
    verdict : str
        "healthy", "faulty" or "unknown".
    faults : tuple of PhysicalFault
    level, before : float
        rms of the residual on held-out turns over the noise, with what was found and with nothing.
    sentence : str
    """

    verdict: str
    faults: tuple[PhysicalFault, ...]
    level: float
    before: float
    sentence: str


def checked(records: Sequence[Record], machine: Machine, sensor: Sensor) -> Experiments:
    """The records as experiments of this machine, the second half of each held out; raises a sentence where they are
    none. Their start angles must be known."""
    halves = [half for record in records for half in _halves(record, machine)]
    return experiments(halves, machine, sensor)


def _halves(record: Record, machine: Machine) -> tuple[Record, Record]:
    """The two halves of a record; the second begins at a later cam angle."""
    signal, told = record.signal, record.conditions
    assert told.start_angle is not None, "found by comparison where it was not stated"
    step = machine.reduction * told.motor_speed / signal.sample_rate
    begins = cut([len(signal.values)], [step], [told.start_angle]).first
    # in front of a window of the fit, so that both halves hold as many whole ones as there are
    middle = int(begins[len(begins) // 2]) - 1 if len(begins) > 1 else len(signal.values) // 2
    later = told.start_angle + machine.reduction * told.motor_speed * middle / signal.sample_rate
    parts = []
    for values, start, held in (
        (signal.values[:middle], told.start_angle, False),
        (signal.values[middle:], later, True),
    ):
        part = Signal(values, signal.sample_rate, unit=signal.unit, source=record.name)
        conditions = dataclasses.replace(told, start_angle=start, held_out=held, pulse_angle=None)
        parts.append(Record(record.name, part, conditions))
    return parts[0], parts[1]


def explained(
    given: Experiments, machine: Machine, sensor: Sensor, found: Sequence[Mapping[str, Any]],
    spread: Mapping[str, float], faults: Sequence[Fault],
) -> Physics:  # fmt: skip
    """Faults of the table as hypotheses about turns, from the twin's machine with its posterior as prior.

    Parameters
    ----------
    given : Experiments
    machine, sensor : Machine, Sensor
        Of the twin, with what was found when it was made.
    found : sequence of mapping
        The effects found then: effect, values. Those whose growth is a fault are free.
    spread : mapping
        Relative standard deviation of each of the machine's parameters [-].
    faults : sequence of Fault
        The table.
    """
    wanted = {fault.effect for fault in faults}
    without = tuple(name for name in EFFECTS if name not in wanted)
    grown = [row for row in found if row["effect"] in wanted and isinstance(_made(row), MachineEffect)]
    names = {row["effect"] for row in grown}
    plain = dataclasses.replace(machine, effects=tuple(e for e in machine.effects if e.name not in names))
    known = tuple(_free(plain, row, without) for row in grown)
    told = {"sensor": sensor, "uncertainty": dict(spread), "known": known, "without": without}
    model, held = (IndexerModel(plain, part, **told) for part in (given.fitted, given.held_out))
    answer = explain(model, held)
    table = by_effect(faults)
    best = _accepted(answer)
    found_faults = [_as_fault(found, table.get(found.effects[0].name), machine) for found in _told(answer, best)]
    found_faults += [f for f in (_grown(answer, row, table[row["effect"]], machine) for row in grown) if f is not None]
    verdict = "healthy" if answer.verdict == "nothing missing" else "unknown"
    if any(fault.grade in NAMED for fault in found_faults):
        verdict = "faulty"
    level = answer.held[best.name].level(held)
    return Physics(verdict, tuple(found_faults), level, answer.before, _left(answer))


def _made(row: Mapping[str, Any]) -> Any:
    return make_effect(row["effect"], dict(row["values"]))


def _free(machine: Machine, row: Mapping[str, Any], without: Sequence[str]) -> Hypothesis:
    """An effect that the machine has, its parameters free about what they were."""
    seen = Seen(measures(machine, REFERENCE_MOTOR_SPEED), 1000.0)
    hypothesis = library(machine, tuple(without), seen)[row["effect"]][0]
    fixed = {name: row["values"][name] for name in hypothesis.fixed}

    def about(p: Parameter) -> Parameter:
        value = float(row["values"][p.name.removeprefix(f"{hypothesis.name}.")])
        return dataclasses.replace(
            p,
            nominal=min(max(value, p.low), p.high),
            known=True,
            scale=max(_FROM_DAY_TO_DAY * abs(value), p.scale / 20.0),
        )

    return Hypothesis(hypothesis.name, tuple(about(p) for p in hypothesis.parameters), fixed, ((),))


def _as_fault(found: Found, fault: Fault | None, machine: Machine) -> PhysicalFault:
    finding = _finding(found)
    station = finding.values.get("station")
    value, (low, high) = finding.values[finding.size], finding.interval
    if fault is not None:
        value, low, high = (fault.share(number, machine) for number in (value, low, high))
    return PhysicalFault(
        fault.name if fault else finding.effect, value, low, high, found.probability, found.grade,
        None if station is None else int(station), finding.rivals,
    )  # fmt: skip


def _grown(answer: Explanation, row: Mapping[str, Any], fault: Fault, machine: Machine) -> PhysicalFault | None:
    """The growth of an effect that the machine had when it was healthy; None where its interval holds what it was."""
    name = f"{fault.effect}.{fault.parameter}"
    now = next((e for e in answer.calibration.estimates if e.name == name), None)
    before = float(row["values"][fault.parameter])
    if now is None or now.low <= before <= now.high:
        return None
    size, low, high = (fault.share(number - before, machine) for number in (now.value, now.low, now.high))
    return PhysicalFault(fault.name, size, low, high, 0.95, ESTABLISHED)
