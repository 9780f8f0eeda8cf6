"""The forward form: how a drive moves, simulated from unknown start states.

    ẋ = rates(x, u, t; p) + effects at the joints,   residual = (x(t) - measured)/noise in every measured channel

A record is cut into windows; the state in which one starts is unknown but near to what the measured motion says, so
that its local parameters are deviations from that in units of its own uncertainty.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from discrepancy.drives.advance import WORK, integrator
from discrepancy.drives.both_forms import DriveModel
from discrepancy.drives.course import Course
from discrepancy.drives.description import Drive
from discrepancy.drives.effects import TABLES
from discrepancy.drives.forces import COLUMNS, CONTACT, INNER, PLAY, SOFT, SOFT_INVERSE_SQUARE, TABULATED_OVER
from discrepancy.drives.forward_library import LINE, library_of, lines_of, sized_by
from discrepancy.drives.library import tabulated_row, values_of
from discrepancy.drives.readings import SENSOR_LAG, commanded, lagging
from discrepancy.drives.scales import Scales
from discrepancy.drives.sessions import slots_of
from discrepancy.drives.windows import Windows
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis

LOST = 1e3
"""Residual of a run that is lost, in units of the noise."""

_ACCURACY = 0.05
"""Change of a residual, in units of the noise, by halving the step below which the step is fine enough."""

_MOST_SUBSTEPS = 32

_IN_PLAY = (-0.95, 0.0, 0.95)
"""Where a load behind play is looked for when a window starts, over half of the play."""

_RESOLVED = 2.0
"""Least time over a step in which a load on its spring goes through one radian."""


class ForwardModel(DriveModel):
    """A drive in its forward form with records.

    Parameters
    ----------
    drive : Drive
    courses : sequence of Course
    windows : Windows
    scales : sequence of Scales
        Of each joint.
    measured : ndarray (channels,) of int
        State of each channel, or -1 - j for the acceleration of joint j.
    rates : callable
        As the integrator takes it.
    known, library
        As of `InverseModel`.
    """

    def __init__(
        self, drive: Drive, courses: Sequence[Course], windows: Windows, scales: Sequence[Scales], measured: np.ndarray,
        rates: Any, known: tuple[Hypothesis, ...] = (), library: Mapping[str, tuple[Hypothesis, ...]] | None = None,
        substeps: int = 0,
    ) -> None:  # fmt: skip
        self.drive, self.courses, self.windows = drive, tuple(courses), windows
        self.scales: tuple[Scales, ...] = tuple(scales)
        self.measured, self.rates, self.known = measured, rates, known
        self.effects = {effect.name: effect for effect in drive.effects} | TABLES
        self.own = len(drive.parameters)
        self.slots = slots_of(drive, known, len(windows.tracks), None)
        self.parameters = self.slots.parameters
        self.channels = len(measured)
        self.counts, self.groups = windows.count * self.channels, windows.groups
        self.names = tuple(self.courses[k].name for k in windows.tracks)
        self.places = np.array(
            [[drive.states.index(j.position), drive.states.index(j.speed)] for j in drive.joints], dtype=np.int64
        )
        self.held = np.array([name in drive.held for name in self.courses[0].inputs], dtype=np.bool_)
        self._commands: dict[Any, np.ndarray] = {}
        self.readings_ = self._windowed([course.rows for course in self.courses])
        self.substeps = substeps or self._fine()
        self._library = library_of(self) if library is None else library

    def _windowed(self, rows: Sequence[np.ndarray]) -> np.ndarray:
        """Channels of every window, over their noise (w, channels, n)."""
        out = np.zeros((len(self.windows.count), self.channels, int(self.windows.count.max())))
        for w, (k, first, count) in enumerate(
            zip(self.windows.track, self.windows.first, self.windows.count, strict=True)
        ):
            out[w, :, :count] = rows[k][:, first : first + count] / self.courses[k].noise[:, None]
        return out

    # ------------------------------------------------------------------ simulation

    def simulated(self, hypothesis: Hypothesis, jobs: Jobs) -> tuple[np.ndarray, np.ndarray]:
        """Channels of each job over their noise (n, channels, samples), 0 beyond its end; and which are not lost."""
        size, most = len(jobs.point), int(self.windows.count.max())
        out, good = np.zeros((size, self.channels, most)), np.zeros(size, dtype=np.bool_)
        n, joints = len(self.drive.states), len(self.drive.joints)
        tracks, kept = self.windows.track[jobs.window], {}
        for k in np.unique(tracks).tolist():
            mine, course = np.flatnonzero(tracks == k), self.courses[k]
            record = self.windows.tracks.index(k)
            values = [self.slots.values(record, point, hypothesis) for point in jobs.points]
            set_up = [self._kept_set_up(kept, hypothesis, row) for row in values]
            at = jobs.window[mine]
            first, counts = self.windows.first[at], self.windows.count[at]
            starts = course.states[first] + course.spread * jobs.states[mine, :n]
            us = np.zeros((len(mine), most, course.u.shape[1]))
            for i, job in enumerate(mine):
                whole = self.command(k, set_up[jobs.point[job]][1])
                us[i, : counts[i]] = whole[first[i] : first[i] + counts[i]]
            rows = np.array([values[p][: self.own] for p in jobs.point[mine]])
            coefficients = np.array([set_up[p][0] for p in jobs.point[mine]])
            z_starts = self._inner_starts(hypothesis, jobs.states[mine, n:], coefficients)
            lags = [set_up[p][2] for p in jobs.point[mine]]
            found, fine = np.zeros((len(mine), self.channels, most)), np.zeros(len(mine), dtype=np.bool_)
            work = np.zeros((WORK, max(n + INNER * joints, course.u.shape[1])))
            scale = np.maximum(np.abs(course.states).max(axis=0), 1e-12)
            integrator()(
                self.rates, starts, z_starts, us, self.held, first / course.rate, counts, course.rate, self.substeps,
                rows, self.places, coefficients, self.measured, scale, work, found, fine)  # fmt: skip
            for row, lag in zip(found, lags, strict=True):
                if lag > 0.0:
                    row[:] = lagging(row, lag, 1.0 / course.rate)
            out[mine], good[mine] = found / course.noise[:, None], fine
        return out, good

    def _inner_starts(self, hypothesis: Hypothesis, states: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """What starts inside the joints (k, 5 joints), as `run_all` takes it, from scaled local parameters (k, l)."""
        joints = len(self.drive.joints)
        starts = np.zeros((len(states), (1 + INNER) * joints))
        loads = starts[:, joints:].reshape(len(states), joints, INNER)
        speed = np.array([scales.V for scales in self.scales])
        at = 0
        if self._has(hypothesis, "play"):
            mine = states[:, : 2 * joints].reshape(-1, joints, 2)
            loads[:, :, 2] = 0.5 * np.clip(mine[:, :, 0], -1.0, 1.0) * coefficients[:, :, PLAY]
            loads[:, :, 3] = mine[:, :, 1] * speed
            at = 2 * joints
        if self._has(hypothesis, "presliding"):
            starts[:, :joints] = np.clip(states[:, at : at + joints], -1.0, 1.0)
            at += joints
        if self._has(hypothesis, "soft"):
            slowness = np.sqrt(coefficients[:, :, SOFT_INVERSE_SQUARE])
            mine = states[:, at : at + 2 * joints].reshape(-1, joints, 2)
            loads[:, :, 0], loads[:, :, 1] = mine[:, :, 0] * speed * slowness, mine[:, :, 1] * speed
        return starts

    def _has(self, hypothesis: Hypothesis, forward: str) -> bool:
        return any(self.effects[one.name].forward == forward for one in (*self.known, *hypothesis.effects))

    def _kept_set_up(self, kept: dict, hypothesis: Hypothesis, values: list[float]) -> tuple:
        key = tuple(values)
        if key not in kept:
            kept[key] = self.set_up(hypothesis, values)
        return kept[key]

    def set_up(self, hypothesis: Hypothesis, values: Sequence[float]) -> tuple[np.ndarray, tuple, float]:
        """Coefficients of the joints (joints, k), what is done to the command, and how far the sensors lag [s]."""
        p = self.drive.p(values[: self.own])
        table = np.zeros((len(self.drive.joints), len(COLUMNS)))
        at = {name: k for k, name in enumerate(COLUMNS)}
        for j, (joint, scales) in enumerate(zip(self.drive.joints, self.scales, strict=True)):
            mass = getattr(p, joint.inertia) if isinstance(joint.inertia, str) else joint.inertia
            table[j, at["mass"]], table[j, at["middle"]], table[j, at["stroke"]] = mass, scales.middle, scales.Q
        command, lag = [], 0.0
        for one, mine in self._present(hypothesis, values):
            effect = self.effects[one.name]
            if effect.forward == SENSOR_LAG:
                lag += mine[0]
                continue
            if effect.acts == "reading":
                command.append((effect.forward, *mine))
                continue
            j = int(one.fixed.get("joint", 0))
            own = values_of(one, mine)
            if effect.forward == "tabulated":
                table[j, TABULATED_OVER:] = tabulated_row(one.name, own)
                continue
            size, *shape = _columns(effect.forward)
            named = [getattr(own, s.name) for s in effect.sizes] + [
                float(v) for k, v in one.fixed.items() if k != "joint"
            ]
            if effect.forward == "ripple":
                named = [named[0], named[2], named[1]]
            for column, value in zip((size, *shape), named, strict=True):
                table[j, at[column]] = value
        slowest = min(course.rate for course in self.courses) * self.substeps
        table[:, CONTACT] = slowest / _RESOLVED
        # a load that swings faster than the steps resolve moves with its joint
        swing = np.sqrt(np.maximum(table[:, SOFT_INVERSE_SQUARE], 1e-300) * (1.0 - table[:, SOFT]))
        table[swing * slowest < _RESOLVED, SOFT] = 0.0
        return table, tuple(command), lag

    def command(self, k: int, done: tuple) -> np.ndarray:
        """Inputs (n, inputs) of a record as they act: the first through what is done to it."""
        if not done:
            return self.courses[k].u
        if (k, done) not in self._commands:
            if len(self._commands) > 256:
                self._commands.clear()
            course = self.courses[k]
            first = course.u[:, 0]
            for name, *values in done:
                first = commanded(name, first, values, 1.0 / course.rate)
            self._commands[k, done] = np.column_stack([first, course.u[:, 1:]])
        return self._commands[k, done]

    # ------------------------------------------------------------------ as a Model

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library; what a fit has left, residuals (w, n), proposes the frequencies of lines, and sizes."""
        if residual is None:
            return self._library
        found = dict(self._library)
        if LINE in found:
            found[LINE] = lines_of(self, residual)
        return sized_by(self, found, residual)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Effects that are not tried, as the integrator does not have them."""
        return tuple(effect.name for effect in self.drive.effects if not effect.forward)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        found, good = self.simulated(hypothesis, jobs)
        left = found - self.readings_[jobs.window]
        left[~good] = LOST
        return self._flat(left, jobs.window)

    def _flat(self, rows: np.ndarray, window: np.ndarray) -> np.ndarray:
        """(k, channels, n) as (k, channels·n), a window's channels one after the other, 0 beyond its end."""
        out = np.zeros((len(rows), int(self.counts.max())))
        for i, w in enumerate(window):
            count = self.windows.count[w]
            out[i, : self.counts[w]] = rows[i, :, :count].reshape(-1)
        return out

    def recording(self, readings: np.ndarray) -> ForwardModel:
        other = copy.copy(self)
        other.readings_ = self.readings_.copy()
        for w, count in enumerate(self.windows.count):
            other.readings_[w, :, :count] = readings[w, : self.counts[w]].reshape(self.channels, count)
        return other

    def local_count(self, hypothesis: Hypothesis) -> int:
        inner = self._has(hypothesis, "presliding") + 2 * (
            self._has(hypothesis, "soft") + self._has(hypothesis, "play")
        )
        return len(self.drive.states) + inner * len(self.drive.joints)

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        """Where a load lies in its play: at either flank or between."""
        n, joints = len(self.drive.states), len(self.drive.joints)
        if not self._has(hypothesis, "play"):
            return np.zeros((0, 0))
        grid = np.zeros((len(_IN_PLAY), n + 2 * joints))
        grid[:, n::2] = np.array(_IN_PLAY)[:, None]
        return grid

    def jobs(self, values: Sequence[float] | np.ndarray) -> Jobs:
        """Every window at one global point, started where the measured motion says."""
        w = np.arange(len(self.counts))
        return Jobs.at(np.array(values), w, np.zeros((len(w), self.local_count(NONE))))

    def _fine(self) -> int:
        """Steps in a sample such that twice as many change no residual by more than `_ACCURACY`."""
        jobs = self.jobs(np.zeros(len(self.parameters)))
        self.substeps = 1
        before = self.residuals(NONE, jobs)
        while self.substeps < _MOST_SUBSTEPS:
            self.substeps *= 2
            after = self.residuals(NONE, jobs)
            if float(np.abs(after - before).max()) < max(_ACCURACY, 1e-4 * float(np.abs(after).max())):
                return self.substeps // 2
            before = after
        return self.substeps


def _columns(name: str) -> list[str]:
    """Columns of the integrator that belong to an effect: its own, then its shape's."""
    return [name, *(c for c in COLUMNS if c.startswith(f"{name}_"))]
