"""Effects of the measuring chain; each sets fields of the Sensor, which holds the equations (sensors.py)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from indexer_env.effects.base import SensorEffect, Sought, ladder, parameter, register

if TYPE_CHECKING:
    from indexer_env.sensors import Sensor

_CHAIN = "indexer_env/sensors.py, the chain's equation"


_BRACKETS = tuple(1.0 / share**2 for share in (1.07, 1.27, 1.47, 1.67, 1.93, 2.27, 2.67, 3.2, 4.0, 5.0, 6.3, 8.7, 12.0))
"""Brackets that are looked for, by their frequency over the output joint's."""


@register
@dataclass(frozen=True)
class SensorGain(SensorEffect):
    """The chain's gain is off."""

    name = "sensor.gain"
    sentence = "The gain of the measuring chain is off."
    equation = "gain → gain (1 + error)"
    source = _CHAIN
    enters = "sensor"

    error: float = parameter(
        "relative error of the gain",
        "-",
        null=0.0,
        low=-0.9,
        high=10.0,
        sought=Sought("-", (0.03, -0.03, 0.1, -0.1), 0.02),
    )

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        return dataclasses.replace(sensor, gain=sensor.gain * (1.0 + self.error))


@register
@dataclass(frozen=True)
class SensorLowpass(SensorEffect):
    """The chain's low-pass cuts lower than thought."""

    name = "sensor.lowpass"
    sentence = "A low-pass in the measuring chain cuts into the band."
    equation = "second-order Butterworth low-pass in place of the sensor's own; time_constant 0 leaves that"
    source = _CHAIN
    enters = "sensor"

    time_constant: float = parameter(
        "1/(2π cut-off frequency)", "s", null=0.0, low=0.0, sought=Sought("period", ladder(0.094, 4), 0.047, 0.038, 4.7)
    )

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        if self.is_null:
            return sensor
        return dataclasses.replace(sensor, lowpass_hz=1.0 / (math.tau * self.time_constant), lowpass_order=2)


@register
@dataclass(frozen=True)
class SensorHighpass(SensorEffect):
    """The chain is AC-coupled, or cuts off higher than thought."""

    name = "sensor.highpass"
    sentence = "A high-pass in the measuring chain, as the AC coupling of a piezoelectric sensor, cuts into the band."
    equation = "first-order high-pass s/(s + corner) in place of the sensor's own; corner 0 leaves that"
    source = _CHAIN
    enters = "sensor"
    # what a slow one remembers of the time before is a zero that wanders
    alike = ("sensor.offset_drift",)

    corner: float = parameter(
        "2π cut-off frequency", "rad/s", null=0.0, low=0.0, sought=Sought("cam rate", ladder(0.03, 4), 0.03, 0.003, 3.0)
    )

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        if self.is_null:
            return sensor
        return dataclasses.replace(sensor, highpass_hz=self.corner / math.tau)


@register
@dataclass(frozen=True)
class SensorBracketResonance(SensorEffect):
    """The accelerometer's bracket rings."""

    name = "sensor.bracket_resonance"
    sentence = "The bracket that holds the accelerometer resonates."
    equation = "(2ζωs + ω²)/(s² + 2ζωs + ω²), 1/ω² = inverse_square, in place of the sensor's own; 0 leaves that"
    source = _CHAIN
    enters = "sensor"

    inverse_square: float = parameter(
        "1/(2π f)² of the bracket",
        "s²/rad²",
        null=0.0,
        low=0.0,
        sought=Sought("period squared", _BRACKETS, 1.8e-3, 2.3e-3, 9.0),
    )
    damping: float = parameter(
        "damping ratio",
        "-",
        default=0.02,
        low=0.0,
        low_open=True,
        high=0.3,
        sought=Sought("-", (0.015, 0.05), 0.02, 0.002, 0.3),
    )

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        if self.is_null:
            return sensor
        frequency = 1.0 / (math.tau * self.inverse_square**0.5)
        return dataclasses.replace(sensor, bracket_hz=frequency, bracket_damping=self.damping)

    @classmethod
    def of_sensor(cls, sensor: Sensor) -> Self | None:
        if sensor.bracket_hz is None:
            return None
        return cls(1.0 / (math.tau * sensor.bracket_hz) ** 2, sensor.bracket_damping)


@register
@dataclass(frozen=True)
class SensorMainsHum(SensorEffect):
    """Mains hum on the signal."""

    name = "sensor.mains_hum"
    sentence = "Mains hum rides on the signal."
    equation = "hum = A sin(2π f t + phase), in place of the sensor's own (whose hum_third stays)"
    source = _CHAIN
    enters = "sensor"

    amplitude: float = parameter(
        "amplitude A", "unit of the signal", null=0.0, low=0.0, sought=Sought("acceleration", ladder(0.003, 4), 0.006)
    )
    frequency: float = parameter("mains frequency", "Hz", default=50.0, low=0.0, low_open=True, sought=Sought("-"))
    phase: float = parameter("phase at t = 0", "rad", default=0.0)

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        if self.is_null:
            return sensor
        return dataclasses.replace(sensor, hum_amplitude=self.amplitude, hum_hz=self.frequency, hum_phase=self.phase)


@register
@dataclass(frozen=True)
class SensorOffsetDrift(SensorEffect):
    """The chain's zero drifts."""

    name = "sensor.offset_drift"
    sentence = "The zero of the measuring chain drifts."
    equation = "y += rate · t"
    source = _CHAIN
    enters = "sensor"

    rate: float = parameter(
        "drift", "unit of the signal per s", null=0.0, sought=Sought("acceleration rate", (1.2e-3, -1.2e-3), 6e-4)
    )

    def extend_sensor(self, sensor: Sensor) -> Sensor:
        return dataclasses.replace(sensor, offset_drift=sensor.offset_drift + self.rate)
