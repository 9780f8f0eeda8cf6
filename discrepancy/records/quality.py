"""What is wrong with records whatever the machine: a dead or clipped sensor, a low rate, too few turns."""

from __future__ import annotations

import math
from collections.abc import Sequence

from discrepancy.records.reading import Record
from indexer_env.errors import SignalError
from indexer_env.machine import Machine
from indexer_env.units import RPM
from indexer_records.quality import is_clipped, is_dead, quality_columns

_DEAD = 0.02
"""Share of a record in one run of equal samples at which its sensor counts as dead for that time; a dwell of a machine
without noise is the longest that a live one can show, and no real sensor is without noise."""

_CLIPPED = 2e-3
"""Share of samples at flat tops above which a record is refused: it lacks the peaks, where the machine shows most."""

_LEAST_TURNS = 2.0
"""Turns of the table that all records must hold together: what repeats once a turn cannot be told from less."""

_LEAST_RATE = 100.0
"""Sampling rate [Hz] below which the vibration that an index leaves, some tens of Hz, is not in a record."""

_NOISE_RATE = 200.0
"""Sampling rate [Hz] below which the motion is taken for noise: at 125 Hz noise of 0.5 % of the spread counts as up to
ten times as much, at 200 Hz as 1.4 times at most."""


def check_records(records: Sequence[Record], machine: Machine) -> None:
    """Refuse records that no fit should see.

    Raises
    ------
    SignalError
        The first one that is dead or clipped, a rate that is too low, fewer than `_LEAST_TURNS` turns in all.
    """
    for record in records:
        _check_sensor(record)
        _check_rate(record)
    first = records[0]
    turns = sum(r.signal.duration * r.conditions.motor_speed for r in records)
    turns /= 2.0 * math.pi * machine.stations * machine.reduction_ratio
    if turns < _LEAST_TURNS:
        raise SignalError(
            f"The records must hold {_LEAST_TURNS:g} turns of the table or more in all, got {turns:.2f} with a "
            f"motor at {first.conditions.motor_speed / RPM:.4g} rpm, as stated for {first.name}; record for longer, or "
            "correct the speed."
        )


def _check_rate(record: Record) -> None:
    rate = record.signal.sample_rate
    if rate < _LEAST_RATE:
        raise SignalError(
            f"The records must be sampled at {_LEAST_RATE:g} Hz or more, got {rate:g} Hz in {record.name}; record with "
            "a higher rate."
        )
    if record.conditions.noise is None and rate < _NOISE_RATE:
        raise SignalError(
            f"The noise must be stated for records sampled below {_NOISE_RATE:g} Hz, where it cannot be told from the "
            f"motion, got {rate:g} Hz and none in {record.name}; state noise, or record with a higher rate."
        )


def _check_sensor(record: Record) -> None:
    shares = quality_columns(record.signal.values[None])[0]
    if is_dead(**shares, most=_DEAD):
        time = shares["constant_share"] * record.signal.duration
        raise SignalError(
            f"{record.name} must vary throughout, got one value for {time:.3g} s on end; check the sensor and its "
            "cable."
        )
    if is_clipped(record.signal.values, shares["clipped_share"], _CLIPPED):
        raise SignalError(
            f"{record.name} must stay inside the sensor's range, got {shares['clipped_share']:.2%} of its samples at "
            "flat tops; choose a larger range and record again."
        )
