"""Truth for the twin's table: machines that the pipeline does not know, solved by code that shares nothing with the
kernel, with noise of some colour and a load that is stated wrong."""

from __future__ import annotations

import csv
import dataclasses
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np
import scipy.signal

from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from indexer_env import Machine, OperatingPoint, Sensor, load_machine, make_effect
from indexer_env.effects import Effect, MachineEffect, SensorEffect
from indexer_env.units import RPM
from indexer_experiments.challenge.truth import true_motion

RATE = 1000.0
"""Hz."""

HEALTHY = ((1500.0, 2.0, False), (1200.0, 2.0, False), (1350.0, 20.0, False), (1425.0, 10.0, True))
"""Healthy records of a bench: motor speed [rpm], load [N m], held out or not."""

PULSE = 0.002
"""rad; standard deviation with which a once-per-turn pulse gives the cam angle at the first sample."""

COLOUR = 0.6
"""ρ of the noise, e_k = ρ e_(k-1) + white."""

LACKING: tuple[Mapping[str, Mapping[str, float]], ...] = (
    {"friction.coulomb": {"torque": 5.0}},
    {"cam.station_spacing": {"error": 0.008, "station": 3}},
    {"friction.viscous": {"coefficient": 40.0}},
    {"load.imbalance": {"torque": 90.0, "phase": 1.0}},
    {"cam.profile_error": {"height": 6e-4, "centre": 0.22, "half_width": 0.08}},
    {"drive.transmission_error": {"amplitude": 4e-4, "phase": 0.5}},
)
"""Effects that the drawing lacks, in turn over the machines that have one."""


class Purpose(IntEnum):
    """What random numbers are drawn for; each machine has some of its own for each, so that no two records share noise.
    A number stays what it is once records have been made with it."""

    BENCH = 1
    """Healthy records that the twin is made of."""
    RECORDS = 2
    """Records that are asked about."""
    AT_SIZE = 3
    """Records with one fault of the stated smallest size."""
    DRAWING = 4
    """Simulated records of the drawing, which `transfer` teaches on."""


DRAWS = 2
"""Version of how records are drawn; what was made with another one is not taken over."""


def rng_of(purpose: Purpose, number: int, seed: int) -> np.random.Generator:
    """Random numbers for a purpose of machine `number`: a child of those that the machine itself is drawn with."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number, purpose)))


@dataclass(frozen=True, eq=False)
class Truth:
    """A machine as it really is.

    Attributes
    ----------
    machine : Machine
        With what the drawing lacks.
    kind : str
        "as modelled", "missing effect" or "unknown effect".
    noise : float
        Standard deviation [rad/s²].
    load_factor : float
        Load over the load that is stated [-].
    """

    machine: Machine
    kind: str
    noise: float
    load_factor: float


def machine_of(number: int, seed: int, noise: float, spread: float = 0.1) -> Truth:
    """Machine `number` of a table: every parameter ±`spread`, in half of them an effect that the drawing lacks, in a
    quarter a small one that no library has; `noise` as share of the signal's standard deviation."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    nominal = load_machine("reference")
    values = {name: read(nominal, name) * (1.0 + spread * rng.uniform(-1.0, 1.0)) for name in UNCERTAINTY}
    machine = changed(nominal, values)
    kind = ("as modelled", "missing effect", "unknown effect", "missing effect")[number % 4]
    if kind == "missing effect":
        ((name, given),) = LACKING[number // 2 % len(LACKING)].items()
        effect = make_effect(name, given)
        assert isinstance(effect, MachineEffect)
        machine = machine.with_effects(effect)
    factor = 1.0 + 0.1 * rng.uniform(-1.0, 1.0)
    clean, _ = true_motion(machine, OperatingPoint(), int(RATE * machine.turn_duration(OperatingPoint())), RATE)
    return Truth(machine, kind, noise * float(clean.std()), factor)


def taken(
    truth: Truth, rpm: float, load: float, turns: float, rng: np.random.Generator, effects: tuple[Effect, ...] = ()
) -> tuple[np.ndarray, OperatingPoint]:
    """A record (n,) [rad/s²] of the machine with these effects as well, and the operating point as it is stated."""
    machine, sensor = truth.machine, Sensor()
    for effect in effects:
        if isinstance(effect, MachineEffect):
            machine = machine.with_effects(effect)
        elif isinstance(effect, SensorEffect):
            sensor = effect.extend_sensor(sensor)
    point = OperatingPoint(rpm * RPM, load * truth.load_factor, rng.uniform(0.0, 2.0 * math.pi * machine.stations))
    samples = math.ceil(turns * machine.turn_duration(point) * RATE)
    acceleration, seen = true_motion(machine, point, samples, RATE)
    if truth.kind == "unknown effect":
        acceleration = acceleration + _unknown(acceleration, truth.noise)
    values = sensor.read(acceleration, RATE).values + _noise(truth.noise, samples, rng)
    at_start, at_end = (PULSE * rng.standard_normal(2)).tolist()
    turned = seen.motor_speed * machine.reduction * samples / RATE
    speed = seen.motor_speed * (1.0 + (at_end - at_start) / turned)
    return values, OperatingPoint(speed, load, seen.start_angle + at_start)


def _unknown(acceleration: np.ndarray, noise: float) -> np.ndarray:
    """What no effect of the library does: a share of the reading bends with its square, as a sensor near the end of its
    range; as large as the noise."""
    bent = acceleration * np.abs(acceleration)
    return noise * bent / bent.std()


def _noise(size: float, samples: int, rng: np.random.Generator) -> np.ndarray:
    white = rng.standard_normal(samples + 200)
    coloured = scipy.signal.lfilter([math.sqrt(1.0 - COLOUR**2)], [1.0, -COLOUR], white)
    return size * np.asarray(coloured)[200:]


def write_bench(truth: Truth, folder: Path, rng: np.random.Generator, turns: float = 2.2) -> None:
    """Healthy CSV files of the machine and records.csv, which says what was known when they were taken; a new folder,
    whole or not at all."""
    fresh = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    with (fresh / "records.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["file", "motor_speed_rpm", "load_torque", "start_angle", "noise", "held_out"])
        for rpm, load, held in HEALTHY:
            values, point = taken(truth, rpm, load, turns, rng)
            name = f"{rpm:.0f}rpm_{load:.0f}Nm.csv"
            write_record(fresh / name, values)
            row = [name, point.motor_speed / RPM, load, point.start_angle, truth.noise, "yes" if held else "no"]
            writer.writerow(row)
    fresh.rename(folder)


def write_record(path: Path, values: np.ndarray) -> None:
    """One CSV file as a logger would leave it."""
    table = np.column_stack([np.arange(len(values)) / RATE, values])
    np.savetxt(path, table, delimiter=",", fmt=("%.3f", "%.5f"), header="time [s],acceleration [rad/s^2]", comments="")


def fault(name: str, **given: float) -> Effect:
    """A fault as an effect."""
    return make_effect(name, dataclasses.asdict(make_effect(name, given)))
