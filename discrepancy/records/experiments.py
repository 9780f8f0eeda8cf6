"""Records -> experiments whose speed, start angle and level have been checked against the nominal machine.

What is slightly off is put right and said; what cannot be is refused, before any fit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer import Experiment
from discrepancy.indexer.windows import LEAST_WINDOWS, windows_of
from discrepancy.records.conditions import grouped
from discrepancy.records.division import divided
from discrepancy.records.likeness import ALIKE, LIKENESS, check_likeness, checked_motion, other_stations
from discrepancy.records.matching import likest, likest_other, nominal_orders, upright
from discrepancy.records.offset import first_dwell_of, without_offset
from discrepancy.records.rates import Noise, at_rate_of_all, noises
from discrepancy.records.reading import Record
from discrepancy.records.speed import by_pulses, check_period, put_right, speed_known_to
from discrepancy.records.start import start_of
from indexer_env.errors import ParameterError, SignalError, SimulationError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal

_TURN = 2.0 * math.pi

_WHOLE_RATIO = 1e-3
"""Motor turns by which a turn of the table may differ from a whole number of them: some tens add up to nothing."""


@dataclass(frozen=True, eq=False)
class Experiments:
    """What is fitted and what is held out.

    Attributes
    ----------
    fitted, held_out : tuple of Experiment
    notes : tuple of str
        What was put right or assumed, one sentence each.
    """

    fitted: tuple[Experiment, ...]
    held_out: tuple[Experiment, ...]
    notes: tuple[str, ...]


def experiments(
    records: Sequence[Record], machine: Machine, sensor: Sensor, *, check_motion: bool = True
) -> Experiments:
    """Checked experiments of records, divided into those to fit and those to hold out.

    Without `check_motion` a record that looks more like another motion law, or motion share, is taken all the same.

    Raises
    ------
    SignalError
        A record at another speed, angle or level than stated, of another machine, or too short.
    ParameterError
        The nominal machine cannot run at a record's conditions.
    """
    made, notes = [], []
    lowest = min(record.signal.sample_rate for record in records)
    for record, noise in zip(records, noises(records), strict=True):
        experiment, said = _checked(record, machine, sensor, noise, lowest, check_motion)
        made.append(experiment)
        notes += said
    notes += _apart(made, machine)
    kept = [record.conditions.held_out for record in records]
    if all(kept):
        raise SignalError("One record or more must be left to fit, got all of them held out; hold out fewer.")
    if any(kept):
        fitted = tuple(e for e, held in zip(made, kept, strict=True) if not held)
        held = tuple(e for e, out in zip(made, kept, strict=True) if out)
    else:
        notes.append(
            "a third or a half of each record is held out, as no whole one is; a record at another speed would prove "
            "more"
        )
        fitted, held = divided(made, machine)
    _check_windows(fitted, held, machine)
    if len(grouped([e.operating_point.motor_speed for e in made])[1]) == 1:
        notes.append("all records are at one speed, at which effects can mimic each other; record at a second one")
    return Experiments(fitted, held, tuple(notes))


def _apart(made: Sequence[Experiment], machine: Machine) -> list[str]:
    """What records do not have in common for want of start angles."""
    if len(made) < 2:
        return []
    said = []
    if any(experiment.start_compared for experiment in made):
        said.append(
            "records without a start angle or a pulse are not known to begin at the same station, so that what single "
            "stations do is not found in them together; state start_angle, or record a pulse"
        )
    ratio, turn = machine.stations / machine.reduction, _TURN * machine.stations
    through = any(abs(experiment.operating_point.start_angle) > turn for experiment in made)
    if abs(ratio - round(ratio)) > _WHOLE_RATIO and not through:
        said.append(
            f"the motor turns {ratio:.6g} times in a turn of the table, no whole number, so that what turns with it is "
            f"found in several records together only where start_angle counts the turns of the table through, "
            f"{math.degrees(turn):g}° for each"
        )
    return said


def _check_windows(fitted: Sequence[Experiment], held: Sequence[Experiment], machine: Machine) -> None:
    """Refuse a part whose records hold too few cam turns, or one that holds none."""
    parts = {"fitted": fitted, "held out": held}
    files = {part: [e.signal.source for e in those] for part, those in parts.items()}
    counts = {
        part: np.bincount(windows_of(those, machine.reduction).record, minlength=len(those)).tolist()
        for part, those in parts.items()
    }
    total = {part: sum(each) for part, each in counts.items()}
    for part, own in total.items():
        if own >= LEAST_WINDOWS:
            continue
        if set(files["fitted"]) & set(files["held out"]):
            rule = f"The records must hold {LEAST_WINDOWS} whole cam turns or more to fit and as many to hold out"
            got, number = f"{total['fitted']} and {total['held out']}", len(parts)
        else:
            rule, got, number = f"The records {part} must hold {LEAST_WINDOWS} whole cam turns or more in all", own, 1
        raise SignalError(
            f"{rule}, from dwell to dwell, got {got} in {', '.join(dict.fromkeys(files[part]))}; record "
            f"{_turns_for(number, machine):g} turns or more of this table of {machine.stations} stations."
        )
    for part, each in counts.items():
        for file, windows in zip(files[part], each, strict=True):
            if not windows:
                raise SignalError(
                    f"{file} must hold a whole cam turn, from dwell to dwell, in the part {part}, got none; record for "
                    "longer, or leave it out."
                )


def _turns_for(parts: int, machine: Machine) -> float:
    """Turns of the table in which each of so many parts holds `LEAST_WINDOWS`, wherever it begins: one cam turn more
    each, rounded up to tenths."""
    return math.ceil(10.0 * parts * (LEAST_WINDOWS + 1) / machine.stations) / 10.0


def _checked(
    record: Record, machine: Machine, sensor: Sensor, noise: Noise, lowest: float, check_motion: bool
) -> tuple[Experiment, list[str]]:
    measured_at = record.signal.sample_rate
    cam_turn = 2.0 * math.pi / (machine.reduction * record.conditions.motor_speed)
    if record.signal.duration < cam_turn:
        raise SignalError(
            f"{record.name} must hold a whole cam turn, {cam_turn:.3g} s at the speed stated, got "
            f"{record.signal.duration:.3g} s; record for longer, or leave it out, or write the unit of its time column "
            "into the heading where that is not the second."
        )
    record, estimate = at_rate_of_all(record, sensor, noise, lowest)
    signal, stated = record.signal, record.conditions
    notes: list[str] = []
    if signal.sample_rate < measured_at:
        notes.append(f"{record.name} is taken at {signal.sample_rate:g} Hz of its {measured_at:g} Hz")
    if signal.unit != sensor.unit:
        remedy = "leave sensor_radius out"
        if sensor.radius is None:
            remedy = "state it by known.sensor_radius=0.35 (m), or as sensor_radius in records.csv or records.yaml,"
        raise SignalError(
            f"{record.name} must be in {sensor.unit} as the sensor reads, got {signal.unit}; {remedy} or correct the "
            "unit."
        )
    speed = by_pulses(record, machine)
    slower = None
    if speed is None:
        speed = stated.motor_speed
        slower = check_period(record, machine)
    point = OperatingPoint(speed, stated.load_torque)
    try:
        nominal = nominal_orders(machine, point, sensor, signal.sample_rate)
    except (ParameterError, SimulationError) as error:
        # What follows the semicolon is a remedy for those who simulate.
        why = str(error).partition(";")[0].rstrip(".")
        raise ParameterError(
            f"The nominal machine must run at the conditions of {record.name}, but {why}; correct its parameters."
        ) from None
    signal, match, said = upright(record.name, signal, machine.reduction * speed, nominal, LIKENESS)
    record = dataclasses.replace(record, signal=signal)
    notes += said
    if slower is not None and match.likeness < LIKENESS:
        raise slower
    check_likeness(record, match, sensor)
    notes += other_stations(record, match.level, machine.stations)
    if match.likeness < ALIKE:
        seen = signal, machine.reduction * speed, machine, point, sensor
        notes += checked_motion(record, likest(*seen), likest_other(*seen), check_motion)
    if slower is not None:
        notes.append(f"{record.name} repeats itself only after several cam turns, as a machine may that is shaken hard")
    if record.pulses is None or len(record.pulses) < 2:
        speed, said = put_right(record, speed, match, machine.reduction)
        notes += said
    first_dwell = first_dwell_of(machine.motion_share, match.start_angle)
    record, said = without_offset(record, machine.reduction * speed, first_dwell, sensor.offset)
    notes += said
    signal = record.signal
    spread = speed_known_to(record, machine.reduction * speed)
    start, known_to, said = start_of(record, machine, speed, spread, match)
    notes += said
    named = Signal(signal.values, signal.sample_rate, unit=signal.unit, source=record.name)
    point = OperatingPoint(speed, stated.load_torque, start)
    if stated.noise is None and sensor.lowpass_hz is not None:
        notes.append(
            f"{record.name}: the noise is estimated from the record, of which the sensor's low-pass filter may have "
            "taken a part; state noise where it comes from before the filter"
        )
    compared = stated.start_angle is None and record.pulses is None
    made = Experiment(
        named, point, stated.noise, known_to, spread, inertia_uncertainty=stated.inertia_uncertainty,
        estimate=estimate, start_compared=compared,
    )  # fmt: skip
    return made, notes
