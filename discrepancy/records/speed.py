"""The motor speed of a record: by its pulses, by the time after which it repeats, by its phase from turn to turn."""

from __future__ import annotations

import math

import numpy as np

from discrepancy.indexer.windows import Experiment
from discrepancy.records.matching import Match
from discrepancy.records.period import LONGEST, SHORTEST, cam_period
from discrepancy.records.reading import Record
from indexer_env.errors import SignalError
from indexer_env.machine import Machine
from indexer_env.units import RPM

_TURN = 2.0 * math.pi

SPEED_TOLERANCE = 0.02
"""Relative error of a stated speed that is put right; more is another speed. An induction motor's rated slip is about
this much."""

_ANGLE_SPREAD = 0.02
"""Cam angle [rad] over the record to which its own phase gives the speed: standard deviation."""

_ANGLE_SLACK = 0.05
"""Cam angle [rad] over the record that a stated speed may be off by before it is put right: imbalance makes the phase
of the turns waver by up to 0.015."""


def by_pulses(record: Record, machine: Machine) -> float | None:
    """Mean motor speed [rad/s] by the once-per-turn pulses; None where there are not two.

    Raises
    ------
    SignalError
        Pulses that do not come evenly, or at another speed than stated.
    """
    if record.pulses is None or len(record.pulses) < 2:
        return None
    spacing = np.diff(record.pulses)
    if spacing.max() > (1.0 + SPEED_TOLERANCE) * spacing.min():
        raise SignalError(
            f"{record.name}: the pulses must come evenly within {SPEED_TOLERANCE:.0%}, got {spacing.min():.4g} to "
            f"{spacing.max():.4g} s; set pulse.threshold where some are missed or come twice, or cut the record where "
            "the speed is steady."
        )
    turn = _TURN * machine.stations * machine.reduction_ratio
    _check_one_a_turn(record, turn / record.conditions.motor_speed / float(spacing.mean()))
    speed = turn / float(spacing.mean())
    if abs(speed / record.conditions.motor_speed - 1.0) > SPEED_TOLERANCE:
        raise wrong_speed(record, speed, "by the pulses")
    return speed


def _check_one_a_turn(record: Record, often: float) -> None:
    """Refuse pulses that come `often` in a turn of the table at the speed stated, where that is a whole number of
    times, or once in a whole number of turns."""
    several, got = max(often, 1.0 / often), f"{often:.4g} in each"
    if often < 1.0:
        got = f"one in {1.0 / often:.4g} turns"
    if round(several) > 1 and abs(several / round(several) - 1.0) < SPEED_TOLERANCE:
        raise SignalError(
            f"{record.name}: there must be one pulse in each turn of the table, got {got} at the {stated_rpm(record)} "
            "stated; take the pulse from the table, set pulse.threshold, or leave pulse.column out."
        )


def speed_known_to(record: Record, cam_rate: float) -> float:
    """Relative standard deviation of the mean speed: as stated, by the first and last pulse, or by the record. The mean
    over the pulses is another one than that over the record where the speed drifts and their middles differ."""
    stated = record.conditions
    if stated.speed_uncertainty is not None:
        return stated.speed_uncertainty
    if record.pulses is None or len(record.pulses) < 2:
        return _ANGLE_SPREAD / (cam_rate * record.signal.duration)
    first, last, duration = float(record.pulses[0]), float(record.pulses[-1]), record.signal.duration
    drifted = Experiment.drift_uncertainty * (0.5 * (first + last) / duration - 0.5)
    return math.hypot(math.sqrt(2.0) * stated.start_uncertainty / (cam_rate * (last - first)), drifted)


def check_period(record: Record, machine: Machine) -> SignalError | None:
    """Refuse a record that does not repeat at the speed stated; the refusal is handed back where it repeats after two
    or more of the cam turns expected, as the right speed may show it too."""
    expected = _TURN / (machine.reduction * record.conditions.motor_speed)
    found = cam_period(record.signal.values, record.signal.sample_rate, expected)
    if found is not None and abs(found / expected - 1.0) > SPEED_TOLERANCE:
        how = f"as it repeats every {found:.4g} s"
        wrong = wrong_speed(record, record.conditions.motor_speed * expected / found, how)
        turns = round(found / expected)
        if turns < 2 or abs(found / (turns * expected) - 1.0) > SPEED_TOLERANCE:
            raise wrong
        return wrong
    if found is None and record.signal.duration > 2.2 * expected:
        looked_at = f"{SHORTEST * expected:.2g} to {LONGEST * expected:.2g} s"
        raise SignalError(
            f"{record.name} must repeat with the cam, every {expected:.4g} s at the {stated_rpm(record)} stated, got "
            f"nothing that repeats every {looked_at}; check the sensor and the speed, motor_speed_rpm in rpm or "
            "motor_speed in rad/s."
        )
    return None


def put_right(
    record: Record, speed: float, match: Match, reduction: float, slack: float = _ANGLE_SLACK
) -> tuple[float, list[str]]:
    """The speed [rad/s], put right where the record shows another by more than `slack` of the cam's angle [rad] over
    its length, and the sentence that says so."""
    if abs(match.speed - 1.0) > SPEED_TOLERANCE:
        raise wrong_speed(record, speed * match.speed, "by its phase from turn to turn")
    turned = reduction * speed * record.signal.duration
    if abs(match.speed - 1.0) * turned < slack:
        return speed, []
    right = speed * match.speed
    return right, [f"{record.name}: the mean speed is {right / RPM:.2f} rpm by the record, {speed / RPM:.2f} stated"]


def wrong_speed(record: Record, speed: float, how: str) -> SignalError:
    """The refusal of a record that shows another speed [rad/s] than stated, and how it does."""
    return SignalError(
        f"{record.name}: the motor speed must be that of the record within {SPEED_TOLERANCE:.0%}, got "
        f"{stated_rpm(record)} stated and {speed / RPM:.5g} rpm by the record, {how}; "
        "correct motor_speed_rpm, or the machine's reduction_ratio."
    )


def stated_rpm(record: Record) -> str:
    """The speed stated, as people say it."""
    return f"{record.conditions.motor_speed / RPM:.5g} rpm"
