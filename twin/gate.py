"""What a record must be to be compared with a twin, in one sentence where it is not; what networks see of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.records.conditions import Conditions
from discrepancy.records.matching import matched
from indexer_env.errors import SignalError
from indexer_env.operating_point import OperatingPoint
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.quality import is_dead, quality_columns
from twin.learn import View
from twin.turns import Healthy

_OUTSIDE = 0.02
"""Share of the range by which an operating point may lie outside it [-]; of its middle where it is one point."""

DEAD, CLIPPED = 0.02, 0.002
"""Shares of a turn at one value, and at flat tops, above which it is none."""

_LIKENESS, _LEVEL = 0.9, (0.5, 2.0)
"""Likeness to the healthy machine in the first orders of the cam, and level over its own, outside of which a record is
none of this machine: faults of the table leave 0.95 and 0.7 to 1.4."""

BY_COMPARISON = 0.01
"""rad; standard deviation of a start angle found by comparison."""

_STATED_SLACK = 0.1
"""rad; a stated cam angle that is farther from the record's own is wrong."""


@dataclass(frozen=True, eq=False)
class Gate:
    """The gate of a twin.

    Attributes
    ----------
    healthy : Healthy
    view : View
    given : mapping
        Ranges of `motor_speed_rpm` and `load_torque` that the twin was made for.
    """

    healthy: Healthy
    view: View
    given: Mapping[str, Sequence[float]]

    def looked(self, signal: Signal, conditions: Conditions) -> tuple[np.ndarray, OperatingPoint, bool]:
        """Turns x (k, stations, cells) of a record as the networks take them, the operating point, and whether stations
        are known; raises SignalError where the record cannot be compared with the twin."""
        cells = self.healthy.cells
        name = signal.source or "the record"
        if signal.unit != self.healthy.sensor.unit:
            raise SignalError(
                f"{name} must be in {self.healthy.sensor.unit} as the twin's sensor reads, got {signal.unit}; "
                "convert it, or make a twin with this sensor."
            )
        if abs(signal.sample_rate / cells.rate - 1.0) > 1e-3:
            rate = signal.sample_rate
            raise SignalError(f"{name} must be sampled at the twin's {cells.rate:g} Hz, got {rate:g} Hz; resample it.")
        quality = quality_columns(signal.values[None])[0]
        if is_dead(**quality, most=DEAD):
            raise SignalError(f"{name} must vary throughout, got one value on end; check the sensor and its cable.")
        if quality["clipped_share"] > CLIPPED:
            share = quality["clipped_share"]
            raise SignalError(f"{name} must stay inside the sensor's range, got {share:.1%} of it at flat tops.")
        self._check_point(name, conditions)
        point = OperatingPoint(conditions.motor_speed, conditions.load_torque)
        reference = self.healthy.turn(point)
        cam_rate = self.healthy.machine.reduction * conditions.motor_speed
        start, known = self.start_of(name, signal, conditions, reference, cam_rate)
        turns = cells.turns(signal.values, cam_rate, start)
        if not len(turns):
            got = signal.duration / self.healthy.machine.turn_duration(point)
            raise SignalError(f"{name} must hold a whole turn of the table, got {got:.2f}; record for longer.")
        x = np.array([self.view.measured(turn - reference, reference, point) for turn in turns])
        return x, point, known

    def _check_point(self, name: str, conditions: Conditions) -> None:
        for what, value, (middle, half), unit, factor in (
            ("motor speed", conditions.motor_speed, self.view.speeds, "rpm", RPM),
            ("load", conditions.load_torque, self.view.loads, "N m", 1.0),
        ):
            slack = _OUTSIDE * max(abs(middle), half)
            if abs(value - middle) > self._half(what, half) + slack:
                low, high = ((middle + sign * self._half(what, half)) / factor for sign in (-1.0, 1.0))
                raise SignalError(
                    f"{name}: the {what} must lie within the twin's {low:.4g} to {high:.4g} {unit}, got "
                    f"{value / factor:.4g}; make a twin for this range."
                )

    def _half(self, what: str, half: float) -> float:
        """Half width of the range that the twin was made for; a unit of 1 stands for a range that is one point."""
        low, high = self.given["motor_speed_rpm" if what == "motor speed" else "load_torque"]
        return half if high > low else 0.0

    def start_of(
        self, name: str, signal: Signal, conditions: Conditions, reference: np.ndarray, cam_rate: float
    ) -> tuple[float, bool]:
        """Cam angle of the first sample [rad], and whether its station is known."""
        mean = reference.mean(axis=0)
        found = np.fft.rfft(mean)[1:7] * 2.0 / len(mean)
        width = np.pi / len(mean)
        found = found * np.exp(-1j * np.arange(1, 7) * width)
        match = matched(signal.values, signal.sample_rate, cam_rate, found)
        if match.likeness < _LIKENESS or not _LEVEL[0] <= match.level <= _LEVEL[1]:
            raise SignalError(
                f"{name} must look like the twin's machine, likeness {_LIKENESS:g} and level {_LEVEL[0]:g} to "
                f"{_LEVEL[1]:g} in the first orders of the cam, got {match.likeness:.2f} and {match.level:.2g}; check "
                "whose record it is, its unit, its speed and its sensor."
            )
        if conditions.start_angle is None:
            return match.start_angle, False
        off = abs((conditions.start_angle - match.start_angle + np.pi) % (2.0 * np.pi) - np.pi)
        if off > _STATED_SLACK:
            raise SignalError(
                f"{name}: the cam angle at the first sample must agree with the record within {_STATED_SLACK:g} rad, "
                f"got {off:.2f} rad off; correct start_angle, or leave it out."
            )
        return conditions.start_angle, True
