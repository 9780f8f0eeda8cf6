"""How much of a disturbance or effect is left once the nominal machine is fitted: the measure of all sizes here.

A fit of whole records would need a method; this one is linear, and so needs none. A record is cut at the ends of its
cam turns. In each piece the true machine without the disturbance starts from the state that the disturbed one has
there, so that what a play amplifies from turn to turn does not count. It is the same state of the joints: the same
torques and rates of deflection, in a play the same share of it, and not the same angles, which a cam with another
station or a base that gives way would turn into torques that no fit has:

    d_w = reading of the disturbed machine - reading of the true machine resumed from the disturbed one's state
    left = rms over all pieces of d - X x,     x = argmin Σ_w |d_w - X_w x|²/σ² + |x/s|²,     w: cam turn

X are the derivatives of the pieces by what every method may fit, with what is known of it, s: the eight parameters of
the machine (10 %/√3), of each record load (10 %/√3), drive angle (2 mrad at the cam) and speed (0.3 %/√3), of each
piece its start state (nothing known). It is exact for small disturbances; for large ones a method can leave less, as it
may bend where this one is straight, and leaves more wherever it does not find the best fit.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.equations import Joint, Plant, deflections, drive_side, follower, softness
from indexer_experiments.challenge.messy.machines import KNOWN_TO
from indexer_experiments.challenge.parameters import changed, read
from indexer_experiments.challenge.truth import plant, resumed, run
from indexer_experiments.challenge.unlisted import NOTHING, TURN, Unlisted

RATE = 500.0
"""Sampling rate at which sizes are measured [Hz], whatever that of the records: levels do not depend on it."""

_STEPS_PER_MS = 2
"""Half as many as for records: sizes are sought within a tenth."""

FITTED = (
    "input_joint.stiffness", "input_joint.damping", "input_joint.backlash", "output_joint.stiffness",
    "output_joint.damping", "table_inertia", "cam_inertia", "follower_inertia",
)  # fmt: skip

_ANGLE, _SPEED = 0.002, 0.003 / 3.0**0.5
_STEP = 0.1
"""Step of the differences, in units of what is known."""

_LOCAL = ((0, 1e-5), (1, 1e-4), (2, 1e-6), (3, 1e-4))
"""Place of α, α̇, φ, φ̇ in a state and the step of each [rad, rad/s]: small beside any play."""

_ON_ITS_BASE, _SLIPPING = ((4, 1e-6), (5, 1e-4)), ((7, 1e-3),)
"""The same of a housing that moves, and of a motor whose speed does."""

_SOME = 6
"""Cam turns looked at, evenly spaced, in each record after the first, of which a whole table turn is looked at."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A cam turn of a record: number of the record, first sample and number of samples."""

    record: int
    first: int
    samples: int


def coarse_run(machine: Machine, point: OperatingPoint, samples: int, unlisted: Unlisted = NOTHING) -> np.ndarray:
    """A run as sizes need it, at `RATE`."""
    return run(machine, point, samples, RATE, unlisted, _STEPS_PER_MS)


def coarsely_resumed(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Acceleration (samples,) from a state on, as sizes need it, at `RATE`."""
    return resumed(machine, point, state, samples, RATE, steps_per_ms=_STEPS_PER_MS)[0]


def pieces_of(motions: Sequence[np.ndarray], stations: int) -> list[Piece]:
    """Whole cam turns of runs (1 + STATES, n): those of a table turn of the first, some of the others."""
    found = []
    for record, motion in enumerate(motions):
        turn = np.floor(motion[1] / (2.0 * np.pi))
        starts = np.flatnonzero(np.diff(turn) > 0.0) + 1
        spans = list(itertools.pairwise(starts))
        count = min(len(spans), stations if record == 0 else _SOME)
        chosen = np.linspace(0, len(spans) - 1, count).round().astype(int)
        found += [Piece(record, int(spans[k][0]), int(spans[k][1] - spans[k][0])) for k in chosen]
    return found


class LinearFit:
    """The linear fit of a machine to what differs from it.

    Parameters
    ----------
    machine : Machine
    points : sequence of OperatingPoint
        Of each record.
    motions : sequence of ndarray (1 + STATES, n)
        Runs of the machine at these points, at `RATE`.
    noise : float
        Standard deviation of the sensor's noise [rad/s²].
    sensor : Sensor
        Through which the machine is seen, a linear chain.
    """

    def __init__(
        self, machine: Machine, points: Sequence[OperatingPoint], motions: Sequence[np.ndarray], noise: float,
        sensor: Sensor,
    ) -> None:  # fmt: skip
        self.machine, self.points, self.noise, self.sensor = machine, list(points), noise, sensor
        self.pieces = pieces_of(motions, machine.stations)
        columns = len(FITTED) + 3 * len(self.points)
        rows, self._bases = [], []
        for piece in self.pieces:
            state = motions[piece.record][1:, piece.first]
            base = np.linalg.qr(self._seen(by_start_state(machine, self.points[piece.record], state, piece.samples)))[0]
            block = np.zeros((piece.samples, columns))
            block[:, : len(FITTED)] = self._seen(self._by_machine(piece, state))
            at = len(FITTED) + 3 * piece.record
            block[:, at : at + 3] = self._seen(self._by_record(piece, state))
            self._bases.append(base)
            rows.append(block - base @ (base.T @ block))
        self._rows = np.concatenate([*rows, noise * np.eye(columns)])

    def left(
        self, readings: Sequence[np.ndarray], motions: Sequence[np.ndarray], machine: Machine,
        unlisted: Unlisted = NOTHING,
    ) -> float:  # fmt: skip
        """What the fit leaves of readings (n,) of disturbed runs (1 + STATES, n) of a machine, over the noise."""
        plants = [(plant(machine, point, unlisted), plant(self.machine, point)) for point in self.points]
        through = [self.sensor.read(motion[0], RATE).values for motion in motions]
        parts = []
        for piece, base in zip(self.pieces, self._bases, strict=True):
            span = slice(piece.first, piece.first + piece.samples)
            if motions[piece.record].shape[1] < span.stop:
                raise ValueError("a disturbed run must be as long as the undisturbed one")
            point = self.points[piece.record]
            state = in_the_joints(motions[piece.record][1:, piece.first], *plants[piece.record])
            expected = coarsely_resumed(self.machine, point, state, piece.samples)
            moved = motions[piece.record][0, span] - expected
            difference = (readings[piece.record] - through[piece.record])[span] + self._seen(moved[:, np.newaxis])[:, 0]
            parts.append(difference - base @ (base.T @ difference))
        d = np.concatenate(parts)
        found = np.linalg.lstsq(self._rows, np.concatenate([d, np.zeros(self._rows.shape[1])]), rcond=None)[0]
        return float(np.sqrt(np.mean((d - self._rows[: len(d)] @ found) ** 2))) / self.noise

    def _seen(self, accelerations: np.ndarray) -> np.ndarray:
        """What the sensor makes of accelerations (n, c) that come beside others."""
        nothing = self.sensor.read(np.zeros(len(accelerations)), RATE).values
        return np.stack([self.sensor.read(column, RATE).values - nothing for column in accelerations.T], axis=1)

    def _by_machine(self, piece: Piece, state: np.ndarray) -> np.ndarray:
        point, step = self.points[piece.record], _STEP * KNOWN_TO
        base = coarsely_resumed(self.machine, point, state, piece.samples)
        moved = []
        for name in FITTED:
            machine = changed(self.machine, {name: read(self.machine, name) * (1.0 + step)})
            moved.append((coarsely_resumed(machine, point, state, piece.samples) - base) / _STEP)
        return np.stack(moved, axis=1)

    def _by_record(self, piece: Piece, state: np.ndarray) -> np.ndarray:
        point, machine = self.points[piece.record], self.machine
        base = coarsely_resumed(machine, point, state, piece.samples)
        heavier = dataclasses.replace(point, load_torque=point.load_torque * (1.0 + _STEP * KNOWN_TO))
        faster = dataclasses.replace(point, motor_speed=point.motor_speed * (1.0 + _STEP * _SPEED))
        ahead, quick = state.copy(), state.copy()
        ahead[6] += _STEP * _ANGLE / machine.reduction
        quick[7] *= 1.0 + _STEP * _SPEED
        runs = ((heavier, state), (point, ahead), (faster, quick))
        return np.stack([(coarsely_resumed(machine, p, y, piece.samples) - base) / _STEP for p, y in runs], axis=1)


def in_the_joints(state: np.ndarray, disturbed: Plant, plain: Plant) -> np.ndarray:
    """The state (STATES,) of another machine whose joints are in the state of the disturbed one's, at its motor's
    angle."""
    turn, found = math.floor(state[0] / TURN), state.copy()
    d1, v1, d2, v2 = deflections(disturbed, state, turn)
    side, side_rate = drive_side(plain, state[6], state[7])
    of_1, to_1 = disturbed.joint_1, plain.joint_1
    found[0] = side - _under_the_same_torque(d1, of_1, of_1.rho, to_1, to_1.rho)
    found[1] = side_rate - v1
    if not plain.loose:
        found[4:6] = 0.0
    turn_there = math.floor(found[0] / TURN)
    angle, slope, _ = follower(plain, found[0], turn_there)
    rhos = softness(disturbed, turn), softness(plain, turn_there)
    found[2] = angle + found[4] + _under_the_same_torque(d2, disturbed.joint_2, rhos[0], plain.joint_2, rhos[1])
    found[3] = slope * found[1] + found[5] + v2
    return found


def _under_the_same_torque(d: float, of: Joint, rho_of: float, to: Joint, rho_to: float) -> float:
    """A joint's deflection where another one's is d: under the same torque at rest, in a play at the same share."""
    beyond = abs(d) - 0.5 * of.g
    if beyond <= 0.0:
        return d * to.g / of.g if of.g else 0.0
    softer_of, softer_to = (1.0, 1.0) if d > 0.0 else (rho_of, rho_to)
    given = (of.k * softer_of + of.k_c * beyond**2) * beyond
    roots = np.roots([to.k_c, 0.0, to.k * softer_to, -given])
    return math.copysign(0.5 * to.g + float(roots[np.isreal(roots)].real.max()), d)


def local_basis(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Orthonormal basis (samples, l) of what a piece changes by with its start state."""
    return np.linalg.qr(by_start_state(machine, point, state, samples))[0]


def by_start_state(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Derivatives (samples, l) of a piece by what its start state leaves open."""
    base = coarsely_resumed(machine, point, state, samples)
    here = plant(machine, point)
    columns = []
    for place, step in (*_LOCAL, *(_ON_ITS_BASE if here.loose else ()), *(_SLIPPING if here.slip else ())):
        other = state.copy()
        other[place] += step
        columns.append((coarsely_resumed(machine, point, other, samples) - base) / step)
    return np.stack(columns, axis=1)
