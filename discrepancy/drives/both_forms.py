"""What both forms of a drive have in common, as models and as subjects."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.drives.channels import Record
from discrepancy.drives.description import Drive
from discrepancy.drives.second_look import machine_yaml
from discrepancy.drives.sessions import Slots, told
from discrepancy.model import Hypothesis, Model
from discrepancy.place import Point
from discrepancy.subjects.base import Axis, Subject, binned, told_apart
from indexer_cli.words import joined
from indexer_env.checks import check_choice
from indexer_env.effects.sensor import SensorLowpass

_CELLS = 8

_LATE = {"delay", "loop_lag", SensorLowpass.name}
"""Effects of which each can stand for a command that is held between samples."""

_CHANGES, _ALWAYS = 50, 0.9
"""Least changes of a row, and the share of equally long pieces between them, by which it is one that is held."""

_HALF = (0.35, 0.65)
"""Samples between which a lateness counts as half of one."""


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


def said_of_offsets(records: Sequence[Record]) -> tuple[str, ...]:
    """What was taken off measured speeds and accelerations, a sentence for each role."""
    found = []
    for role in dict.fromkeys(role for record in records for role in record.offsets):
        told = [f"{r.offsets[role]:.3g} {r.units[role]} ({r.name})" for r in records if role in r.offsets]
        found.append(
            f"The measured {role} is {joined(told)} above what the rest of the motion says on average; this was "
            "subtracted."
        )
    return tuple(found)


def said_of_slow_channels(records: Sequence[Record]) -> tuple[str, ...]:
    """A sentence for each channel that is written down more often than it is measured: it is late by up to a value's
    length, as something that delays or filters would make it."""
    found: dict[tuple[str, int], list[Record]] = {}
    for record in records:
        for role, row in record.rows.items():
            if (each := _stays(row)) > 1:
                found.setdefault((role, each), []).append(record)
    return tuple(
        f"The channel {role} keeps each value for {each} samples ({joined([r.name for r in those])}): it is measured "
        f"at {those[0].rate / each:.4g} Hz, and what comes late looks like a delay or a low-pass; leave one row in "
        f"{each}."
        for (role, each), those in found.items()
    )


def _stays(row: np.ndarray) -> int:
    """For how many samples a row keeps each of its values, where it is one number of them nearly always; else 1."""
    lengths = np.diff(np.flatnonzero(np.diff(row) != 0.0))
    if len(lengths) < _CHANGES:
        return 1
    each = int(np.median(lengths))
    return each if each > 1 and float(np.mean(lengths == each)) >= _ALWAYS else 1


def check_held(drive: Drive, commands: Sequence[str]) -> None:
    """Refuse a name in `held` that is no channel which could be a command."""
    for name in drive.held:
        check_choice(drive.path.name, "held", name, commands)


def said_of_holding(drive: Drive, commands: Sequence[str], rates: Sequence[float], place: Point) -> tuple[str, ...]:
    """Whether what makes a fitted place late does so by half a sample, as a command does that is held."""
    free = [name for name in commands if name not in drive.held]
    values = {p.name: v for p, v in zip(place.hypothesis.parameters, place.values, strict=True)}
    found = []
    for one in place.hypothesis.effects if free else ():
        name, late = one.name, values[one.parameters[0].name]
        if name in _LATE and any(_HALF[0] < late * rate < _HALF[1] for rate in rates):
            found.append(
                f"{name} {late:.3g} s is half a sample: a command that is held between samples looks like this; if "
                f"{joined(free, 'or')} is held, write held = {(*drive.held, free[0])} into {drive.path.name}."
            )
    return tuple(found)


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
    """A drive in one of its forms as a subject, its models of the class `DriveModel`.

    Attributes
    ----------
    drive : Drive
    commands : tuple of str
        Roles of channels that may be held between samples.
    rates : tuple of float
        Of the records [Hz].
    """

    drive: Drive
    commands: tuple[str, ...]
    rates: tuple[float, ...]

    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        assert isinstance(model, DriveModel)
        return {"machine.yaml": machine_yaml(self.drive, model.slots, model.known, place, model.names)}

    def of_records(self, model: Model, place: Point) -> tuple[str, ...]:
        assert isinstance(model, DriveModel)
        # a delay and a loop's lag act on the first input alone
        late = said_of_holding(self.drive, self.commands[:1], self.rates, place)
        return (*told(model.slots, place.z, model.names), *late)

    def meaning(self, effect: str) -> str:
        return next(e for e in self.drive.effects if e.name == effect).sentence


def axis_of(name: str, values: np.ndarray, whole: np.ndarray, unit: str, inside: np.ndarray) -> Axis:
    """Values (w, n) in even cells over the range of `whole`, named by their middles; those of time by their beginnings,
    as sentences say from when on."""
    edges = np.linspace(float(whole.min()), float(whole.max()), _CELLS + 1)
    share = 0.0 if name == "time" else 0.5
    places = [low + share * (high - low) for low, high in itertools.pairwise(edges.tolist())]
    return Axis(name, told_apart(places, unit), binned(values, edges, inside))
