"""Cam turns of a record, resumed one by one, and their derivatives by all that a fit may move.

A cam turn of a disturbed run is resumed by another machine in the same state of the joints: the same torques and rates
of deflection, in a play the same share of it, and not the same angles, which a cam with another station or a base that
gives way would turn into torques that no fit has.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
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

ANGLE, SPEED = 0.002, 0.003 / 3.0**0.5
"""Standard deviations of a record's drive angle at the cam [rad] and of its speed, relative."""

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


def coarse_run(
    machine: Machine, point: OperatingPoint, samples: int, unlisted: Unlisted = NOTHING, lead: int = 0
) -> np.ndarray:
    """A run as sizes need it, at `RATE`."""
    return run(machine, point, samples, RATE, unlisted, _STEPS_PER_MS, lead)


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


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of a piece by what is fitted to all of them (n, g), and by its start state (n, l)."""

    globals: np.ndarray
    start: np.ndarray

    @functools.cached_property
    def _factors(self) -> tuple[np.ndarray, np.ndarray]:
        return np.linalg.qr(self.start)

    def without_start(self, rows: np.ndarray) -> np.ndarray:
        """Rows (n, ...) without what a start state explains."""
        base = self._factors[0]
        return rows - base @ (base.T @ rows)

    def start_of(self, rows: np.ndarray) -> np.ndarray:
        """The start state (l,) that explains most of rows (n,)."""
        base, triangle = self._factors
        return np.linalg.lstsq(triangle, base.T @ rows, rcond=None)[0]


def by_machine(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Derivatives (samples, 8) of a piece by the machine's parameters, in units of what is known."""
    base = coarsely_resumed(machine, point, state, samples)
    moved = []
    for name in FITTED:
        other = changed(machine, {name: read(machine, name) * (1.0 + _STEP * KNOWN_TO)})
        moved.append((coarsely_resumed(other, point, state, samples) - base) / _STEP)
    return np.stack(moved, axis=1)


def by_record(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Derivatives (samples, 3) of a piece by its record's load, drive angle and speed, in units of what is known."""
    base = coarsely_resumed(machine, point, state, samples)
    heavier = dataclasses.replace(point, load_torque=point.load_torque * (1.0 + _STEP * KNOWN_TO))
    faster = dataclasses.replace(point, motor_speed=point.motor_speed * (1.0 + _STEP * SPEED))
    ahead, quick = state.copy(), state.copy()
    ahead[6] += _STEP * ANGLE / machine.reduction
    quick[7] *= 1.0 + _STEP * SPEED
    runs = ((heavier, state), (point, ahead), (faster, quick))
    return np.stack([(coarsely_resumed(machine, p, y, samples) - base) / _STEP for p, y in runs], axis=1)


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


def left_open(here: Plant) -> tuple[tuple[int, float], ...]:
    """Places of a start state that nothing tells, and the step of each."""
    return (*_LOCAL, *(_ON_ITS_BASE if here.loose else ()), *(_SLIPPING if here.slip else ()))


def by_start_state(machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int) -> np.ndarray:
    """Derivatives (samples, l) of a piece by what its start state leaves open."""
    base = coarsely_resumed(machine, point, state, samples)
    here = plant(machine, point)
    columns = []
    for place, step in left_open(here):
        other = state.copy()
        other[place] += step
        columns.append((coarsely_resumed(machine, point, other, samples) - base) / step)
    return np.stack(columns, axis=1)
