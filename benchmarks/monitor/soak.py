"""A healthy machine for many simulated days: temperature of day and night, two speeds, a sensor that drifts.

Temperature moves stiffnesses by ∓0.5 % and dampings by ±10 % at its extremes, and the sensor's gain by 1 %; the gain
drifts by 3 % over the time. Turns are recorded every `every` minutes, at 1500 rpm by day and 1350 rpm by night.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math

import numpy as np

from benchmarks.monitor.machines import RADIUS_M, WORK, plan
from classifier.model import load_model
from indexer_env.build import from_mapping
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_yaml
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.simulate import simulate_batch
from indexer_env.units import RPM
from monitor.analysis.classifier import ClassifierDiagnoser
from monitor.intake.blocks import NANO, Block
from monitor.pipeline import Pipeline
from monitor.sources import demo

SPEEDS_RPM = (1500.0, 1350.0)
_BATCH = 256


def models(records: int) -> ClassifierDiagnoser:
    """A model for each speed."""
    folders = []
    for rpm in SPEEDS_RPM:
        folder = (WORK / f"model-{rpm:.0f}-{records}").resolve()
        folder.parent.mkdir(parents=True, exist_ok=True)
        demo.make_model(folder, records, rpm)
        folders.append(folder)
    return ClassifierDiagnoser([load_model(folder) for folder in folders])


def warmed(machine: Machine, warmth: float) -> Machine:
    """The machine at a warmth from −1 to 1."""
    joints = {
        name: dataclasses.replace(
            getattr(machine, name),
            stiffness=getattr(machine, name).stiffness * (1 - 0.005 * warmth),
            damping=getattr(machine, name).damping * (1 + 0.1 * warmth),
        )
        for name in ("input_joint", "output_joint")
    }
    return dataclasses.replace(machine, **joints)


def measure(days: float, every_min: float, records: int, seed: int) -> dict[str, object]:
    """Alarms that came, of any kind."""
    diagnoser = models(records)
    base = dataclasses.replace(load_machine("reference"), model="B_on_base")
    sensor, rng = from_mapping(Sensor, load_yaml("sensor", "bench")), np.random.default_rng(seed)
    times = np.arange(0.0, days * 86400.0, every_min * 60.0)
    pipeline = Pipeline("healthy", diagnoser, plan())
    events: list[str] = []
    problems = turns = 0
    for first in range(0, len(times), _BATCH):
        part, blocks = times[first : first + _BATCH], []
        for rpm in SPEEDS_RPM:
            mine = part[((part % 86400.0 < 57600.0) == (rpm == SPEEDS_RPM[0]))]
            if not len(mine):
                continue
            warmth = np.sin(2 * math.pi * (mine / 86400.0 - 0.3))
            points = [OperatingPoint(motor_speed=rpm * RPM, load_torque=2 * rng.uniform(0.9, 1.1)) for _ in mine]
            batch = simulate_batch([warmed(base, float(w)) for w in warmth], points, Run())
            rngs = [np.random.default_rng([seed, round(time)]) for time in mine]
            read = sensor.read_batch(batch.table_acceleration, 1000.0, rngs)
            gain = 1 + 0.01 * warmth + 0.03 * mine / times[-1]
            blocks += [
                Block("healthy", round((1.8e9 + time) * NANO), 1000.0, "m/s^2", row, motor_speed=rpm * RPM, begins=True)
                for time, row in zip(mine, read * gain[:, None], strict=True)
            ]
        for block in sorted(blocks, key=lambda one: one.start_ns):
            outcome = pipeline.take(block)
            assert outcome is not None and len(outcome.turns) == 1
            turns += 1
            problems += outcome.turns[0].problem is not None
            events += [f"{event.quantity} {event.kind} {event.level}" for event in outcome.events]
    states = {name: state["count"] for name, state in pipeline.states.to_dict().items()}
    return {"days": days, "turns": turns, "not_diagnosed": problems, "alarm_events": events[:20], "count": len(events),
            "states": states, "radius_m": RADIUS_M}  # fmt: skip


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor soak")
    parser.add_argument("--days", type=float, default=30.0)
    parser.add_argument("--every", type=float, default=10.0, help="minutes between recorded turns")
    parser.add_argument("--records", type=int, default=1500)
    parser.add_argument("--seed", type=int, default=3)
    given = parser.parse_args(arguments)
    print(json.dumps(measure(given.days, given.every, given.records, given.seed), indent=1))
