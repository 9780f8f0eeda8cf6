"""A record of today with what it says itself of its speed, start and sign in the place of what was stated."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.noise import limited_noise
from discrepancy.records.conditions import Conditions
from discrepancy.records.matching import Match, upright
from discrepancy.records.offset import first_dwell_of, without_offset
from discrepancy.records.reading import Record
from discrepancy.records.speed import by_pulses, put_right
from discrepancy.records.start import pulse_start
from indexer_env.errors import SignalError
from indexer_env.operating_point import OperatingPoint
from indexer_env.signal import Signal
from indexer_records.resample import CUTOFF, entire
from twin.remains import Remains
from twin.turns import Healthy, likeliest_station

_LIKENESS, _LEVEL = 0.9, (0.5, 2.0)
"""Likeness to the healthy machine in the first orders of the cam, and level over its own, outside of which a record is
none of this machine: faults of the table leave 0.95 and 0.7 to 1.4."""

BY_COMPARISON = 0.01
"""rad; standard deviation of a start angle found by comparison."""

_SAME_RATE = 1e-3
"""Relative difference of sampling rates that are the same [-]."""

_STATED_SLACK = 0.1
"""rad; a stated cam angle that is farther from the record's own is wrong."""

_SPEED_SLACK = 0.015
"""rad; cam angle over the record that a stated speed may be off by: imbalance makes the phase waver by as much, and
from twice as much on a healthy turn raises an alarm."""


@dataclass(frozen=True, eq=False)
class Corrected:
    """A record as it is compared.

    Attributes
    ----------
    signal : Signal
        At the twin's rate, with its sign and without an offset of its own.
    conditions : Conditions
        With the record's own mean speed, the cam angle of the first sample, and the noise at the twin's rate.
    reference : ndarray (stations, cells)
        The healthy turn at this point.
    stations_known : bool
        Whether the cam angle tells the station; else it is the one by which the record is most like a healthy one.
    notes : tuple of str
        What was put right.
    """

    signal: Signal
    conditions: Conditions
    reference: np.ndarray
    stations_known: bool
    notes: tuple[str, ...]

    @property
    def point(self) -> OperatingPoint:
        """Its speed and load."""
        return OperatingPoint(self.conditions.motor_speed, self.conditions.load_torque)


def at_rate(signal: Signal, rate: float) -> Signal:
    """A signal at the twin's rate [Hz]; raises SignalError where its own is lower."""
    if signal.sample_rate < (1.0 - _SAME_RATE) * rate:
        name, got = signal.source or "the record", signal.sample_rate
        raise SignalError(
            f"{name} must be sampled at the twin's {rate:g} Hz or more, got {got:g} Hz; record at this rate, or make a "
            "twin of records at the lower one."
        )
    if signal.sample_rate < (1.0 + _SAME_RATE) * rate:
        return signal
    values = entire(signal.values, signal.sample_rate, rate)
    return Signal(values, rate, unit=signal.unit, source=signal.source)


def corrected(
    name: str, signal: Signal, conditions: Conditions, pulses: Sequence[float] | np.ndarray | None, healthy: Healthy,
    remains: Remains,
) -> Corrected:  # fmt: skip
    """The record put right by itself; `pulses` are the times of its once-per-turn pulse after the first sample [s],
    `remains` what healthy records leave.

    Raises
    ------
    SignalError
        Another machine, rate or speed, or a cam angle that is not the record's.
    """
    machine = healthy.machine
    conditions = _noise_at(conditions, signal.sample_rate, healthy.cells.rate)
    record = Record(name, at_rate(signal, healthy.cells.rate), conditions, None if pulses is None else np.array(pulses))
    counted = by_pulses(record, machine)
    speed = conditions.motor_speed if counted is None else counted
    reference = healthy.turn(OperatingPoint(speed, conditions.load_torque))
    signal, match, notes = _seen(record.signal, machine.reduction * speed, reference, name)
    if counted is None:
        speed, said = put_right(record, speed, match, machine.reduction, _SPEED_SLACK)
        if said:
            reference, notes = healthy.turn(OperatingPoint(speed, conditions.load_torque)), [*notes, *said]
    cam_rate, turned = machine.reduction * speed, dataclasses.replace(record, signal=signal)
    first_dwell = first_dwell_of(machine.motion_share, match.start_angle)
    level, said = without_offset(turned, cam_rate, first_dwell, healthy.sensor.offset)
    signal, notes = level.signal, [*notes, *said]
    start = conditions.start_angle
    if start is None and record.pulses is not None and len(record.pulses):
        start = pulse_start(record, machine, speed)
    known = start is not None
    if start is None:
        start = match.start_angle
    later = (match.start_angle - start + np.pi) % (2.0 * np.pi) - np.pi
    off, slack = abs(later), max(_STATED_SLACK, 3.0 * conditions.start_uncertainty)
    if off > slack:
        raise SignalError(
            f"{name}: the cam angle at the first sample must agree with the record within {slack:g} rad, "
            f"got {off:.2f} rad ({math.degrees(off):.1f}°) off; correct start_angle or pulse_angle, or leave it out."
        )
    if known and conditions.start_uncertainty > BY_COMPARISON:
        start += later
        conditions = dataclasses.replace(conditions, start_uncertainty=BY_COMPARISON)
        said = (
            f"{name}: its cam angle is stated less exactly than the record itself tells it, and is told by the record"
        )
        notes = [*notes, f"{said}; the station is the one stated"]
    if not known:
        point = OperatingPoint(speed, conditions.load_torque)
        turns = healthy.cells.turns(signal.values, cam_rate, start, signal.sample_rate)
        station = likeliest_station(turns, reference + remains.at(point)) if len(turns) else 0
        start += 2.0 * np.pi * station
        notes = [*notes, f"{name}: no start angle or pulse is stated, so that no station can be told by its number"]
    if conditions.inertia_uncertainty > 0.0:
        said = f"{name}: the networks know one inertia of the table; inertia_uncertainty is for physics alone"
        notes = [*notes, said]
    told = dataclasses.replace(conditions, motor_speed=speed, start_angle=start)
    return Corrected(signal, told, reference, known, tuple(notes))


def _noise_at(conditions: Conditions, rate: float, target: float) -> Conditions:
    """A stated noise, white at the record's rate, as it is at the twin's."""
    if conditions.noise is None or rate < (1.0 + _SAME_RATE) * target:
        return conditions
    noise, _ = limited_noise(conditions.noise, 0.0, rate, CUTOFF * target, target)
    return dataclasses.replace(conditions, noise=noise)


def _seen(signal: Signal, cam_rate: float, reference: np.ndarray, name: str) -> tuple[Signal, Match, list[str]]:
    """The signal with the healthy machine's sign, and how it compares with its turn."""
    mean = reference.mean(axis=0)
    orders = np.fft.rfft(mean)[1:7] * 2.0 / len(mean)
    orders = orders * np.exp(-1j * np.arange(1, 7) * np.pi / len(mean))
    signal, match, notes = upright(name, signal, cam_rate, orders, _LIKENESS)
    if match.likeness < _LIKENESS:
        raise SignalError(
            f"{name} does not move as this machine does: the shapes of the motion are {_percent(match.likeness)} alike "
            f"({100.0 * _LIKENESS:g} or more allowed); check its speed, its sensor and whose record it is."
        )
    if not _LEVEL[0] <= match.level <= _LEVEL[1]:
        raise SignalError(
            f"{name} is {match.level:.3g} times as strong as this machine's records ({_LEVEL[0]:g} to {_LEVEL[1]:g} "
            "allowed); check its unit, its sensor's radius and whose record it is."
        )
    return signal, match, notes


def _percent(likeness: float) -> str:
    """In as many digits as tell it from the least that is allowed; a shape upside down is not alike at all."""
    return f"{math.floor(1000.0 * max(0.0, likeness)) / 10.0:g} %"
