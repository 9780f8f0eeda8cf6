"""Simulated machines that wear before one's eyes, published to a broker as a logger would.

One turn of each machine is shown every PERIOD_S seconds and stands for one recorded every HOURS hours of its life; the
times that are sent say so. The reducer of `press-2` wears out as campaign=wear has it, its roller of `press-3` cracks
later and stays an alarm, `press-1` stays healthy and loses its sensor for a while.
"""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from datagen.campaigns.wear import play_after
from indexer_cli.output_folder import output_folder
from indexer_env.build import from_mapping
from indexer_env.errors import IndexerError
from indexer_env.faults import Faults
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_yaml
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.simulate import simulate_batch
from monitor.engine import Engine
from monitor.intake.blocks import NANO
from monitor.sources.base import Source
from monitor.sources.mqtt import Broker

TURNS = 240
PERIOD_S = 0.25
HOURS = 6.0

MACHINES = ("press-1", "press-2", "press-3")
TOPIC = "plant/{}/acceleration"

_TAUGHT = (
    "sensor=bench",
    "machine.model=B_on_base",
    "machine.input_joint.stiffness={around:[8000,0.1]}",
    "machine.input_joint.damping={around:[6.32,0.1]}",
    "machine.output_joint.stiffness={around:[44413,0.1]}",
    "machine.output_joint.damping={around:[28.27,0.1]}",
    "operating_point.load_torque={around:[2,0.1]}",
    "operating_point.start_angle={uniform:[0,50.26548]}",
    "faults.backlash_deg={choice:[0,{uniform:[0,25]}]}",
    "faults.roller_crack={choice:[0,{uniform:[0,0.6]}]}",
    "faults.screw_looseness={choice:[0,{uniform:[0,1]}]}",
    "campaign.split={calibration: 6, control: 3, validation: 1}",
)
"""The machines that the demonstration's model is taught: the reference one ±10 %, with faults of every size."""


class DemoError(IndexerError, RuntimeError):
    """The demonstration's model could not be made."""


def train_commands(data: Path, model: Path, count: int, motor_speed_rpm: float = 1500.0) -> list[list[str]]:
    """The two commands that make the model, as anybody could type them."""
    return [
        [
            sys.executable, "-m", "datagen", *_TAUGHT, f"operating_point.motor_speed_rpm={motor_speed_rpm}",
            f"count={count}", f"out={data}", "overwrite=true",
        ],
        [
            sys.executable, "-m", "classifier", f"data={data}", f"out={model}", "overwrite=true", "trainer=trainscg",
            "restarts=1", "features=psd", "pictures=false",
        ],
    ]  # fmt: skip


def make_model(folder: Path, count: int, motor_speed_rpm: float = 1500.0) -> None:
    """Simulate `count` records and train the demonstration's model on them, if `folder` does not hold it yet.

    Raises
    ------
    DemoError
        One of the two commands failed; the message is its last line.
    """
    if (folder / "model.yaml").is_file():
        return
    with output_folder(folder, ("model.yaml", "*")) as made:
        work = made.parent
        for command in train_commands(work / "data", made / "model", count, motor_speed_rpm):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise DemoError(f"the model could not be made: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
        for file in (made / "model").iterdir():
            file.rename(made / file.name)
        (made / "model").rmdir()


def wear_of(machine: str, share: float) -> Faults:
    """Faults of a machine of the demonstration at this share (0 … 1) of the time shown."""
    if machine == "press-2":
        return Faults(backlash=math.radians(play_after(share, 0.3, 17.0, 4.0)))
    if machine == "press-3":
        return Faults(roller_crack=0.32 * max(0.0, share - 0.5) / 0.5)
    return Faults()


def records(machine: str, turns: int = TURNS, seed: int = 0) -> np.ndarray:
    """Accelerations (turns, samples) of one machine of the demonstration, as its sensor reads them [m/s²]."""
    base = load_machine("reference")
    shares = np.arange(turns) / max(1, turns - 1)
    rng = np.random.default_rng([seed, MACHINES.index(machine)])
    base = dataclasses.replace(base, model="B_on_base")
    machines = [wear_of(machine, float(share)).applied_to(base) for share in shares]
    points = [OperatingPoint(load_torque=2.0 * rng.uniform(0.95, 1.05)) for _ in shares]
    run = Run()
    batch = simulate_batch(machines, points, run)
    sensor = from_mapping(Sensor, load_yaml("sensor", "bench"))
    rngs = [np.random.default_rng([seed, MACHINES.index(machine), turn]) for turn in range(turns)]
    return sensor.read_batch(batch.table_acceleration, run.sample_rate, rngs)


def messages(turns: int, start_ns: int, seed: int = 0) -> Iterator[tuple[str, bytes]]:
    """Topic and payload of each message in their order: a turn of every machine, then the next."""
    read = {machine: records(machine, turns, seed) for machine in MACHINES}
    rate = Run().sample_rate
    for turn in range(turns):
        start = start_ns + round(turn * HOURS * 3600 * NANO)
        for machine in MACHINES:
            values = read[machine][turn]
            if machine == "press-1" and 0.55 * turns < turn < 0.65 * turns:
                values = np.zeros_like(values)  # a broken cable
            body = {
                "time": start / NANO,
                "rate": rate,
                "unit": "m/s^2",
                "values": [round(float(value), 4) for value in values],
                "pulse": None,
                "sequence": turn,
                "sensor": f"demo {machine}",
                "begins": True,
            }
            yield TOPIC.format(machine), json.dumps(body).encode()


class DemoSource(Source):
    """Publishes the demonstration's turns to a broker, from where the monitor has them as from any logger."""

    def __init__(self, broker: Broker, start_ns: int) -> None:
        super().__init__()
        self.name = "demo"
        self._broker, self._start_ns = broker, start_ns

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        client = self._broker.client("demo-logger", keep_session=False)
        self._broker.connect(client, keep_session=False)
        while not client.is_connected() and not self.stopping.wait(0.05):
            pass
        for place, (topic, payload) in enumerate(messages(TURNS, self._start_ns)):
            sent = client.publish(topic, payload, qos=1)
            while not sent.is_published() and not self.stopping.wait(0.01):
                pass
            if self.stopping.wait(PERIOD_S if place % len(MACHINES) == len(MACHINES) - 1 else 0.0):
                break
        for machine in MACHINES:
            engine.ended(machine)
        client.disconnect()
        client.loop_stop()
