"""Whether a record is of the nominal machine: by its likeness, its level, and other motions that it is more like."""

from __future__ import annotations

from discrepancy.records.matching import Match
from discrepancy.records.reading import Record
from discrepancy.records.speed import stated_rpm
from indexer_env.errors import SignalError
from indexer_env.sensors import Sensor
from indexer_env.units import DEGREE
from indexer_records.acceleration_units import STANDARD_GRAVITY

LIKENESS = 0.95
"""Likeness below which a record is not of this machine: what else acts would be a third of the motion."""

ALIKE, _NEARER = 0.995, 0.25
"""Below the first another motion law or share may be the record's: one whose likeness falls short of 1 by less than the
second times as much. Another law makes it 0.95 to 0.992, strong effects 0.97; most leave it above 0.997. What bends a
motion towards another law leaves a third of the difference, that law itself next to nothing."""

INSIST = ", or set check_motion=false if they are right"
"""What a command adds to a sentence that takes a record for one of another motion, if it lets a user insist."""

_LEVEL = (0.6, 1.67)
"""Amplitude over the nominal machine's; kinematics fix it but for the sensor's gain. The next mistake is a factor of 2,
a diameter for a radius."""

_WHOLE, _APART = 0.015, 0.1
"""By how much a number of stations that would make the level may be off a whole one, relatively, and at most in
stations, as of many stations each level is near some number."""

_UNITS = {
    STANDARD_GRAVITY: "g for m/s^2", DEGREE: "deg/s^2 for rad/s^2", 1e-3: "mm/s^2 for m/s^2",
    1e-3 * STANDARD_GRAVITY: "mg for m/s^2",
}  # fmt: skip
"""What one of the first unit is worth in the second."""


def check_likeness(record: Record, match: Match, sensor: Sensor) -> None:
    """Refuse a record that does not look like the nominal machine, or has another level."""
    if match.likeness < LIKENESS:
        raise SignalError(
            f"{record.name} must look like the nominal machine, likeness {LIKENESS:g} or more in the first orders of "
            f"the cam, got {match.likeness:.3f}; check the motor speed stated, {stated_rpm(record)}, motion_law and "
            "motion_share, a sensor that is AC-coupled (sensor.highpass_hz), or whose record it is."
        )
    if not _LEVEL[0] <= match.level <= _LEVEL[1]:
        raise SignalError(
            f"{record.name}: the level must be {_LEVEL[0]:g} to {_LEVEL[1]:g} times the nominal machine's, got "
            f"{match.level:.3g} times; {_guess(match.level, sensor)}."
        )


def other_stations(record: Record, level: float, stations: int) -> list[str]:
    """A table that turns by another angle in each index moves like this one with another gain."""
    other = stations / level
    if round(other) == stations or abs(other - round(other)) > min(_WHOLE * round(other), _APART):
        return []
    return [
        f"{record.name} has {level:.3g} times the nominal machine's level, as a table with {round(other)} stations "
        f"would have; check machine.stations, {stations}, before you believe in a wrong gain"
    ]


def checked_motion(record: Record, own: float, other: tuple[str, float], refuses: bool) -> list[str]:
    """Refuse a record that is much more like another motion, in words with its likeness, than like the machine's own,
    or say so."""
    words, likeness = other
    if own >= ALIKE or 1.0 - likeness >= _NEARER * (1.0 - own):
        return []
    both = f"likeness {own:.3f} in the first orders of the cam and {likeness:.3f} with {words}"
    if refuses:
        raise SignalError(
            f"{record.name} must look more like the nominal machine than like one with another motion, got {both}; "
            f"correct motion_law or motion_share{INSIST}."
        )
    return [f"{record.name} looks more like a machine with another motion ({both}); the stated one is taken"]


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
