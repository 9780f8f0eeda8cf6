"""A drive in its forward form as a subject."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from discrepancy.drives.both_forms import (
    FormSubject,
    adrift,
    axis_of,
    check_held,
    said_of_offsets,
    said_of_places,
    said_of_slow_channels,
)
from discrepancy.drives.channels import Record
from discrepancy.drives.compiled_rates import integrable
from discrepancy.drives.course import Course, courses_of, window_length
from discrepancy.drives.description import Drive
from discrepancy.drives.effects import TABLES
from discrepancy.drives.effects.friction import LOAD_FRICTION
from discrepancy.drives.effects.tabulated import OVER
from discrepancy.drives.forward import ForwardModel
from discrepancy.drives.library import forms_of
from discrepancy.drives.second_look import known_effects
from discrepancy.drives.sessions import check_sessions
from discrepancy.drives.unplaced import check_unplaced_rates
from discrepancy.drives.windows import Windows, split
from discrepancy.form import Form
from discrepancy.locate.statistics import CHANNEL
from discrepancy.model import NONE, Model
from discrepancy.subjects.base import Axis, Measurement, View
from indexer_cli.words import joined
from indexer_env.errors import ParameterError

_SIZES = (0.5, 2.0)
"""Of the measured input, for motions that could be asked for next."""

_RAISED = 100.0
"""Noise of imagined records over the real one: a window's loss bounds residuals, which here are whole motions."""


class ForwardSubject(FormSubject):
    """A drive in its forward form.

    Parameters
    ----------
    drive : Drive
    model, held_out : ForwardModel
    roles : sequence of str
        Of the measured channels.
    unit : str
        Of the first of them.
    notes : tuple of str
    """

    model: ForwardModel
    held_out: ForwardModel

    def __init__(
        self, drive: Drive, model: ForwardModel, held_out: ForwardModel, roles: Sequence[str], unit: str,
        notes: tuple[str, ...],
    ) -> None:  # fmt: skip
        self.drive, self.model, self.held_out, self.roles, self.unit = drive, model, held_out, tuple(roles), unit
        self.notes, self.kind = notes, f"drive ({drive.name})"
        self.commands, self.rates = model.courses[0].inputs, tuple(course.rate for course in model.courses)

    def view(self, model: Model) -> View:
        assert isinstance(model, ForwardModel)
        windows, channels = model.windows, model.channels
        joint = self.drive.joints[0]
        q, v = (self.drive.states.index(s) for s in (joint.position, joint.speed))
        rows: dict[str, list[np.ndarray]] = {"q": [], "v": [], "t": [], "y": [], "c": []}
        for k, first, count in zip(windows.track, windows.first, windows.count, strict=True):
            course, part = model.courses[k], slice(first, first + count)
            rows["q"].append(np.tile(course.states[part, q], channels))
            rows["v"].append(np.tile(course.states[part, v], channels))
            rows["t"].append(np.tile(np.arange(first, first + count) / course.rate, channels))
            # all channels in the noise of the first, which the view has one number for
            rows["y"].append((course.rows[:, part] * (course.noise[0] / course.noise)[:, None]).reshape(-1))
            rows["c"].append(np.repeat(np.arange(channels), count))
        inside = np.arange(int(model.counts.max())) < model.counts[:, None]
        over = {name: _filled(parts, inside) for name, parts in rows.items()}
        scales = model.scales[0]
        backwards = np.where(inside, (over["v"] < 0.0).astype(int), -1)
        axes = [Axis("direction", ("forwards", "backwards"), backwards)]
        for name, values, unit in (
            ("position", over["q"], scales.unit("Q")),
            ("speed", np.abs(over["v"]), scales.unit("V")),
            ("time", over["t"], "s"),
        ):
            axes.append(axis_of(name, values, values[inside], unit, inside))
        if channels > 1:
            axes.append(Axis(CHANNEL, self.roles, np.where(inside, over["c"].astype(int), -1)))
        courses = [model.courses[k] for k in windows.tracks]
        return View(
            names=tuple(c.name for c in courses), unit=self.unit, groups=model.groups, inside=inside, time=over["t"],
            measured=over["y"], noise=np.array([c.noise[0] for c in courses]), estimated=tuple(False for _ in courses),
            axes=tuple(axes), map_axes=("speed", "position"),
        )  # fmt: skip

    def forms(self) -> tuple[Form, ...]:
        """At the first joint."""
        joint, windows = self.drive.joints[0], self.model.windows
        states = np.concatenate([
            self.model.courses[k].states[first : first + count]
            for k, first, count in zip(windows.track, windows.first, windows.count, strict=True)
        ])  # fmt: skip
        at = {"speed": joint.speed, "position": joint.position}
        rows = {variable: states[:, self.drive.states.index(state)] for variable, state in at.items()}
        lost = adrift(self.drive, joint.position, len(self.model.courses))
        passed = {
            name: [rows[v] for v in OVER[name]]
            for name, table in TABLES.items()
            if not table.load and not (table.placed and lost)
        }
        return forms_of(self.model.scales[0], passed, self.model.known)

    def measurements(self, model: Model) -> tuple[Measurement, ...]:
        assert isinstance(model, ForwardModel)
        base, found = model, []
        longest = max((base.courses[k] for k in base.windows.tracks), key=lambda c: len(c.u))
        whole = base.windows
        mine = base.windows.track == base.courses.index(longest)
        whole = Windows(np.zeros(int(mine.sum()), dtype=np.int64), whole.first[mine], whole.count[mine])
        for size in (1.0, *_SIZES) if longest.u.shape[1] else (1.0,):
            words = "the same motion again" if size == 1.0 else f"the same input, {size:g} times as large"
            course = _imagined(longest, size, self._middles(base))
            model = ForwardModel(
                self.drive, [course], whole, base.scales, base.measured, base.rates, base.known,
                base.hypotheses(), base.substeps,
            )  # fmt: skip
            found.append(Measurement(words, model, _RAISED))
        return tuple(found)

    def _middles(self, model: ForwardModel) -> np.ndarray:
        """About what each state moves (states,): a joint's position about the middle of its stroke, all else about
        zero."""
        middles = np.zeros(len(self.drive.states))
        for joint, scales in zip(self.drive.joints, model.scales, strict=True):
            middles[self.drive.states.index(joint.position)] = scales.middle
        return middles


def _imagined(course: Course, size: float, middles: np.ndarray) -> Course:
    """The record with its input and its motion about these middles of the states so many times as large, nothing read,
    and the noise raised."""
    return dataclasses.replace(
        course, rows=np.zeros_like(course.rows), noise=_RAISED * course.noise, u=size * course.u,
        states=middles + size * (course.states - middles),
    )  # fmt: skip


def _filled(parts: Sequence[np.ndarray], inside: np.ndarray) -> np.ndarray:
    out = np.zeros(inside.shape)
    for row, part in zip(out, parts, strict=True):
        row[: len(part)] = part
    return out


def forward_subject(drive: Drive, records: Sequence[Record], machine: Mapping[str, Any]) -> ForwardSubject:
    """The subject of a drive in its forward form and its records.

    Raises
    ------
    ParameterError, SignalError
    """
    courses, scales, measured = courses_of(drive, records)
    lengths, kept = [len(c.u) for c in courses], [r.held_out for r in records]
    seconds = window_length(drive, courses, scales)
    least = [max(1, round(seconds * c.rate)) for c in courses]
    fitted, held, parts = split(lengths, kept, drive.held_out, least, most=True)
    roles = [role for role in records[0].rows if role in drive.states or role == "a"]
    inputs = courses[0].inputs
    check_held(drive, inputs)
    nominal = np.array([p.nominal for p in drive.parameters])
    rates, fast = integrable(drive, inputs, courses[0].states[0], courses[0].u[0], nominal)
    model = ForwardModel(drive, courses, fitted, scales, measured, rates)
    if known := known_effects(drive, machine, model.hypotheses()):
        model = ForwardModel(drive, courses, fitted, scales, measured, rates, known, substeps=model.substeps)
    check_sessions(drive, model.known)
    check_unplaced_rates(model)
    other = ForwardModel(
        drive, courses, held, scales, measured, rates, model.known, model.hypotheses(), model.substeps
    )  # fmt: skip
    _check_parameters(model)
    notes = []
    if not fast:
        notes.append("rates could not be compiled, so every step calls Python: this takes a few hundred times longer.")
    notes += said_of_places(drive, [joint.position for joint in drive.joints], len(courses))
    notes += (*said_of_offsets(records), *said_of_slow_channels(records))
    if LOAD_FRICTION in {e.name for e in drive.effects} - {*model.hypotheses(), *(one.name for one in model.known)}:
        unit, forces = courses[0].input_unit or "none", joined(list(dict.fromkeys(s.force_unit for s in scales)), "or")
        notes.append(f"Not looked for, as the first input must be a force in {forces}, got {unit}: {LOAD_FRICTION}.")
    if drive.sessions:
        notes.append(f"Each record has its own: {', '.join(drive.sessions)}.")
    if parts:
        notes.append("No record was held out, so the last part of each is: other times, not other conditions.")
    if model.left_out:
        notes.append(f"Not looked for, as the forward form does not have them: {', '.join(model.left_out)}.")
    return ForwardSubject(drive, model, other, roles, records[0].units[roles[0]], tuple(notes))


def _check_parameters(model: ForwardModel) -> None:
    """Refuse a parameter that does nothing."""
    zero = np.zeros(len(model.parameters))
    good = model.simulated(NONE, model.jobs(zero))[1]
    if not good.any():
        rule = "must keep the states finite and in range from where the records begin"
        raise ParameterError(f"{model.drive.path.name}: rates {rule}, but every run is lost at the values stated.")
    at = model.residuals(NONE, model.jobs(zero))
    for p, places in zip(model.drive.parameters, model.slots.at.T, strict=False):
        moved = zero.copy()
        moved[places] = 0.1
        if float(np.abs(model.residuals(NONE, model.jobs(moved)) - at).max()) == 0.0:
            raise ParameterError(
                f"{model.drive.path.name}: the parameter {p.name} must change the motion on these records, but it does "
                "nothing; leave it out or use it."
            )
