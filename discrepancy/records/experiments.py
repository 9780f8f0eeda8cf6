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
from discrepancy.indexer.reading import of_its_rate
from discrepancy.indexer.windows import LEAST_WINDOWS, windows_of
from discrepancy.noise import limited_noise, noise_of, shared_noise
from discrepancy.records.conditions import grouped
from discrepancy.records.division import divided
from discrepancy.records.likeness import ALIKE, LIKENESS, check_likeness, checked_motion, other_stations
from discrepancy.records.matching import likest, likest_other, nominal_orders, upright
from discrepancy.records.offset import first_dwell_of, without_offset
from discrepancy.records.reading import Record
from discrepancy.records.speed import by_pulses, check_period, put_right, speed_known_to
from discrepancy.records.start import start_of
from indexer_env.errors import ParameterError, SignalError, SimulationError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_records.resample import CUTOFF, entire

_TURN = 2.0 * math.pi

_WHOLE_RATIO = 1e-3
"""Motor turns by which a turn of the table may differ from a whole number of them: some tens add up to nothing."""

_RATE = 1000.0
"""Sampling rate [Hz] that tells what a machine lacks: its modes lie below 100 Hz."""


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
    # rates that are one but for their clocks must not be thinned by different factors
    every = int(min(record.signal.sample_rate for record in records) // _RATE)
    for record, noise in zip(records, _noises(records), strict=True):
        experiment, said = _checked(record, machine, sensor, noise, every, check_motion)
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
    _check_windows("fitted", fitted, machine)
    _check_windows("held out", held, machine)
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


_Noise = tuple[float, float]
"""Standard deviation and correlation from sample to sample."""


def _noises(records: Sequence[Record]) -> list[_Noise]:
    """The noise of each record as it was measured: of those for which none is stated, that of all of one unit together,
    as one sensor took them. Their rates differ by what their clocks are off."""
    alike: dict[str, list[Signal]] = {}
    for signal in (record.signal for record in records if record.conditions.noise is None):
        alike.setdefault(signal.unit, []).append(signal)
    shared = {unit: shared_noise([one.values for one in those], those[0].sample_rate) for unit, those in alike.items()}
    return [
        noise_of(r.signal.values, r.signal.sample_rate) if r.conditions.noise is not None else shared[r.signal.unit]
        for r in records
    ]


def _thinned(record: Record, sensor: Sensor, noise: _Noise, every: int) -> tuple[Record, _Noise]:
    """A record at about `_RATE` where it has twice as much or more, as what moves lies far below half of that, and its
    noise, which is told above that band. A sensor with a bracket or a low-pass reads at the record's rate: at a lower
    one they would be others."""
    signal, rate = record.signal, record.signal.sample_rate
    if every < 2 or of_its_rate(sensor):
        return record, noise
    target = rate / every
    values = entire(signal.values, rate, target)
    spread, colour = noise
    stated, limit = record.conditions.noise, CUTOFF * target
    estimate = limited_noise(stated or spread, colour, rate, limit, target)
    conditions = record.conditions if stated is None else dataclasses.replace(record.conditions, noise=estimate[0])
    thin = Signal(values, target, unit=signal.unit, source=signal.source)
    return dataclasses.replace(record, signal=thin, conditions=conditions), estimate


def _checked(
    record: Record, machine: Machine, sensor: Sensor, noise: _Noise, every: int, check_motion: bool
) -> tuple[Experiment, list[str]]:
    measured_at = record.signal.sample_rate
    cam_turn = 2.0 * math.pi / (machine.reduction * record.conditions.motor_speed)
    if record.signal.duration < cam_turn:
        raise SignalError(
            f"{record.name} must hold a whole cam turn, {cam_turn:.3g} s at the speed stated, got "
            f"{record.signal.duration:.3g} s; record for longer, or leave it out, or write the unit of its time column "
            "into the heading where that is not the second."
        )
    record, estimate = _thinned(record, sensor, noise, every)
    signal, stated = record.signal, record.conditions
    notes: list[str] = []
    if signal.sample_rate < measured_at:
        notes.append(f"{record.name} is taken at {signal.sample_rate:g} Hz of its {measured_at:g} Hz")
    if signal.unit != sensor.unit:
        remedy = "state sensor_radius" if sensor.radius is None else "leave sensor_radius out"
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
