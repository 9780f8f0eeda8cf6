"""Faults by physics: `discrepancy` with the twin's machine and what is known of it, the fault table as hypotheses."""

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
from discrepancy.indexer.library import HOUSING
from discrepancy.indexer.windows import cut
from discrepancy.records.experiments import Experiments, experiments
from discrepancy.records.likeness import INSIST
from discrepancy.records.reading import Record
from indexer_env.effects import EFFECTS
from indexer_env.errors import SignalError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from twin.calibrate import CRITERIA, SD_OF_95, accepted, finding_of, left, told
from twin.diagnosis import FaultSeen
from twin.faults import Fault, by_effect
from twin.freed import freed, of_machine
from twin.measured import FINEST, Measured, measured, suggested
from twin.nuisance import Nuisance

_SMALL = dataclasses.replace(CRITERIA, span=None)
"""At its smallest size, where an alarm is raised 95 times in 100, a fault is known within a factor of three."""


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
    measured : tuple of Measured
        Faults that the networks think possible and physics does not find, as it measures them beside those that it
        found; of an effect that the healthy machine had, how much more there is.
    """

    verdict: str
    faults: tuple[PhysicalFault, ...]
    level: float
    before: float
    sentence: str
    measured: tuple[Measured, ...] = ()

    def without_stations(self) -> Physics:
        """The same of turns whose stations were found by comparison, which tells no number of one."""
        return dataclasses.replace(self, faults=tuple(dataclasses.replace(f, station=None) for f in self.faults))


def checked(records: Sequence[Record], machine: Machine, sensor: Sensor) -> Experiments:
    """The records as experiments of this machine, the second half of each held out; raises a sentence where they are
    none. Their start angles must be known."""
    halves = [half for record in records for half in _halves(record, machine)]
    try:
        return experiments(halves, machine, sensor)
    except SignalError as error:
        raise SignalError(str(error).replace(INSIST, "")) from None


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
    draws: Mapping[str, np.ndarray], load_factor: float, faults: Sequence[Fault], suspected: Sequence[FaultSeen] = (),
) -> Physics:  # fmt: skip
    """Faults of the table as hypotheses about turns, from the twin's machine with its posterior as prior.

    Parameters
    ----------
    given : Experiments
    machine, sensor : Machine, Sensor
        Of the twin, with what was found when it was made.
    found : sequence of mapping
        The effects found then: effect, values. Those whose growth is a fault are free.
    draws : mapping
        Joint draws (n,) of its posterior, by path.
    load_factor : float
        By which the loads have been multiplied.
    faults : sequence of Fault
        The table.
    suspected : sequence of FaultSeen
        Faults that the networks think possible.
    """
    wanted = {fault.effect for fault in faults}
    without = tuple(name for name in EFFECTS if name not in wanted)
    grown = [row for row in found if row["effect"] in wanted and of_machine(row)]
    plain, known = freed(machine, grown, without)
    # those of the sensor are as they were found
    free = [HOUSING, *(row["effect"] for row in found if row in grown or not of_machine(row))]
    together = Nuisance.of_draws(_told(draws, free)).together(load_factor)
    given_model = {"sensor": sensor, "together": together, "known": known, "without": without}
    model, held = (IndexerModel(plain, part, **given_model) for part in (given.fitted, given.held_out))
    by_name = {fault.name: fault for fault in faults}
    likely = [seen for seen in suspected if seen.probability > 0.5]
    answer = explain(model, held, _SMALL, suggest=lambda fits: suggested(fits, likely, by_name, machine))
    table = by_effect(faults)
    changes = [c for c in (_change(answer, row, table[row["effect"]], machine) for row in grown) if c is not None]
    more = [fault for fault in map(_grown, changes) if fault is not None]
    # beside what has a name nothing is told that only stands in
    best = answer.accepted if more else accepted(answer)
    found_faults = [_as_fault(found, table.get(found.effects[0].name), machine) for found in told(answer, best)] + more
    verdict = "healthy" if answer.verdict == "nothing missing" else "unknown"
    if any(fault.grade in NAMED for fault in found_faults):
        verdict = "faulty"
    level = answer.held[best.name].level(held)
    named = {one.fault for one in found_faults}
    looked = [one for one in suspected if one.name not in named]
    asked = {one.name for one in looked}
    beside = (*measured(answer, looked, by_name, machine), *(c for c in changes if c.fault in asked))
    return Physics(verdict, tuple(found_faults), level, answer.before, left(answer), beside)


def _told(draws: Mapping[str, np.ndarray], free: Sequence[str]) -> dict[str, np.ndarray]:
    """Draws of all but some numbers of the machine and all numbers of some effects."""
    starts = tuple(f"machine.{name}" for name in free) + tuple(f"effects.{name}." for name in free)
    return {path: column for path, column in draws.items() if not path.startswith(starts)}


def _as_fault(found: Found, fault: Fault | None, machine: Machine) -> PhysicalFault:
    finding = finding_of(found)
    station = finding.values.get("station")
    value, (low, high) = finding.values[finding.size], finding.interval
    if fault is not None:
        value, low, high = (fault.share(number - fault.before, machine) for number in (value, low, high))
    return PhysicalFault(
        fault.name if fault else finding.effect, value, low, high, found.probability, found.grade,
        None if station is None else int(station), finding.rivals,
    )  # fmt: skip


def _change(answer: Explanation, row: Mapping[str, Any], fault: Fault, machine: Machine) -> Measured | None:
    """How much more there is of an effect that the machine had when it was healthy, as far as there can be; None where
    it was not fitted."""
    name = f"{fault.effect}.{fault.parameter}"
    now = next((e for e in answer.calibration.estimates if e.name == name), None)
    if now is None:
        return None
    before, (least, most) = float(row["values"][fault.parameter]), row["interval"]
    # two independent estimates
    half = math.hypot(0.5 * (now.high - now.low), 0.5 * (most - least))
    grown = now.value - before
    size, low, high = (
        fault.possible(fault.share(change, machine)) for change in (grown, grown - half, grown + half)
    )  # fmt: skip
    fall = (size / max(fault.share(2.0 * half, machine) / SD_OF_95, FINEST)) ** 2
    return Measured(fault.name, size, low, high, fall)


def _grown(change: Measured) -> PhysicalFault | None:
    """A change as a fault; None where its 95 % interval holds nothing, or where there is less of what can only grow."""
    if change.low <= change.nothing <= change.high:
        return None
    return PhysicalFault(change.fault, change.size, change.low, change.high, 0.95, ESTABLISHED)
