"""Measurements of an indexing machine that could be made next: other speeds, loads and lengths, and one sensor more."""

from __future__ import annotations

import math

import numpy as np

from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.indexer.reading import Reading
from discrepancy.subjects.base import Measurement
from indexer_env.effects.measures import measures
from indexer_env.errors import SimulationError
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.simulate import simulate
from indexer_env.units import RPM

_SPEEDS, _LOADS, _TURNS = (0.5, 0.7, 0.85, 1.0, 1.15, 1.3), (0.0, 0.25, 0.75), (1, 2)
"""Motor speed over the highest measured, load added over the table's largest inertial torque there, length [table
turns]."""

_CAM_TURNS = 5
"""Least length of an imagined measurement [cam turns]: a table of few stations turns in fewer."""

_TORQUE_NOISE = 0.02
"""Noise of a torque sensor on the cam shaft over the spread of its torque: strain gauges through telemetry."""

_RAISED = 100.0
"""Noise of imagined records over the real one: `IndexerModel` bounds residuals, which here are whole records."""


class ShaftReading(Reading):
    """A torque meter reads the torque as it is."""

    def difference(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        return acceleration - self.measured[window]

    def whole(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        return acceleration


class ShaftTorqueModel(IndexerModel):
    """The same machine, its sensor a torque meter on the cam shaft: it reads M1 [N m]."""

    channel = layout.TORQUE_1
    sensed = ShaftReading


def imagined(model: IndexerModel) -> tuple[Measurement, ...]:
    """Measurements with the sensor there is, then with a torque sensor at the highest speed measured, of the machine
    that `model` has records of."""
    first = model.experiments[0]
    fastest = max(e.operating_point.motor_speed for e in model.experiments)
    load, rate = first.operating_point.load_torque, first.signal.sample_rate
    torque = measures(model.machine, fastest)["torque"]
    loads = [load + float(f"{share * torque:.2g}") for share in _LOADS]
    found = []
    whole = math.ceil(_CAM_TURNS / model.machine.stations)
    for turns in (whole * turns for turns in _TURNS):
        for share in _SPEEDS:
            for stated in loads:
                point = OperatingPoint(share * fastest, stated)
                experiment = _empty(model.machine, point, turns, rate, first.signal.unit, first.noise_level)
                other = IndexerModel(model.machine, [experiment], model.sensor, model.uncertainty, known=model.known)
                found.append(Measurement(_words(point, turns), other, _RAISED))
    for stated in loads:
        point = OperatingPoint(fastest, stated)
        try:
            shaft = simulate(model.machine, point, Run(rate, channels=("torque_1",))).channels["torque_1"]
        except SimulationError:
            continue  # a load that the nominal machine cannot carry is not to be measured
        experiment = _empty(model.machine, point, whole, rate, "rad/s^2", _TORQUE_NOISE * float(shaft.std()))
        other = ShaftTorqueModel(model.machine, [experiment], None, model.uncertainty, known=model.known)
        found.append(Measurement(f"{_words(point, whole)} with a torque sensor on the cam shaft", other, _RAISED))
    return tuple(found)


def _words(point: OperatingPoint, turns: int) -> str:
    length = f"{turns} turn{'s' if turns > 1 else ''} of the table"
    return f"{point.motor_speed / RPM:.0f} rpm, {point.load_torque:.4g} N m, {length}"


def _empty(machine: Machine, point: OperatingPoint, turns: int, rate: float, unit: str, noise: float) -> Experiment:
    """A record of zeros: residuals against it are what a model predicts."""
    zeros = np.zeros(int(turns * machine.turn_duration(point) * rate))
    return Experiment(Signal(zeros, rate, unit=unit), point, _RAISED * noise)
