"""The measured files of a case: CSV records, and `records.yaml` with what was known when they were taken."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

from discrepancy.records.experiments import Experiments, experiments
from discrepancy.records.quality import check_records
from discrepancy.records.reading import read_records
from indexer_env.effects import MachineEffect, SensorEffect
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.units import RPM
from indexer_experiments.challenge.draw import Draw
from indexer_experiments.challenge.running import lead_of, read_running
from indexer_experiments.challenge.truth import run, seen
from indexer_records.conditions import Pulse

CONDITIONS = ((1500.0, 2.0, False), (1200.0, 2.0, False), (1350.0, 20.0, True))
"""Motor speed [rpm], load [N m], and whether the record is held out."""

_RATE = 1000.0
_NOISE = 0.015
"""Noise over the first record's spread."""

_PULSE = 0.002
"""rad; standard deviation of the cam angle of a once-per-turn pulse, which start angle and mean speed come from."""

_TABLE = "records.yaml"


def write_records(drawn: Draw, turns: float, folder: Path) -> None:
    """Simulate the case for so many table turns a record, and write its files."""
    import yaml

    truth, sensor = drawn.truth, Sensor()
    for effect in drawn.hidden:
        if isinstance(effect, MachineEffect):
            truth = truth.with_effects(effect)
        elif isinstance(effect, SensorEffect):
            sensor = effect.extend_sensor(sensor)
    noise, rows = math.nan, []
    for number, (rpm, load, held_out) in enumerate(CONDITIONS):
        point = OperatingPoint(rpm * RPM, load, drawn.rng.uniform(0.0, 2.0 * math.pi))
        samples = int(turns * truth.turn_duration(point) * _RATE)
        lead = lead_of(sensor, truth, point, _RATE)
        motion = run(truth, point, samples, _RATE, lead=lead)
        shown = seen(truth, point, motion[:, lead:], _RATE)
        sensor = dataclasses.replace(sensor, hum_phase=drawn.rng.uniform(0.0, 2.0 * math.pi))
        clean = read_running(sensor, motion[0, lead:], motion[0, :lead], _RATE)
        noise = _NOISE * float(clean.std()) if math.isnan(noise) else noise
        values = clean + noise * drawn.rng.standard_normal(samples)
        columns = {"time [s]": np.arange(samples) / _RATE, "table_acceleration [rad/s^2]": values}
        name = f"record_{number}.csv"
        pyarrow.csv.write_csv(pa.table(columns), folder / name)
        at_start, at_end = (_PULSE * drawn.rng.standard_normal(2)).tolist()
        turned = shown.motor_speed * truth.reduction * samples / _RATE
        rows.append({
            "file": name, "motor_speed_rpm": shown.motor_speed / RPM * (1.0 + (at_end - at_start) / turned),
            "load_torque": load, "start_angle": shown.start_angle + at_start, "start_uncertainty": _PULSE,
            "speed_uncertainty": _PULSE * math.sqrt(2.0) / turned, "held_out": held_out,
        })  # fmt: skip
    (folder / _TABLE).write_text(yaml.safe_dump(rows, sort_keys=False), encoding="utf-8")


def read_case(folder: Path, nominal: Machine) -> Experiments:
    """Experiments from the files of a case, through the same checks as a user's.

    Raises
    ------
    SignalError, ParameterError
        Records that the checks refuse.
    """
    records = read_records(str(folder), None, {}, Pulse(), [])
    check_records(records, nominal)
    return experiments(records, nominal, Sensor())
