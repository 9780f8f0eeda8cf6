"""The inverse form: what force a measured motion asks for.

    reading = R(f(q, v, a, u, t; p) + Σ effects) + friction,   residual = (h * reading - h * measured)/noise

Motion and measured force have passed one kernel (`smoothing`), and both sides pass the comparison's, h. The state in
which a load on a spring begins a record is unknown, and what it adds is linear in that: it is eliminated by least
squares, its prior that of a load left standing or moving (variable projection; Golub and Pereyra, SIAM J. Numer. Anal.
10 (1973) 413). Dry friction follows Coulomb's law as it is, not a smoothed sign: while the drive moves it is the level
against the direction; while it stands, any force between the levels of both directions may act, so that a residual
counts only beyond them (Moreau's law, the motion being given).
"""

from __future__ import annotations

import copy
import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from discrepancy.drives.both_forms import DriveModel
from discrepancy.drives.description import Drive
from discrepancy.drives.effects import EFFECTS, TABLES, DriveEffect
from discrepancy.drives.inverse_library import library_of, proposed_by
from discrepancy.drives.library import values_of
from discrepancy.drives.scales import Scales
from discrepancy.drives.sessions import slots_of, zeroed
from discrepancy.drives.track import Track
from discrepancy.drives.user_code import law_row, said_by_user, unwritable
from discrepancy.drives.windows import Windows
from discrepancy.jobs import Jobs
from discrepancy.model import Hypothesis
from indexer_env.errors import ParameterError

_REMEMBERED = 64
"""Forces of single effects that are kept: a fit moves one parameter at a time."""


_NUDGE = 1e-4
"""Of a channel's size, by which it is moved to see what its noise does."""


class InverseModel(DriveModel):
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
        self, drive: Drive, tracks: Sequence[Track], scales: Scales, windows: Windows,
        known: tuple[Hypothesis, ...] = (), library: Mapping[str, tuple[Hypothesis, ...]] | None = None,
    ) -> None:  # fmt: skip
        self.drive, self.tracks, self.scales, self.windows, self.known = drive, tuple(tracks), scales, windows, known
        self.effects = {effect.name: effect for effect in drive.effects} | TABLES
        self.own, self._offset = len(drive.parameters), zeroed(drive, scales.F, scales.unit("F"))
        self.slots = slots_of(drive, known, len(windows.tracks), self._offset)
        self.parameters = self.slots.parameters
        self.counts, self.groups = windows.count, windows.groups
        self.names = tuple(self.tracks[k].name for k in windows.tracks)
        falling = [self.tracks[k].falling_noise for k in windows.tracks]
        self.falling = tuple(name for name, noise in zip(self.names, falling, strict=True) if noise)
        self.noise = np.array([self._noise(self.tracks[k]) for k in windows.tracks])
        self.measured = [self.tracks[k].measured for k in windows.tracks]
        self._kept: dict[Any, Any] = {}
        self.inside = [self._covered(group) for group in range(len(self.measured))]
        self.left_out: tuple[str, ...] = ()  # effects not tried, as the model's own parameters can do the same
        if library is None:
            library, self.left_out = library_of(self)
        self._library = library

    def _covered(self, group: int) -> np.ndarray:
        """Which samples (m,) of a record, as they are compared, lie in the windows."""
        inside = np.zeros(len(self.measured[group]), dtype=bool)
        mine = self.groups == group
        for first, count in zip(self.windows.first[mine], self.counts[mine], strict=True):
            inside[first : first + count] = True
        return inside

    # ------------------------------------------------------------------ the model's own force

    def base(self, track: Track, values: tuple[float, ...]) -> Any:
        """The user's force as a function of motion and, in the record's place, of inputs: base(q, v, a, u) -> (n,)."""
        p = self.drive.p(values)

        name = f"{self.drive.path.name}: force"

        def force(q: np.ndarray, v: np.ndarray, a: np.ndarray, u: Any = track.u) -> np.ndarray:
            try:
                given = self.drive.function(*map(unwritable, (q, v, a)), unwritable(u), unwritable(track.t), p)
                if given is None:
                    raise ParameterError(f"{name} must give one number a sample, got None; end it with return.")
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
        """Of the comparison [F]: the force's own, and what the noise of the motion and of the inputs makes of it at
        nominal parameters."""
        sizes = {"q": self.scales.Q, "v": self.scales.V, "a": self.scales.A}
        sources = [(sizes[role], noise, {role: getattr(track, role) + _NUDGE * sizes[role]})
                   for role, noise in zip(sizes, track.motion_noise, strict=True)]  # fmt: skip
        for name, noise in track.input_noise.items():
            row = track.input(name)
            size = float(np.ptp(row)) or 1.0
            sources.append((size, noise, {"u": track.inputs_with(name, row + _NUDGE * size)}))
        at, total = self._nominal(track), (track.falling_noise or track.noise) ** 2
        for size, noise, moved in sources:
            if noise:
                there = self._nominal(dataclasses.replace(track, **moved))
                total += (float(np.median(np.abs(there - at))) / (_NUDGE * size) * noise) ** 2
        return float(np.sqrt(total))

    def _nominal(self, track: Track) -> np.ndarray:
        """Force (n,) of the model at nominal parameters with the effects that it has, dry friction left out: its levels
        hardly depend on what is measured."""
        own = tuple(p.nominal for p in self.drive.parameters)
        total = self.base(track, own)(track.q, track.v, track.a)
        for one in self.known:
            if self.effects[one.name].acts == "force":
                values = tuple(p.nominal for p in one.parameters)
                total = total + self._law(track, self.effects[one.name], values_of(one, values), own)
        return total

    # ------------------------------------------------------------------ effects

    def _term(self, track: Track, effect: DriveEffect, one: Hypothesis, values: tuple, own: tuple) -> Any:
        """What a single effect adds, at the inner rate: a force (n,), or levels of dry friction (3, n): moving, and the
        highest and lowest at rest."""
        key = (track.name, one.name, tuple(one.fixed.items()), values, own if self._calls_base(effect) else ())
        if key not in self._kept:
            if len(self._kept) > _REMEMBERED * len(self.tracks):
                self._kept.clear()
            self._kept[key] = self._law(track, effect, values_of(one, values), own)
        return self._kept[key]

    @staticmethod
    def _calls_base(effect: DriveEffect) -> bool:
        """Whether a law may change with the model's own parameters: that of a user's own effect may."""
        return effect.of_base or effect.name not in (EFFECTS | TABLES)

    def _law(self, track: Track, effect: DriveEffect, p: Any, own: tuple) -> np.ndarray:
        base = self.base(track, own)
        law = functools.partial(law_row, self.drive.path, effect.name, effect.law, track, p, base)
        if effect.acts != "dry":
            return law()
        ones = np.ones_like(track.v)
        moving = law(np.sign(track.v)) * track.direction
        up, down = (law(s * ones) for s in (1.0, -1.0))
        return np.stack([moving, np.where(track.rest, up, 0.0), np.where(track.rest, -down, 0.0)])

    def compared(self, group: int, hypothesis: Hypothesis, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reading (m,) of a record at a global point, as it is compared, and how far friction at rest may shift it
        (2, m)."""
        track, values = self.tracks[self.windows.tracks[group]], self.slots.values(group, point, hypothesis)
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
            total = law_row(self.drive.path, effect.name, effect.law, track, p, self.base(track, own), total)
        if self._offset is not None:
            total = total + values[len(self.slots.every) - 1]
        return track.thinned(total), track.thinned(rest) if rest.any() else np.zeros((2, 1))

    # ------------------------------------------------------------------ as a Model

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library; what a fit has left, residuals (w, n), proposes wavelengths of what wavers, and sizes."""
        return self._library if residual is None else proposed_by(self, self._library, residual)

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

    def told(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        if all(self.effects[one.name].acts != "dry" for one in (*self.known, *hypothesis.effects)):
            return self.counts
        w = np.arange(len(self.counts))
        # exactly 0 is what friction at rest takes, and what lies beyond a window's end
        return np.count_nonzero(self.residuals(hypothesis, Jobs.at(point, w, np.zeros((len(w), 0)))), axis=1)

    def _residual(self, hypothesis: Hypothesis, point: np.ndarray, group: int) -> np.ndarray:
        predicted, rest = self.compared(group, hypothesis, point)
        left = predicted - self.measured[group]
        rows = self._starts(group, hypothesis, point)
        if len(rows):
            # what friction at rest holds tells nothing of the start
            told = self.inside[group] & (rest[0] == rest[1])
            seen = rows[:, told] / self.noise[group]
            found = np.linalg.solve(np.eye(len(rows)) + seen @ seen.T, seen @ left[told] / self.noise[group])
            left = left - found @ rows
        # friction at rest takes what is left as far as it reaches
        return (left - np.clip(left, -rest[0], -rest[1])) / self.noise[group]

    def _starts(self, group: int, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        """What the unknown states in which effects begin a record add (k, m), each over its standard deviation."""
        found: list[np.ndarray] = []
        if not any(self.effects[one.name].begins for one in (*self.known, *hypothesis.effects)):
            return np.array(found)
        track, values = self.tracks[self.windows.tracks[group]], self.slots.values(group, point, hypothesis)
        base = self.base(track, tuple(values[: self.own]))
        for one, mine in self._present(hypothesis, values):
            begins = self.effects[one.name].begins
            if begins is not None:
                found += [track.thinned(row) for row in begins(track, values_of(one, mine), base)]
        return np.array(found)

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
