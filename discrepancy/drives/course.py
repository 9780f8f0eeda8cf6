"""A record in the forward form: measured channels with their noise, inputs, and what the motion says of every state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.drives import smoothing
from discrepancy.drives.channels import Record
from discrepancy.drives.description import Drive
from discrepancy.drives.scales import Scales
from discrepancy.drives.windows import WINDOWS
from indexer_cli.words import joined
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import ParameterError, SignalError, refuse

_WINDOW = 20.0
"""Length of a window in T = V/A: some three swings."""

_LEAST_NOISE = 1e-6
"""Least noise over a channel's spread: it has digits."""

_LEAST_WINDOW = 60
"""Samples."""

_START = 3.0
"""Scale of a start state over the standard deviation of what the smoothed motion says of it."""


@dataclass(frozen=True, eq=False)
class Course:
    """One record in the forward form.

    Attributes
    ----------
    name : str
    rate : float
    rows : ndarray (channels, n)
        Measured channels.
    noise : ndarray (channels,)
    inputs : tuple of str
    u : ndarray (n, inputs)
    input_unit : str
        Of the first input, "" where there is none.
    states : ndarray (n, states)
        What the measured motion says of the states.
    spread : ndarray (states,)
        How well it says so.
    """

    name: str
    rate: float
    rows: np.ndarray
    noise: np.ndarray
    inputs: tuple[str, ...]
    u: np.ndarray
    input_unit: str
    states: np.ndarray
    spread: np.ndarray


def courses_of(drive: Drive, records: Sequence[Record]) -> tuple[list[Course], list[Scales], np.ndarray]:
    """Records in the forward form, the scales of each joint, and what is measured.

    Raises
    ------
    SignalError, ParameterError
        Units that differ between records, a joint that never moves, a state that nothing tells of, a wrong noise.
    """
    for role in records[0].rows:
        if len(units := {r.units.get(role, "") for r in records}) > 1:
            raise SignalError(f"All records must have {role!r} in the same unit, got {joined(sorted(units))}.")
    roles = [role for role in records[0].rows if role in drive.states or role == "a"]
    measured = np.array([drive.states.index(r) if r in drive.states else -1 for r in roles], dtype=np.int64)
    inputs = [role for role in records[0].rows if role not in roles]
    courses = [_course(drive, record, roles, inputs) for record in records]
    fitted = [c for c, r in zip(courses, records, strict=True) if not r.held_out]
    scales = []
    for joint in drive.joints:
        q, v = (np.concatenate([c.states[:, drive.states.index(s)] for c in fitted])
                for s in (joint.position, joint.speed))  # fmt: skip
        a = np.concatenate([_acceleration(c.states[:, drive.states.index(joint.speed)], c.rate) for c in fitted])
        mass = joint.inertia
        if isinstance(mass, str):
            mass = next(p.nominal for p in drive.parameters if p.name == mass)
        rms = [float(np.sqrt(np.mean(row**2))) for row in (v, a)]
        if not all(rms) or not np.ptp(q):
            raise SignalError(f"{records[0].name}: the joint {joint.name} must move, got none; measure a motion.")
        told = next((role for role in (joint.position, joint.speed, *roles) if role in records[0].units), "")
        unit = records[0].units.get(told, "").partition("/")[0]
        force = "N m" if unit == "rad" else "N"
        middle = 0.5 * float(q.min() + q.max())
        scales.append(Scales(mass * rms[1], 0.5 * float(np.ptp(q)), rms[0], rms[1], middle, force, unit))
    return courses, scales, measured


def _course(drive: Drive, record: Record, roles: Sequence[str], inputs: Sequence[str]) -> Course:
    rate, n = record.rate, len(record.rows[roles[0]])
    rows, noise, stated = [], [], _noise_stated(drive, record, roles)
    for role in roles:
        row = record.rows[role]
        white = stated.get(role)
        if white is None:
            white = math.sqrt(0.5 * rate * smoothing.density(row, rate, _cutoff(row, rate)))
        rows.append(row)
        noise.append(max(white, _LEAST_NOISE * float(np.std(row))))
    states, spread = np.zeros((n, len(drive.states))), np.zeros(len(drive.states))
    for k, state in enumerate(drive.states):
        states[:, k], spread[k] = _estimate(drive, record, state, dict(zip(roles, noise, strict=True)))
    u = np.column_stack([record.rows[i] for i in inputs]) if inputs else np.zeros((n, 0))
    unit = record.units.get(inputs[0], "") if inputs else ""
    return Course(record.name, rate, np.array(rows), np.array(noise), tuple(inputs), u, unit, states, spread)


def _noise_stated(drive: Drive, record: Record, roles: Sequence[str]) -> Mapping[str, float]:
    """Standard deviations of measured channels by their roles, of those of which one is stated."""
    given = drive.noise if record.noise is None else record.noise
    if given is None:
        return {}
    if isinstance(given, Mapping):
        for role, value in given.items():
            check_choice(drive.path.name, "noise", role, roles)
            unit = record.units.get(role, "")
            check_number(drive.path.name, f"noise[{role!r}]", value, low=0.0, low_open=True, unit=unit)
        return given
    if len({record.units.get(role) for role in roles}) > 1:
        remedy = f"write noise = {{{roles[0]!r}: NUMBER, {roles[1]!r}: NUMBER}}"
        raise refuse(drive.path.name, "noise", "given by role where channels differ in their unit", given, remedy)
    return dict.fromkeys(roles, float(given))


def _acceleration(v: np.ndarray, rate: float) -> np.ndarray:
    """Derivative of a speed, its noise a tenth of it at most."""
    cutoff = smoothing.quiet(v, rate, smoothing.WIDEST * rate, 1)
    edge = smoothing.margin(cutoff, rate)
    return smoothing.smoothed(v, cutoff, rate, 1)[edge:-edge]


def _cutoff(row: np.ndarray, rate: float) -> float:
    """What holds the motion of a channel [Hz]."""
    wanted = 4.0 * smoothing.holding(np.gradient(row), rate, 0.99)
    return min(max(wanted, 10.0 * rate / len(row)), smoothing.WIDEST * rate)


def _estimate(drive: Drive, record: Record, state: str, noise: Mapping[str, float]) -> tuple[np.ndarray, float]:
    """What the record says of a state, and the scale in which a window's start may differ from it."""
    if state in record.rows:
        row, order, role = record.rows[state], 0, state
    else:
        joint = next((j for j in drive.joints if j.speed == state and j.position in record.rows), None)
        if joint is None:
            return _added_up(drive, record, state, noise)
        row, order, role = record.rows[joint.position], 1, joint.position
    cutoff = smoothing.quiet(row, record.rate, _cutoff(row, record.rate), order + 1)
    padded = np.pad(row, 3 * smoothing.margin(cutoff, record.rate), mode="reflect", reflect_type="odd")
    edge = 3 * smoothing.margin(cutoff, record.rate)
    found = smoothing.smoothed(padded, cutoff, record.rate, order)[edge:-edge]
    spread = smoothing.passed_noise(2.0 * noise[role] ** 2 / record.rate, cutoff, order)
    return found, max(_START * spread, 1e-3 * float(np.std(found)))


def _added_up(drive: Drive, record: Record, state: str, noise: Mapping[str, float]) -> tuple[np.ndarray, float]:
    """A state that only its rate tells of: added up, its beginning unknown."""
    joint = next((j for j in drive.joints if j.position == state and j.speed in record.rows), None)
    if joint is None:
        remedy = "measure it, or take it out of the states"
        raise ParameterError(f"{drive.path.name}: nothing measured tells of the state {state!r}; {remedy}.")
    row = record.rows[joint.speed]
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (row[1:] + row[:-1]))]) / record.rate
    return summed, 0.1 * float(np.std(summed)) + 1e-12


def window_length(drive: Drive, courses: Sequence[Course], scales: Sequence[Scales]) -> float:
    """Length of a window [s]: as stated, else some swings, and short enough that there are enough windows."""
    if drive.windows is not None:
        return float(drive.windows)
    whole = sum(len(c.u) / c.rate for c in courses) * (1.0 - drive.held_out)
    return max(min(_WINDOW * scales[0].T, whole / WINDOWS), _LEAST_WINDOW / min(c.rate for c in courses))
