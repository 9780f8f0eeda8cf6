"""What a record must be to be compared with a twin, in one sentence where it is not; what networks see of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.records.conditions import Conditions
from indexer_env.errors import SignalError
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.quality import is_clipped, is_dead, quality_columns
from twin.corrected import Corrected, corrected
from twin.learn import View
from twin.turns import Healthy

OUTSIDE = 0.02
"""Share of the range's middle, or of its half width where that is more, by which an operating point may lie outside it
[-]."""

DEAD, CLIPPED = 0.02, 0.002
"""Shares of a turn at one value, and at flat tops, above which it is none."""


@dataclass(frozen=True, eq=False)
class Gate:
    """The gate of a twin.

    Attributes
    ----------
    healthy : Healthy
    view : View
    """

    healthy: Healthy
    view: View

    def looked(
        self, signal: Signal, conditions: Conditions, pulses: Sequence[float] | np.ndarray | None = None
    ) -> tuple[np.ndarray, Corrected]:
        """Turns x (k, stations, cells) of a record as the networks take them, and the record as it is compared; raises
        SignalError where it cannot be compared with the twin."""
        name = signal.source or "the record"
        if signal.unit != self.healthy.sensor.unit:
            raise SignalError(
                f"{name} must be in {self.healthy.sensor.unit} as the twin's sensor reads, got {signal.unit}; "
                "convert it, or make a twin with this sensor."
            )
        quality = quality_columns(signal.values[None])[0]
        if is_dead(**quality, most=DEAD):
            raise SignalError(f"{name} must vary throughout, got one value on end; check the sensor and its cable.")
        if is_clipped(signal.values, quality["clipped_share"], CLIPPED):
            share = quality["clipped_share"]
            raise SignalError(f"{name} must stay inside the sensor's range, got {share:.1%} of it at flat tops.")
        self._check_point(name, conditions)
        record = corrected(name, signal, conditions, pulses, self.healthy, self.view.remains)
        told, reference, point = record.conditions, record.reference, record.point
        assert told.start_angle is not None
        cam_rate = self.healthy.machine.reduction * told.motor_speed
        signal = record.signal
        turns = self.healthy.cells.turns(signal.values, cam_rate, told.start_angle, signal.sample_rate)
        if not len(turns):
            got = signal.duration / self.healthy.machine.turn_duration(point)
            raise SignalError(f"{name} must hold a whole turn of the table, got {got:.2f}; record for longer.")
        return np.array([self.view.measured(turn - reference, reference, point) for turn in turns]), record

    def _check_point(self, name: str, conditions: Conditions) -> None:
        for what, value, (middle, half), unit, factor in (
            ("motor speed", conditions.motor_speed, self.view.speeds, "rpm", RPM),
            ("load", conditions.load_torque, self.view.loads, "N m", 1.0),
        ):
            slack = OUTSIDE * max(abs(middle), half)
            if abs(value - middle) > half + slack:
                low, high = ((middle + sign * half) / factor for sign in (-1.0, 1.0))
                raise SignalError(
                    f"{name}: the {what} must lie within the twin's {low:.4g} to {high:.4g} {unit}, got "
                    f"{value / factor:.4g}; make a twin for this range."
                )
