"""Values that differ from record to record, as records of different days do: which parameters, and what they came to.

Each record fitted, and each record held out, has its own value of such a parameter, known beforehand to the uncertainty
stated. On a record held out it is fitted before anything is compared, to the model as it came as well as to the one
with effects: an effect that does no more than such a value can do closes nothing there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.drives.description import Drive
from discrepancy.model import Hypothesis, Parameter
from indexer_env.checks import did_you_mean
from indexer_env.errors import refuse

OFFSET = "offset"
"""Name of the offset of each record's force, where no parameter of the drive has it."""

_ZEROED = 0.02
"""Standard deviation of that offset over the rms of the force."""


@dataclass(frozen=True, eq=False)
class Slots:
    """Where the values of a model's own numbers stand among its parameters, record by record.

    Attributes
    ----------
    every : tuple of Parameter
        The drive's own, those of known effects, then the offset where each record has one.
    parameters : tuple of Parameter
        Of the fit: those that all records share, then those of single records.
    at : ndarray (records, slots) of int
        Place of each slot in `parameters`.
    """

    every: tuple[Parameter, ...]
    parameters: tuple[Parameter, ...]
    at: np.ndarray

    def values(self, record: int, point: np.ndarray, hypothesis: Hypothesis) -> list[float]:
        """Values of all slots on a record, then of a hypothesis's parameters, at a global point."""
        parameters = self.parameters + hypothesis.parameters
        places = (*self.at[record].tolist(), *range(len(self.parameters), len(parameters)))
        return [parameters[i].value(float(point[i])) for i in places]

    @property
    def differing(self) -> tuple[int, ...]:
        """Slots of which each record has its own."""
        return tuple(k for k, i in enumerate(self.at[0].tolist()) if self.parameters[i].of_record)

    def by_record(self, point: np.ndarray) -> dict[str, list[float]]:
        """Values of the slots that differ, by name, one for each record."""
        return {
            self.every[k].name: [self.parameters[i].value(float(point[i])) for i in self.at[:, k].tolist()]
            for k in self.differing
        }

    def typical(self, point: np.ndarray) -> dict[str, float]:
        """Values of all slots by name; where records differ, the mean of theirs."""
        return {
            slot.name: float(np.mean([self.parameters[i].value(float(point[i])) for i in set(self.at[:, k].tolist())]))
            for k, slot in enumerate(self.every)
        }


def slots_of(drive: Drive, known: Sequence[Hypothesis], records: int, offset: Parameter | None) -> Slots:
    """The slots of a model of so many records; `offset` is what a record's force may be off by, if it may."""
    every = (*drive.parameters, *(p for one in known for p in one.parameters), *((offset,) if offset else ()))
    shared = [k for k, p in enumerate(every) if p.name not in drive.sessions]
    own = [k for k, p in enumerate(every) if p.name in drive.sessions]
    parameters = [every[k] for k in shared]
    at = np.zeros((records, len(every)), dtype=np.int64)
    at[:, shared] = np.arange(len(shared))
    for record in range(records):
        at[record, own] = len(parameters) + np.arange(len(own))
        parameters += [
            dataclasses.replace(every[k], name=f"record {record + 1}.{every[k].name}", record=record) for k in own
        ]
    return Slots(every, tuple(parameters), at)


def zeroed(drive: Drive, force: float, unit: str) -> Parameter | None:
    """The offset of a record's force of this rms; None where records are not said to have one."""
    if OFFSET not in drive.sessions or OFFSET in (p.name for p in drive.parameters):
        return None
    return Parameter(OFFSET, unit, 0.0, _ZEROED * force, known=True)


def check_sessions(drive: Drive, known: Sequence[Hypothesis]) -> None:
    """Refuse a name in `sessions` that is no parameter of the drive nor of an effect that it has from the start."""
    offset = () if drive.forward else (OFFSET,)
    names = (*offset, *(p.name for p in drive.parameters), *(p.name for one in known for p in one.parameters))
    for name in drive.sessions:
        if name not in names:
            hint = did_you_mean(name, names) or f"they are {', '.join(names)}"
            raise refuse(drive.path.name, "sessions", "names of parameters that differ between records", name, hint)


def told(slots: Slots, point: np.ndarray, names: Sequence[str]) -> tuple[str, ...]:
    """What the records' own values came to, a sentence for each parameter."""
    found = []
    for k, values in zip(slots.differing, slots.by_record(point).values(), strict=True):
        each = ", ".join(f"{value:.4g} ({name})" for value, name in zip(values, names, strict=True))
        found.append(f"{slots.every[k].name} of each record [{slots.every[k].unit}]: {each}.")
    return tuple(found)


def stated(slots: Slots, point: np.ndarray, names: Sequence[str]) -> Mapping[str, Mapping[str, float]]:
    """The same as numbers: by record, then by parameter; the nominal machine has one value for all."""
    own = slots.by_record(point) if np.any(point[slots.at[:, list(slots.differing)]]) else {}
    return {name: {key: values[k] for key, values in own.items()} for k, name in enumerate(names)} if own else {}
