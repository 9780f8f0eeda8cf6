"""What a sensor reads of a record that begins while the machine and the sensor have long been running.

`Sensor.read` begins as if the first sample had lasted for ever. A bracket and a low-pass forget that within a second. A
high-pass remembers it for 1/corner, up to minutes, and the record would begin with a transient larger than all that the
high-pass does. So a sensor with one reads the table turn before the record, too.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.truth import turn_samples


def lead_of(sensor: Sensor, machine: Machine, point: OperatingPoint, rate: float) -> int:
    """Samples before a record that the sensor must read, too: a table turn with a high-pass, none without."""
    return 0 if sensor.highpass_hz is None else turn_samples(machine, point, rate)


def read_running(sensor: Sensor, acceleration: np.ndarray, lead: np.ndarray, rate: float) -> np.ndarray:
    """The reading (n,) of accelerations (n,) [rad/s²] that follow on those of `lead` (m,), t = 0 at the first of the n.

    Turns like the lead are taken to have gone before without end. Of them a high-pass of corner ω remembers one level,
    as if that had lasted for ever:

        c = Σ_k e^{ωt_k} a_k / Σ_k e^{ωt_k},     a_k, t_k: accelerations of the lead and their times

    Without a high-pass the lead does not count, and the reading has the very bits of `Sensor.read`.
    """
    if sensor.highpass_hz is None:
        return sensor.read(acceleration, rate).values
    age = np.arange(len(lead), 0, -1) / rate
    level = np.average(lead, weights=np.exp(-2.0 * math.pi * sensor.highpass_hz * age))
    filters = dataclasses.replace(sensor, offset=0.0, offset_drift=0.0, hum_amplitude=0.0)
    passed = filters.read(np.concatenate([[level], lead, acceleration]), rate).values[1 + len(lead) :]
    return np.asarray(sensor.with_background(passed, np.arange(len(passed)) / rate))
