"""The inverse form: what force a measured motion asks for.

    reading = R(f(q, v, a, u, t; p) + Σ effects) + friction,   residual = (h * reading - h * measured)/noise

Motion and measured force have passed one kernel (`smoothing`), and both sides pass the comparison's, h. There are no
start states. Dry friction follows Coulomb's law as it is, not a smoothed sign: while the drive moves it is the level
against the direction; while it stands, any force between the levels of both directions may act, so that a residual
counts only beyond them (Moreau's law, the motion being given).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from discrepancy.drives.description import Drive
from discrepancy.drives.effects import TABLES, DriveEffect
from discrepancy.drives.library import (
    check_slopes,
    done_by_model,
    hypotheses_of,
    proposals,
    sensible,
    sessions_of,
    sized,
    values_of,
    without,
)
from discrepancy.drives.track import Scales, Track
from discrepancy.drives.user_code import checked_row, said_by_user
from discrepancy.drives.windows import Windows
from discrepancy.model import NONE, Hypothesis, Jobs, Model
from indexer_env.errors import ParameterError

_NUDGE = 1e-4
"""Relative to a parameter's scale, for the slopes of the model's own parameters."""

_REMEMBERED = 64
"""Forces of single effects that are kept: a fit moves one parameter at a time."""


class InverseModel(Model):
    """A drive in its inverse form with records.

    Parameters
    ----------
    drive : Drive
    tracks : sequence of Track
    scales : Scales
    windows : Windows
        Of the tracks.
    known : tuple of Hypothesis
        Effects that the model has already, their parameters nominal at their values.
    library : mapping of str to tuple of Hypothesis, or None
        Effects that may be missing; None: found from these windows, which are those to fit.
    """

    def __init__(
        self,
        drive: Drive,
        tracks: Sequence[Track],
        scales: Scales,
        windows: Windows,
        known: tuple[Hypothesis, ...] = (),
        library: Mapping[str, tuple[Hypothesis, ...]] | None = None,
    ) -> None:
        self.drive, self.tracks, self.scales, self.windows, self.known = drive, tuple(tracks), scales, windows, known
        self.effects = {effect.name: effect for effect in drive.effects} | TABLES
        sessions = sessions_of(len(windows.tracks), scales) if drive.sessions else ()
        self.own = len(drive.parameters)
        self.parameters = (*drive.parameters, *(p for one in known for p in one.parameters), *sessions)
        self.counts, self.groups = windows.count, windows.groups
        self.noise = np.array([self._noise(self.tracks[k]) for k in windows.tracks])
        self.measured = [self.tracks[k].measured for k in windows.tracks]
        self._kept: dict[Any, Any] = {}
        self._left_out: tuple[str, ...] = ()
        self._library = self._found() if library is None else library

    # ------------------------------------------------------------------ the model's own force

    def base(self, track: Track, values: tuple[float, ...]) -> Any:
        """The user's force as a function of the motion: base(q, v, a) -> (n,)."""
        p = self.drive.p(values)

        name = f"{self.drive.path.name}: force"

        def force(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
            try:
                given = self.drive.function(*map(_kept, (q, v, a)), track.u, track.t, p)
                if np.iscomplexobj(given):
                    raise ParameterError(f"{name} must give real numbers, got complex ones.")
                row = np.asarray(given, dtype=float)
            except ParameterError:
                raise
            except (Exception, SystemExit) as error:
                raise said_by_user(self.drive.path, self.drive.function, error) from None
            if row.shape not in ((), q.shape):
                raise ParameterError(f"{name} must give one number a sample, {q.shape}, got an array of {row.shape}.")
            if not np.isfinite(row).all():
                where = float(track.t[int(np.argmin(np.isfinite(np.broadcast_to(row, q.shape))))])
                raise ParameterError(f"{name} must give finite numbers, got one that is none at {where:.6g} s for {p}.")
            return np.broadcast_to(row, q.shape)

        return force

    def _noise(self, track: Track) -> float:
        """Of the comparison [F]: the force's own, and what the motion's noise makes of it at nominal parameters."""
        values = tuple(p.nominal for p in self.drive.parameters)
        force = self.base(track, values)
        at = force(track.q, track.v, track.a)
        total = track.noise**2
        rows = (track.q, track.v, track.a)
        sizes = (self.scales.Q, self.scales.V, self.scales.A)
        for k, (size, noise) in enumerate(zip(sizes, track.motion_noise, strict=True)):
            moved = [row + 1e-4 * size * (j == k) for j, row in enumerate(rows)]
            slope = float(np.median(np.abs(force(*moved) - at))) / (1e-4 * size)
            total += (slope * noise) ** 2
        return float(np.sqrt(total))

    # ------------------------------------------------------------------ effects

    def _term(self, track: Track, effect: DriveEffect, one: Hypothesis, values: tuple, own: tuple) -> Any:
        """What a single effect adds, at the inner rate: a force (n,), or levels of dry friction (3, n): moving, and the
        highest and lowest at rest."""
        key = (track.name, one.name, tuple(one.fixed.items()), values, own if effect.of_base else ())
        if key not in self._kept:
            if len(self._kept) > _REMEMBERED * len(self.tracks):
                self._kept.clear()
            self._kept[key] = self._law(track, effect, values_of(one, values), own)
        return self._kept[key]

    def _law(self, track: Track, effect: DriveEffect, p: Any, own: tuple) -> np.ndarray:
        base = self.base(track, own)
        if effect.acts != "dry":
            return checked_row(effect.name, effect.law(track, p, base), track.v)
        ones = np.ones_like(track.v)
        moving = checked_row(effect.name, effect.law(track, p, base, np.sign(track.v)), track.v) * track.direction
        up, down = (checked_row(effect.name, effect.law(track, p, base, s * ones), track.v) for s in (1.0, -1.0))
        return np.stack([moving, np.where(track.rest, up, 0.0), np.where(track.rest, -down, 0.0)])

    def compared(self, track: Track, hypothesis: Hypothesis, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reading (m,) of a global point, as it is compared, and how far friction at rest may shift it (2, m)."""
        values = [p.value(z) for p, z in zip(self.parameters + hypothesis.parameters, point, strict=True)]
        own = tuple(values[: self.own])
        total = self.base(track, own)(track.q, track.v, track.a)
        rest = np.zeros((2, len(total)))
        readings = []
        for one, mine in self._present(hypothesis, values):
            effect = self.effects[one.name]
            if effect.acts == "reading":
                readings.append((effect, values_of(one, mine)))
                continue
            term = self._term(track, effect, one, mine, own)
            total = total + (term if effect.acts == "force" else term[0])
            if effect.acts == "dry":
                rest = rest + term[1:]
        for effect, p in readings:
            total = checked_row(effect.name, effect.law(track, p, self.base(track, own), total), track.v)
        return track.thinned(total), track.thinned(rest) if rest.any() else np.zeros((2, 1))

    def _present(self, hypothesis: Hypothesis, values: Sequence[float]) -> list[tuple[Hypothesis, tuple[float, ...]]]:
        at = self.own
        found = []
        for one in self.known:
            found.append((one, tuple(values[at : at + len(one.parameters)])))
            at += len(one.parameters)
        for k, one in enumerate(hypothesis.effects):
            places = len(self.parameters) + hypothesis.places(k)
            found.append((one, tuple(values[i] for i in places)))
        return found

    # ------------------------------------------------------------------ as a Model

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library; what a fit has left, residuals (w, n), proposes wavelengths of what wavers, and sizes."""
        if residual is None:
            return self._library
        left = [np.zeros(len(row)) for row in self.measured]
        for w, (group, first, count) in enumerate(zip(self.groups, self.windows.first, self.counts, strict=True)):
            left[group][first : first + count] = -residual[w, :count] * self.noise[group]
        tracks = [self.tracks[k] for k in self.windows.tracks]
        found = dict(self._library)
        for name in found:
            if proposed := proposals(self.effects[name], tracks, left):
                found[name] = hypotheses_of(self.effects[name], self.scales, proposed)
        zero, slopes = np.zeros(len(self.parameters)), self._slopes()
        plain, whole = self._plain(NONE, zero), without(np.concatenate(left), slopes)

        def response(one: Hypothesis, values: tuple[float, ...]) -> np.ndarray:
            given = self._plain(one, np.concatenate([zero, one.coordinates(values)]))
            return without(given - plain, slopes)

        return {name: tuple(sized(one, response, whole) for one in choices) for name, choices in found.items()}

    @property
    def left_out(self) -> tuple[str, ...]:
        """Effects that are not tried, as the model's own parameters can do the same."""
        return self._left_out

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        out = np.zeros((len(jobs.point), int(self.counts.max())))
        for p, point in enumerate(jobs.points):
            mine = np.flatnonzero(jobs.point == p)
            groups = self.groups[jobs.window[mine]]
            for group in np.unique(groups).tolist():
                row = self._residual(hypothesis, point, group)
                for job in mine[groups == group]:
                    window = jobs.window[job]
                    first, count = self.windows.first[window], self.counts[window]
                    out[job, :count] = row[first : first + count]
        return out

    def _residual(self, hypothesis: Hypothesis, point: np.ndarray, group: int) -> np.ndarray:
        track = self.tracks[self.windows.tracks[group]]
        predicted, rest = self.compared(track, hypothesis, point)
        left = predicted + self._shift(point, group) - self.measured[group]
        # friction at rest takes what is left as far as it reaches
        return (left - np.clip(left, -rest[0], -rest[1])) / self.noise[group]

    def _shift(self, point: np.ndarray, group: int) -> float:
        place = next((k for k, p in enumerate(self.parameters) if p.record == group), None)
        return 0.0 if place is None else self.parameters[place].value(float(point[place]))

    def recording(self, readings: np.ndarray) -> InverseModel:
        other = copy.copy(self)
        other.measured = [row.copy() for row in self.measured]
        for w, (group, first, count) in enumerate(zip(self.groups, self.windows.first, self.counts, strict=True)):
            other.measured[group][first : first + count] = readings[w, :count] * self.noise[group]
        return other

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 0

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.zeros((0, 0))

    # ------------------------------------------------------------------ the library

    def _found(self) -> dict[str, tuple[Hypothesis, ...]]:
        """Effects that may be missing: sensible for the channels, and not done by the model's own parameters."""
        zero, slopes = np.zeros(len(self.parameters)), self._slopes()
        check_slopes(self.drive, slopes[: self.own])
        left = self._left_by(slopes)
        known = {one.name: one for one in self.known}
        found, done = {}, []
        for effect in sensible(self.drive.effects, self.scales, known):
            proposed = proposals(effect, [self.tracks[k] for k in self.windows.tracks], left)
            choices = hypotheses_of(effect, self.scales, proposed)
            if not choices:
                continue
            start = np.concatenate([zero, choices[0].coordinates(choices[0].starts[0])])
            response = self._plain(choices[0], start) - self._plain(NONE, zero)
            if effect.acts != "dry" and done_by_model(response, slopes):
                done.append(effect.name)
                continue
            found[effect.name] = choices
        self._left_out = tuple(done)
        return found

    def _plain(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        """Readings of all records at a point, one after the other."""
        return np.concatenate([self.compared(self.tracks[k], hypothesis, point)[0] for k in self.windows.tracks])

    def _slopes(self) -> np.ndarray:
        """Derivatives (g, n) of all readings by the model's own parameters, an offset of each record among them."""
        zero = np.zeros(len(self.parameters))
        physics = [k for k, p in enumerate(self.parameters) if not p.of_record]
        slopes = np.array([self._slope(NONE, zero, k) for k in physics])
        if not self.drive.sessions:
            return slopes
        owner = np.repeat(np.arange(len(self.measured)), [len(row) for row in self.measured])
        return np.concatenate([slopes, owner == np.arange(len(self.measured))[:, None]])

    def _slope(self, hypothesis: Hypothesis, point: np.ndarray, place: int) -> np.ndarray:
        nudged = point.copy()
        nudged[place] += _NUDGE
        return (self._plain(hypothesis, nudged) - self._plain(hypothesis, point)) / _NUDGE

    def _left_by(self, slopes: np.ndarray) -> list[np.ndarray]:
        """What the model with plain friction and an offset leaves of each record fitted: where waves are looked for."""
        measured = np.concatenate(self.measured)
        v = np.concatenate([self.tracks[k].thinned(self.tracks[k].v) for k in self.windows.tracks])
        side = np.concatenate([self.tracks[k].thinned(self.tracks[k].direction) for k in self.windows.tracks])
        columns = np.stack([*slopes, v, side, np.ones_like(v)], axis=1)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        target = measured - self._plain(NONE, np.zeros(len(self.parameters)))
        fitted, *_ = np.linalg.lstsq(columns, target, rcond=1e-10)
        edges = np.cumsum([len(row) for row in self.measured])[:-1]
        return np.split(target - columns @ fitted, edges)


def _kept(row: np.ndarray) -> np.ndarray:
    """A row that a user's function cannot write to."""
    view = row.view()
    view.flags.writeable = False
    return view
