"""How much of a disturbance or effect is left once the nominal machine is fitted: the measure of all sizes here.

A fit of whole records would need a method; this one begins at the truth, and so needs none. It takes the records that a
method may fit: what shows only where one of them meets one that is held out, as a stiffness that a load changes does,
can be named by no fit. A record is cut at the ends of its cam turns. In each piece the true machine without the
disturbance is resumed in the state of the disturbed one's joints (`pieces`), so that what a play amplifies from turn to
turn does not count:

    d_w = reading of the disturbed machine - reading of the true machine resumed from the disturbed one's state
    left = rms over all pieces of d - X x,     x = argmin Σ_w |d_w - X_w x|²/σ² + |x/s|²,     w: cam turn

X are the derivatives of the pieces by what every method may fit, with what is known of it, s: the eight parameters of
the machine (10 %/√3), of each record load (10 %/√3), drive angle (2 mrad at the cam) and speed (0.3 %/√3), of each
piece its start state (nothing known). One such step is exact for small disturbances alone: where the noise is little, a
stiffness that is 5 % off leaves what a straight line misses of it, five times the noise, which no fit leaves. So the
machine is run again with all that was found; where that leaves more than was promised, derivatives are taken there and
another step follows (Gauss–Newton). A method leaves more wherever it does not find the best fit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.equations import Plant
from indexer_experiments.challenge.messy.machines import KNOWN_TO
from indexer_experiments.challenge.messy.pieces import (
    ANGLE,
    FITTED,
    RATE,
    SPEED,
    Piece,
    Slopes,
    by_machine,
    by_record,
    by_start_state,
    coarsely_resumed,
    in_the_joints,
    left_open,
    pieces_of,
)  # fmt: skip
from indexer_experiments.challenge.parameters import changed, read
from indexer_experiments.challenge.running import read_running
from indexer_experiments.challenge.truth import plant
from indexer_experiments.challenge.unlisted import NOTHING, Unlisted

_REACH = 3.0
"""Standard deviations to which the machine and a load may be moved."""

_STEPS, _WORTH = 8, 0.9
"""Most steps of a fit; and what one must leave of what was left before it, so that another follows."""

_STRAIGHT = 0.97
"""What is left over what was promised, from which on the machine counts as a straight line."""

_PARTS = (1.0, 0.5, 0.25, 0.1)
"""Parts of a step, of which the first is taken that leaves less."""

_NOTHING_BEFORE = np.zeros(1)
"""Acceleration before what begins at rest, as the difference of two runs from one state does."""


class _Disturbed(NamedTuple):
    """Disturbed runs (1 + STATES, n), the plant of each, and what is read (n,) beyond what the sensor makes of them."""

    motions: Sequence[np.ndarray]
    plants: Sequence[Plant]
    beyond: Sequence[np.ndarray]


class Fit:
    """The fit of a machine to what differs from it.

    Parameters
    ----------
    machine : Machine
    points : sequence of OperatingPoint
        Of each record.
    motions : sequence of ndarray (1 + STATES, n)
        Runs of the machine at these points, at `RATE`; of a machine that is held those of the disturbed one, of which
        its pieces are cut.
    noise : float
        Standard deviation of the sensor's noise [rad/s²].
    sensor : Sensor
        Through which the machine is seen, a linear chain.
    held : bool
        The machine is as it is; only what belongs to records and start states moves.
    """

    def __init__(
        self, machine: Machine, points: Sequence[OperatingPoint], motions: Sequence[np.ndarray], noise: float,
        sensor: Sensor, *, held: bool = False,
    ) -> None:  # fmt: skip
        self.machine, self.points, self.noise, self.sensor, self.held = machine, list(points), noise, sensor, held
        self.pieces = pieces_of(motions, machine.stations)
        self._columns = len(FITTED) + 3 * len(self.points)
        reach = np.full(self._columns, _REACH)
        if held:
            reach[: len(FITTED)] = 0.0
        for record in range(len(self.points)):
            # a drive angle and a speed are what the record shows
            reach[self._of_record(record)][1:] = math.inf
        self._reach = reach
        # where a machine is held its pieces begin in the states of the disturbed one's joints
        self._slopes = [] if held else [
            self._slopes_of(machine, self.points[piece.record], motions[piece.record][1:, piece.first], piece)
            for piece in self.pieces
        ]  # fmt: skip

    def left(
        self, readings: Sequence[np.ndarray], motions: Sequence[np.ndarray], machine: Machine,
        unlisted: Sequence[Unlisted] = (), *, before: Sequence[np.ndarray] = (), straight: bool = False,
    ) -> float:  # fmt: skip
        """What the fit leaves of readings (n,) of disturbed runs (1 + STATES, n) of a machine, over the noise.

        `unlisted`: what disturbs each run; `before`, which a sensor with a high-pass needs: the turn (1 + STATES, m)
        before each; `straight`: what the first step promises to leave.
        """
        return self._fitted(readings, motions, machine, unlisted, before, straight=straight)[0]

    def reached(
        self, readings: Sequence[np.ndarray], motions: Sequence[np.ndarray], machine: Machine,
        unlisted: Sequence[Unlisted], before: Sequence[np.ndarray],
    ) -> float:  # fmt: skip
        """The same, of the best place that the fit came to, where steps may promise more."""
        return self._fitted(readings, motions, machine, unlisted, before)[1]

    def _fitted(
        self, readings: Sequence[np.ndarray], motions: Sequence[np.ndarray], machine: Machine,
        unlisted: Sequence[Unlisted], before: Sequence[np.ndarray], *, straight: bool = False,
    ) -> tuple[float, float]:  # fmt: skip
        """What the steps promise to leave at least, and what is left, over the noise."""
        if any(motions[p.record].shape[1] < p.first + p.samples for p in self.pieces):
            raise ValueError("a disturbed run must be as long as the undisturbed one")
        leads = [turn[0] for turn in before] or [_NOTHING_BEFORE] * len(motions)
        through = [read_running(self.sensor, m[0], lead, RATE) for m, lead in zip(motions, leads, strict=True)]
        beyond = [reading - seen for reading, seen in zip(readings, through, strict=True)]
        given = zip(self.points, unlisted or [NOTHING] * len(self.points), strict=True)
        disturbed = _Disturbed(motions, [plant(machine, *one) for one in given], beyond)
        x, open_ = np.zeros(self._columns), [left_open(plant(self.machine, point)) for point in self.points]
        starts = [np.zeros(len(open_[piece.record])) for piece in self.pieces]
        slopes = self._slopes or [self._slopes_of(*at, piece) for piece, at in self._places(x, starts, disturbed)]
        missing, least = self._missing(x, starts, disturbed), math.inf
        best = self._level(missing, slopes)
        for _ in range(_STEPS):
            step, promised = self._step(x, missing, slopes)
            least, had = min(promised, least), self._level(missing, slopes)
            if straight or promised > _STRAIGHT * had:
                break
            further = [s.start_of(d - s.globals @ step) for s, d in zip(slopes, missing, strict=True)]
            for part in _PARTS:
                to = x + part * step, [start + part * more for start, more in zip(starts, further, strict=True)]
                missing = self._missing(*to, disturbed)
                reached = self._level(missing, slopes)
                if reached < had:
                    break
            x, starts = to
            best = min(best, reached)
            if reached > _WORTH * had or _STRAIGHT * promised <= reached <= promised / _STRAIGHT:
                break
            slopes = [self._slopes_of(*place, piece) for piece, place in self._places(x, starts, disturbed)]
        return least, best

    def _step(self, x: np.ndarray, missing: Sequence[np.ndarray], slopes: Sequence[Slopes]) -> tuple[np.ndarray, float]:
        """The step of what is fitted to all pieces that leaves least in linear theory, and what it leaves."""
        rows = np.concatenate([s.without_start(s.globals) for s in slopes])
        d = _but_for_starts(missing, slopes)
        known = self.noise * np.eye(self._columns)
        bounds = np.minimum(-self._reach - x, -1e-9), np.maximum(self._reach - x, 1e-9)
        step = lsq_linear(np.concatenate([rows, known]), np.concatenate([d, -self.noise * x]), bounds).x
        return step, float(np.sqrt(np.mean((d - rows @ step) ** 2))) / self.noise

    def _level(self, missing: Sequence[np.ndarray], slopes: Sequence[Slopes]) -> float:
        """What is missing but for start states, over the noise."""
        return float(np.sqrt(np.mean(_but_for_starts(missing, slopes) ** 2))) / self.noise

    def _missing(self, x: np.ndarray, starts: Sequence[np.ndarray], disturbed: _Disturbed) -> list[np.ndarray]:
        """What the machine with what was found lacks of the readings, piece by piece."""
        found = []
        for piece, (machine, point, state) in self._places(x, starts, disturbed):
            k, span = piece.record, slice(piece.first, piece.first + piece.samples)
            moved = disturbed.motions[k][0, span] - coarsely_resumed(machine, point, state, piece.samples)
            found.append(disturbed.beyond[k][span] + self._seen(moved[:, np.newaxis])[:, 0])
        return found

    def _places(
        self, x: np.ndarray, starts: Sequence[np.ndarray], disturbed: _Disturbed
    ) -> Iterator[tuple[Piece, tuple[Machine, OperatingPoint, np.ndarray]]]:
        """Each piece with the machine that was found, the point and the state from which it is resumed there."""
        values = {name: read(self.machine, name) * (1.0 + KNOWN_TO * z) for name, z in zip(FITTED, x, strict=False)}
        machine = changed(self.machine, values)
        for piece, start in zip(self.pieces, starts, strict=True):
            load, angle, speed = x[self._of_record(piece.record)]
            given = self.points[piece.record]
            point = dataclasses.replace(
                given, load_torque=given.load_torque * (1.0 + KNOWN_TO * load),
                motor_speed=given.motor_speed * (1.0 + SPEED * speed),
            )  # fmt: skip
            here = plant(machine, given)
            before = disturbed.motions[piece.record][1:, piece.first]
            state = in_the_joints(before, disturbed.plants[piece.record], here)
            state[6] += ANGLE / machine.reduction * angle
            state[7] *= 1.0 + SPEED * speed
            state[[place for place, _ in left_open(here)]] += start
            yield piece, (machine, point, state)

    def _of_record(self, record: int) -> slice:
        """Places of a record's load, angle and speed among what is fitted."""
        return slice(len(FITTED) + 3 * record, len(FITTED) + 3 * record + 3)

    def _slopes_of(self, machine: Machine, point: OperatingPoint, state: np.ndarray, piece: Piece) -> Slopes:
        by_all = np.zeros((piece.samples, self._columns))
        if not self.held:
            by_all[:, : len(FITTED)] = self._seen(by_machine(machine, point, state, piece.samples))
        by_all[:, self._of_record(piece.record)] = self._seen(by_record(machine, point, state, piece.samples))
        return Slopes(by_all, self._seen(by_start_state(machine, point, state, piece.samples)))

    def _seen(self, accelerations: np.ndarray) -> np.ndarray:
        """What the sensor makes of accelerations (n, c) that come beside others."""
        nothing = read_running(self.sensor, np.zeros(len(accelerations)), _NOTHING_BEFORE, RATE)
        seen = [read_running(self.sensor, column, _NOTHING_BEFORE, RATE) for column in accelerations.T]
        return np.stack(seen, axis=1) - nothing[:, np.newaxis]


def _but_for_starts(missing: Sequence[np.ndarray], slopes: Sequence[Slopes]) -> np.ndarray:
    """What is missing of all pieces but for what a start state of each explains."""
    return np.concatenate([s.without_start(one) for s, one in zip(slopes, missing, strict=True)])
