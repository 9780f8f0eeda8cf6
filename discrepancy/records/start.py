"""The cam angle at a record's first sample: as stated, by its once-per-turn pulse, or by comparison."""

from __future__ import annotations

import math

from discrepancy.records.matching import Match
from discrepancy.records.reading import Record
from indexer_env.errors import SignalError
from indexer_env.machine import Machine

_TURN = 2.0 * math.pi

_TOLERANCE = 0.5
"""Cam angle [rad] that a stated start angle may be off by: elasticity and 20° of play make a few hundredths, a low-pass
filter of 40 ms 0.24."""

_NOTED = 0.1
"""Cam angle [rad] from which on it is said."""

_BY_COMPARISON = 0.01
"""Standard deviation of a start angle found by comparison [rad]: what elasticity and play move the table by."""


def start_of(
    record: Record, machine: Machine, speed: float, speed_spread: float, match: Match
) -> tuple[float, float, list[str]]:
    """Cam angle at the first sample [rad], its standard deviation [rad] and what is to be said of it.

    Parameters
    ----------
    record : Record
    machine : Machine
    speed, speed_spread : float
        Mean motor speed, put right [rad/s], and its relative standard deviation.
    match : Match
        The record against the nominal machine.

    Raises
    ------
    SignalError
        The angle stated is not that of the record, or not that of the pulse whose angle is stated as well.
    """
    stated, notes = record.conditions, []
    start, known_to = stated.start_angle, stated.start_uncertainty
    if record.pulses is not None:
        table_turn, turned = _TURN * machine.stations, machine.reduction * speed * float(record.pulses[0])
        by_pulse = pulse_start(record, machine, speed)
        if start is None:
            # what the speed is off by has been turned until the pulse came
            start, known_to = by_pulse, math.hypot(known_to, turned * speed_spread)
        elif stated.pulse_angle is not None and _apart(start, by_pulse, table_turn) > _TOLERANCE:
            raise SignalError(
                f"{record.name}: the cam angle at the first sample must be one within {_TOLERANCE:g} rad, got "
                f"{start % table_turn:.3f} rad stated and {by_pulse:.3f} rad by the pulse, modulo a turn of the table; "
                "correct start_angle or pulse_angle, or leave one out."
            )
    if start is None:
        start, known_to = match.start_angle, _BY_COMPARISON
        notes.append(
            f"{record.name}: the start angle is not stated; {start:.3f} rad by comparison with the nominal machine, "
            "its first station taken for station 0"
        )
    off = _apart(start, match.start_angle, _TURN)
    if off > _TOLERANCE:
        whence, remedy = "stated", "correct start_angle or pulse_angle"
        if stated.start_angle is None:
            angle = stated.pulse_angle or 0.0
            fits = _degrees((angle + match.start_angle - start) % _TURN)
            whence = f"by the pulse, whose angle is {'stated as' if stated.pulse_angle is not None else 'taken for'} "
            whence += f"{_degrees(angle)},"
            remedy = f"correct pulse_angle_deg, of which {fits} or a whole number of cam turns more would fit"
        raise SignalError(
            f"{record.name}: the cam angle at the first sample must agree with the record within {_TOLERANCE:g} "
            f"rad, got {start % _TURN:.3f} rad ({_degrees(start % _TURN)}) {whence} and {match.start_angle:.3f} rad "
            f"({_degrees(match.start_angle)}) by the record; {remedy}."
        )
    if off > _NOTED:
        late = (start - match.start_angle) % _TURN < 0.5 * _TURN
        reads = "late, as behind a slow low-pass filter," if late else "early, as an AC-coupled one does,"
        whence = "stated" if stated.start_angle is not None else "by the pulse"
        notes.append(
            f"{record.name}: the start angle {whence} is {off:.2f} rad from that of the nominal machine's motion; only "
            f"a sensor that reads {reads} would explain it"
        )
    return start, known_to, notes


def pulse_start(record: Record, machine: Machine, speed: float) -> float:
    """Cam angle at the first sample [rad] by the first pulse of a record that has one."""
    assert record.pulses is not None
    turned = machine.reduction * speed * float(record.pulses[0])
    return ((record.conditions.pulse_angle or 0.0) - turned) % (_TURN * machine.stations)


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°"


def _apart(a: float, b: float, turn: float) -> float:
    """How far two angles [rad] are apart, modulo a turn."""
    return abs((a - b + 0.5 * turn) % turn - 0.5 * turn)
