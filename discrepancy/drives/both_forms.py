"""What both forms of a drive have in common, as models and as subjects."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.drives.description import Drive
from discrepancy.drives.second_look import machine_yaml
from discrepancy.drives.sessions import Slots, told
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.subjects.base import Axis, Subject, binned, told_apart

_CELLS = 8


def adrift(drive: Drive, position: str, records: int) -> bool:
    """Whether a position means something else in each of so many records, as none of them measures it."""
    return records > 1 and position not in drive.channels


def said_of_places(drive: Drive, positions: Sequence[str], records: int) -> tuple[str, ...]:
    """What is assumed of positions that are not measured, a sentence each."""
    each = "each" if records > 1 else "the"
    more = ", so that effects over it are not looked for" if records > 1 else ""
    return tuple(
        f"The position {position} is added up from the speed and is 0 at {each} record's first sample{more}."
        for position in positions
        if position not in drive.channels
    )


class DriveModel(Model):
    """A drive with records.

    Attributes
    ----------
    names : tuple of str
        Of the records in its windows.
    known : tuple of Hypothesis
        Effects that it has already.
    slots : Slots
    own : int
        How many parameters the drive's file has.
    """

    names: tuple[str, ...]
    known: tuple[Hypothesis, ...]
    slots: Slots
    own: int

    def _present(self, hypothesis: Hypothesis, values: Sequence[float]) -> list[tuple[Hypothesis, tuple[float, ...]]]:
        """All effects, those known first, with their values out of those of all slots and of the hypothesis."""
        at, found = self.own, []
        for one in self.known:
            found.append((one, tuple(values[at : at + len(one.parameters)])))
            at += len(one.parameters)
        for k, one in enumerate(hypothesis.effects):
            places = len(self.slots.every) + hypothesis.places(k)
            found.append((one, tuple(values[i] for i in places)))
        return found


class FormSubject(Subject):
    """A drive in one of its forms as a subject, its models of the class `DriveModel`."""

    drive: Drive

    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        assert isinstance(model, DriveModel)
        return {"machine.yaml": machine_yaml(self.drive, model.slots, model.known, place, model.names)}

    def of_records(self, model: Model, place: Point) -> tuple[str, ...]:
        assert isinstance(model, DriveModel)
        return told(model.slots, place.z, model.names)

    def meaning(self, effect: str) -> str:
        return next(e for e in self.drive.effects if e.name == effect).sentence


def axis_of(name: str, values: np.ndarray, whole: np.ndarray, unit: str, inside: np.ndarray) -> Axis:
    """Values (w, n) in even cells over the range of `whole`, named by their middles; those of time by their beginnings,
    as sentences say from when on."""
    edges = np.linspace(float(whole.min()), float(whole.max()), _CELLS + 1)
    share = 0.0 if name == "time" else 0.5
    places = [low + share * (high - low) for low, high in itertools.pairwise(edges.tolist())]
    return Axis(name, told_apart(places, unit), binned(values, edges, inside))
