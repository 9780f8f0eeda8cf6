"""Records -> experiments whose speed, start angle and level have been checked against the nominal machine.

What is slightly off is put right and said; what cannot be is refused, before any fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from datagen.measured import STANDARD_GRAVITY
from discrepancy.indexer import Experiment
from discrepancy.indexer.windows import LEAST_WINDOWS, windows_of
from discrepancy.records.matching import Match, matched, nominal_orders
from discrepancy.records.reading import Record
from discrepancy.records.speed import SPEED_TOLERANCE, by_pulse, check_period, put_right, wrong_speed
from indexer_env.errors import ParameterError, SignalError, SimulationError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal

_TURN = 2.0 * math.pi
_RPM = _TURN / 60.0

_ANGLE_SPREAD = 0.02
"""Standard deviation of the cam angle [rad] over the record that the speed, stated or put right, leaves to the fit."""

_ANGLE_TOLERANCE = 0.5
"""Cam angle [rad] that a stated start angle may be off by: elasticity and 20° of play make a few hundredths, a low-pass
filter of 40 ms 0.24."""

_ANGLE_NOTED = 0.1
"""Cam angle [rad] from which on it is said."""

_BY_COMPARISON = 0.01
"""Standard deviation of a start angle found by comparison [rad]: what elasticity and play move the table by."""

_LIKENESS = 0.98
"""Likeness below which a record is not of this machine; hidden effects leave it above 0.997, the
law next to modified sine, cycloidal, makes it 0.96."""

_LEVEL = (0.7, 1.43)
"""Amplitude over the nominal machine's; kinematics fix it but for the sensor's gain."""

_UNITS = {
    STANDARD_GRAVITY: "g for m/s^2", math.pi / 180.0: "deg/s^2 for rad/s^2", 1e-3: "mm/s^2 for m/s^2",
    1e-3 * STANDARD_GRAVITY: "mg for m/s^2",
}  # fmt: skip
"""What one of the first unit is worth in the second."""

FIT_SHARE = 2.0 / 3.0
"""Share of each record that is fitted where no record is held out as a whole."""


@dataclass(frozen=True, eq=False)
class Experiments:
    """What is fitted and what is held out.

    Attributes
    ----------
    fitted, held_out : tuple of Experiment
    names : tuple of str
        Records fitted, then those held out; the same twice where each is divided.
    notes : tuple of str
        What was put right or assumed, one sentence each.
    """

    fitted: tuple[Experiment, ...]
    held_out: tuple[Experiment, ...]
    names: tuple[tuple[str, ...], tuple[str, ...]]
    notes: tuple[str, ...]


def experiments(records: Sequence[Record], machine: Machine, sensor: Sensor) -> Experiments:
    """Checked experiments of records, divided into those to fit and those to hold out.

    Raises
    ------
    SignalError
        A record at another speed, angle or level than stated, of another machine, or too short.
    ParameterError
        The nominal machine cannot run at a record's conditions.
    """
    made, notes = [], []
    for record in records:
        experiment, said = _checked(record, machine, sensor)
        made.append(experiment)
        notes += said
    kept = [record.conditions.held_out for record in records]
    if all(kept):
        raise SignalError("One record or more must be left to fit, got all of them held out; hold out fewer.")
    if any(kept):
        fitted = tuple(e for e, held in zip(made, kept, strict=True) if not held)
        held = tuple(e for e, out in zip(made, kept, strict=True) if out)
    else:
        notes.append(
            "the last third of each record is held out, as no whole one is; a record at another speed would prove more"
        )
        fitted, held = (tuple(parts) for parts in zip(*(_divided(e, machine) for e in made), strict=True))
    _check_windows("fitted", fitted, machine)
    _check_windows("held out", held, machine)
    speeds = {round(e.operating_point.motor_speed / _RPM) for e in made}
    if len(speeds) == 1:
        notes.append("all records are at one speed, at which effects can mimic each other; record at a second one")
    names = tuple(tuple(e.signal.source for e in part) for part in (fitted, held))
    return Experiments(fitted, held, (names[0], names[1]), tuple(notes))


def _check_windows(part: str, those: Sequence[Experiment], machine: Machine) -> None:
    """Refuse a part whose records hold too few cam turns, or one that holds none."""
    held = np.bincount(windows_of(those, machine.reduction).record, minlength=len(those)).tolist()
    files = [e.signal.source for e in those]
    if sum(held) < LEAST_WINDOWS:
        raise SignalError(
            f"The records {part} must hold {LEAST_WINDOWS} whole cam turns or more in all, from dwell to dwell, got "
            f"{sum(held)} in {', '.join(files)}; record for longer."
        )
    for file, windows in zip(files, held, strict=True):
        if not windows:
            raise SignalError(
                f"{file} must hold a whole cam turn, from dwell to dwell, in the part {part}, got none; record for "
                "longer, or leave it out."
            )


def _checked(record: Record, machine: Machine, sensor: Sensor) -> tuple[Experiment, list[str]]:
    signal, stated = record.signal, record.conditions
    notes: list[str] = []
    if signal.unit != sensor.unit:
        remedy = "state sensor_radius" if sensor.radius is None else "leave sensor_radius out"
        raise SignalError(
            f"{record.name} must be in {sensor.unit} as the sensor reads, got {signal.unit}; {remedy} or correct the "
            "unit."
        )
    speed, start = by_pulse(record, machine)
    slower = None
    if speed is None:
        speed = stated.motor_speed
        slower = check_period(record, machine)
    elif abs(speed / stated.motor_speed - 1.0) > SPEED_TOLERANCE:
        raise wrong_speed(record, speed, "by the pulses")
    point = OperatingPoint(speed, stated.load_torque)
    try:
        nominal = nominal_orders(machine, point, sensor, signal.sample_rate)
    except (ParameterError, SimulationError) as error:
        # What follows the semicolon is a remedy for those who simulate.
        why = str(error).partition(";")[0].rstrip(".")
        raise ParameterError(
            f"The nominal machine must run at the conditions of {record.name}, but {why}; correct its parameters."
        ) from None
    match = matched(signal.values, signal.sample_rate, machine.reduction * speed, nominal)
    if slower is not None and match.likeness < _LIKENESS:
        raise slower
    _check_likeness(record, match, sensor)
    if slower is not None:
        notes.append(f"{record.name} repeats itself only after several cam turns, as a machine may that is shaken hard")
    if record.pulses is None or len(record.pulses) < 2:
        speed, said = put_right(record, speed, match, machine.reduction)
        notes += said
    start = stated.start_angle if start is None else start
    known_to = stated.start_uncertainty
    if start is None:
        start, known_to = match.start_angle, _BY_COMPARISON
        notes.append(
            f"{record.name}: the start angle is not stated; {start:.3f} rad by comparison with the nominal machine, "
            "its first station taken for station 0"
        )
    off = abs((start - match.start_angle + math.pi) % _TURN - math.pi)
    if off > _ANGLE_TOLERANCE:
        raise SignalError(
            f"{record.name}: the cam angle at the first sample must agree with the record within {_ANGLE_TOLERANCE:g} "
            f"rad, got {start % _TURN:.3f} rad stated and {match.start_angle:.3f} rad by the record; correct "
            "start_angle or pulse_angle."
        )
    if off > _ANGLE_NOTED:
        notes.append(
            f"{record.name}: the start angle stated is {off:.2f} rad from that of the nominal machine's motion; only a "
            "sensor that reads late, as behind a slow low-pass filter, would explain it"
        )
    named = Signal(signal.values, signal.sample_rate, unit=signal.unit, source=record.name)
    point = OperatingPoint(speed, stated.load_torque, start)
    turned = machine.reduction * speed * signal.duration
    by_pulses = record.pulses is not None and len(record.pulses) > 1
    spread = math.sqrt(2.0) * known_to if by_pulses else _ANGLE_SPREAD
    speed_known_to = stated.speed_uncertainty or spread / turned
    return Experiment(named, point, stated.noise, known_to, speed_known_to), notes


def _check_likeness(record: Record, match: Match, sensor: Sensor) -> None:
    if match.likeness < _LIKENESS:
        raise SignalError(
            f"{record.name} must look like the nominal machine, likeness {_LIKENESS:g} or more in the first orders of "
            f"the cam, got {match.likeness:.2f}; check motion_law and motion_share, or whose record it is."
        )
    if not _LEVEL[0] <= match.level <= _LEVEL[1]:
        raise SignalError(
            f"{record.name}: the level must be {_LEVEL[0]:g} to {_LEVEL[1]:g} times the nominal machine's, got "
            f"{match.level:.3g} times; {_guess(match.level, sensor)}."
        )


def _guess(level: float, sensor: Sensor) -> str:
    """What may be wrong where the level is."""
    units = {**_UNITS, **({} if sensor.radius is None else {sensor.radius: "rad/s^2 for m/s^2"})}
    for factor, words in units.items():
        first, _, second = words.partition(" for ")
        if 0.75 < level * factor < 1.33:
            return f"the unit looks like {first} where {second} is stated"
        if 0.75 < level / factor < 1.33:
            return f"the unit looks like {second} where {first} is stated"
    return "check the unit, the sensor's radius and gain, and the number of stations"


def _divided(experiment: Experiment, machine: Machine) -> tuple[Experiment, Experiment]:
    signal, point = experiment.signal, experiment.operating_point
    first = int(FIT_SHARE * len(signal.values))
    later = point.start_angle + machine.reduction * point.motor_speed * first / signal.sample_rate
    begun = first / signal.sample_rate
    parts = [(signal.values[:first], point.start_angle, 0.0), (signal.values[first:], later, begun)]
    made = [
        Experiment(
            Signal(values, signal.sample_rate, unit=signal.unit, source=signal.source),
            OperatingPoint(point.motor_speed, point.load_torque, start),
            experiment.noise,
            experiment.start_uncertainty,
            experiment.speed_uncertainty,
            since,
        )
        for values, start, since in parts
    ]
    return made[0], made[1]
