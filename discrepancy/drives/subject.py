"""A drive as a subject: its force by direction, position, speed, acceleration and time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.drives.both_forms import FormSubject, adrift, axis_of
from discrepancy.drives.description import Drive
from discrepancy.drives.differing import differing, in_words
from discrepancy.drives.effects import TABLES
from discrepancy.drives.effects.tabulated import OVER, VARIABLES
from discrepancy.drives.inverse import InverseModel
from discrepancy.drives.library import forms_of
from discrepancy.drives.motions import imagined
from discrepancy.drives.track import Track
from discrepancy.drives.windows import Windows
from discrepancy.form import Form
from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.subjects.base import Axis, Line, Measurement, Torque, View

_MAINS = (50.0, 60.0, 100.0, 120.0)


class DriveSubject(FormSubject):
    """A drive in its inverse form.

    Parameters
    ----------
    drive : Drive
    model, held_out : InverseModel
    notes : tuple of str
    rates : sequence of float
        Of the records [Hz].
    """

    model: InverseModel
    held_out: InverseModel

    def __init__(
        self, drive: Drive, model: InverseModel, held_out: InverseModel, notes: tuple[str, ...], rates: Sequence[float]
    ) -> None:
        self.drive, self.model, self.held_out, self.notes = drive, model, held_out, notes
        self.kind, self.commands, self.rates = f"drive ({drive.name})", ("force",), tuple(rates)

    def view(self, model: Model) -> View:
        assert isinstance(model, InverseModel)
        windows, scales = model.windows, model.scales
        samples = np.arange(int(windows.count.max()))
        inside = samples < windows.count[:, None]
        at = np.where(inside, windows.first[:, None] + samples, 0)
        every = [self.model.tracks[k] for k in self.model.windows.tracks]

        def over(name: str) -> np.ndarray:
            rows = [getattr(t, name)[t.at] for t in model.tracks]
            return np.array([rows[k][i] for k, i in zip(windows.track, at, strict=True)])

        axes = [Axis("direction", ("forwards", "backwards", "at rest"), _direction(model, over("v"), inside))]
        columns = {"position": ("q", scales.unit("Q")), "speed": ("v", scales.unit("V")),
                   "acceleration": ("a", scales.unit("A"))}  # fmt: skip
        for name, (row, unit) in columns.items():
            whole = np.concatenate([getattr(t, row) for t in every])
            values, whole = (over(row), whole) if name != "speed" else (np.abs(over(row)), np.abs(whole))
            axes.append(axis_of(name, values, whole, unit, inside))
        force_over = {f"position [{scales.unit('Q')}]": over("q"), f"speed [{scales.unit('V')}]": over("v")}
        if scales.D:
            deflection = over("deflection")
            axes.append(axis_of("deflection", deflection, deflection[inside], scales.unit("D"), inside))
            force_over[f"deflection [{scales.unit('D')}]"] = deflection
        time = over("t")
        axes.append(axis_of("time", time, time[inside], "s", inside))
        records = [model.tracks[k] for k in windows.tracks]
        return View(
            names=tuple(t.name for t in records), unit=scales.force_unit, groups=model.groups, inside=inside, time=time,
            measured=np.array([np.where(i, model.measured[g][a], 0.0)
                               for g, a, i in zip(model.groups, at, inside, strict=True)]),
            noise=model.noise, estimated=tuple(False for _ in records), axes=tuple(axes),
            map_axes=("speed", "position"), lines=_lines(records), colour=np.array([t.colour for t in records]),
            torque=Torque(f"missing force [{scales.force_unit}]", 1.0, {**force_over, "time [s]": time}),
        )  # fmt: skip

    def of_records(self, model: Model, place: Point) -> tuple[str, ...]:
        assert isinstance(model, InverseModel)
        found, share = differing(model, place, Criteria())
        more = (in_words(found, share, self.drive, model.names),) if found else ()
        return (*super().of_records(model, place), *more)

    def forms(self) -> tuple[Form, ...]:
        tracks = [self.model.tracks[k] for k in self.model.windows.tracks]
        lost = adrift(self.drive, "q", len(self.model.tracks))
        seen = [
            name for name, table in TABLES.items()
            if (self.model.scales.D or not table.load) and not (table.placed and lost)
        ]  # fmt: skip
        passed = {
            name: [np.concatenate([VARIABLES[variable][3](t) for t in tracks]) for variable in OVER[name]]
            for name in seen
        }
        return forms_of(self.model.scales, passed, self.model.known)

    def measurements(self, model: Model) -> tuple[Measurement, ...]:
        assert isinstance(model, InverseModel)
        base = model
        longest = max((base.tracks[k] for k in base.windows.tracks), key=lambda t: len(t.t))
        found = []
        for words, track in imagined(longest):
            whole = Windows(np.array([0]), np.array([0]), np.array([len(track.measured)]))
            model = InverseModel(self.drive, [track], base.scales, whole, base.known, base.hypotheses())
            found.append(Measurement(words, model))
        return tuple(found)


def _direction(model: InverseModel, v: np.ndarray, inside: np.ndarray) -> np.ndarray:
    still = np.array([model.tracks[k].still for k in model.windows.track])[:, None]
    cells = np.where(np.abs(v) < still, 2, np.where(v > 0.0, 0, 1))
    return np.where(inside, cells, -1)


def _lines(records: list[Track]) -> tuple[Line, ...]:
    lowest = min(t.cutoff for t in records)
    return tuple(Line(f"{f:g} Hz", "fixed frequency", np.full(len(records), f)) for f in _MAINS if f < lowest)
