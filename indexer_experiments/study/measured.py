"""Records that stand for measured ones, as the paper's are not published.

A machine with parameters of its own is simulated by `indexer_env.reference`, which shares no code with the solver that
makes the data sets, and is read by the bench's accelerometer with its bracket, filter, noise and logger. So it differs
from a simulated record by all that, but by nothing that neither solver knows: it is kinder than a real machine.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from datagen.changes import value_at, with_changes
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_sensor
from indexer_env.reference import simulate_reference
from indexer_env.sensors import Sensor

JOINTS = tuple(f"{joint}_joint.{quantity}" for joint in ("input", "output") for quantity in ("stiffness", "damping"))
"""What is drawn anew for each machine, as in the data sets."""

SHARE = 0.1
"""Half-width of these draws, the paper's."""

SENSOR = load_sensor("bench")


def drawn(rng: np.random.Generator) -> Machine:
    """The reference machine with its joints drawn within ±10 %."""
    return scaled(load_machine(), {path: 1.0 + SHARE * rng.uniform(-1.0, 1.0) for path in JOINTS})


def scaled(machine: Machine, factors: Mapping[str, float]) -> Machine:
    """The machine with the parameters at these paths times so much."""
    return with_changes(machine, {path: factor * value_at(machine, path) for path, factor in factors.items()})


def measured(
    machine: Machine, point: OperatingPoint, rng: np.random.Generator, samples: int | None = None, turns_before: int = 0
) -> np.ndarray:
    """Record (samples,) [rad/s²] at 1 kHz: the accelerometer's reading over its radius.

    samples, turns_before  as `simulate_reference` takes them
    """
    # A record with noise of 0.1 % of the range needs no more digits than these.
    motion = simulate_reference(machine, point, samples=samples, turns_before=turns_before, rtol=1e-8, atol=1e-10)
    return read(motion.channels["table_acceleration"], rng)


def read(acceleration: np.ndarray, rng: np.random.Generator | None, sensor: Sensor = SENSOR) -> np.ndarray:
    """What an accelerometer reads of an acceleration (samples,) [rad/s²], over its radius [rad/s²]."""
    assert sensor.radius is not None
    return sensor.read(acceleration, 1000.0, rng).values / sensor.radius
