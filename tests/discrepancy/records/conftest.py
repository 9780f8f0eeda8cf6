"""A measured record of a machine near the nominal one, free to be spoiled."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from discrepancy.records.conditions import Conditions
from discrepancy.records.reading import Record
from indexer_env import Machine, OperatingPoint, Run, Signal, load_machine, make_effect, simulate

RPM = 2.0 * math.pi / 60.0


@pytest.fixture(scope="session")
def nominal() -> Machine:
    return load_machine("reference")


@pytest.fixture(scope="session")
def values(nominal: Machine) -> np.ndarray:
    """2.2 turns of a machine softer and heavier than the nominal one, with 20 N m of friction; 1500 rpm, 2 N m, from a
    cam angle of 1.3 rad; seed 1."""
    joint = dataclasses.replace(nominal.output_joint, stiffness=0.9 * nominal.output_joint.stiffness)
    machine = dataclasses.replace(nominal, output_joint=joint, table_inertia=5.4)
    machine = machine.with_effects(make_effect("friction.coulomb", torque=20.0))
    clean = simulate(machine, OperatingPoint(start_angle=1.3), Run(samples=18000)).table_acceleration
    return clean + 0.1 * np.random.default_rng(1).standard_normal(len(clean))


@pytest.fixture
def record(values: np.ndarray) -> Callable[..., Record]:
    """Make a record, its samples replaced where given, with these conditions."""

    def make(
        samples: np.ndarray | None = None, rate: float = 1000.0, pulses=None, unit="rad/s^2", **conditions
    ) -> Record:
        stated = {"motor_speed": 1500.0 * RPM, "load_torque": 2.0, "start_angle": 1.3} | conditions
        signal = Signal(values if samples is None else samples, rate, unit=unit, source="run.csv")
        return Record("run.csv", signal, Conditions(**stated), pulses)

    return make
