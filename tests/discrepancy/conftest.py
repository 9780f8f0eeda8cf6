"""Records of an indexing machine whose truth is known."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from indexer_env import MachineEffect, OperatingPoint, Run, Sensor, SensorEffect, Signal, load_machine, simulate
from indexer_env.effects import Effect
from indexer_env.machine import Machine

RPM = 2.0 * math.pi / 60.0
CONDITIONS = ((1500.0, 2.0, 1.0), (1200.0, 2.0, 0.8))
HELD_OUT = ((1350.0, 20.0, 0.8),)

Records = Callable[..., tuple[IndexerModel, IndexerModel, Machine]]


@pytest.fixture(scope="session")
def records() -> Records:
    """Make (model, held-out model, true machine): all parameters drawn ±10 %, 1.5 % noise, start angle known to
    0.002 rad; motor speed [rpm], load [N m] and table turns as in CONDITIONS; the truth runs at an eighth of the step.
    """

    def make(seed: int, play_factor: float = 1.0, effect: Effect | None = None) -> tuple:
        rng = np.random.default_rng(seed)
        nominal = load_machine("reference")
        nominal = changed(nominal, {"input_joint.backlash": nominal.input_joint.backlash * play_factor})
        truth = changed(nominal, {n: read(nominal, n) * (1.0 + 0.1 * rng.uniform(-1.0, 1.0)) for n in UNCERTAINTY})
        sensor = Sensor()
        if isinstance(effect, MachineEffect):
            truth = truth.with_effects(effect)
        elif isinstance(effect, SensorEffect):
            sensor = effect.extend_sensor(sensor)
        parts = [
            tuple(experiment(truth, sensor, rng, *condition) for condition in conditions)
            for conditions in (CONDITIONS, HELD_OUT)
        ]
        return IndexerModel(nominal, parts[0]), IndexerModel(nominal, parts[1]), truth

    return make


@pytest.fixture(scope="session")
def one_record() -> Callable[..., Experiment]:
    """Make one record of a machine: `experiment`."""
    return experiment


def experiment(
    truth: Machine, sensor: Sensor, rng: np.random.Generator, rpm: float, load: float, turns: float
) -> Experiment:
    """One noisy record, its start angle known to 0.002 rad."""
    point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
    run = Run(step=0.0625e-3, samples=int(turns * truth.turn_duration(point) * 1000.0))
    clean = sensor.read(simulate(truth, point, run).table_acceleration, 1000.0).values
    values = clean + 0.015 * clean.std() * rng.standard_normal(len(clean))
    told = dataclasses.replace(point, start_angle=point.start_angle + 0.002 * rng.standard_normal())
    return Experiment(Signal(values, 1000.0, unit="rad/s^2"), told)
