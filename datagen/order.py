"""An order: all that decides the bytes of a data set, checked before anything is simulated or written."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from datagen.campaign import Base, Campaign
from datagen.campaigns import make_campaign
from datagen.laws_in_place import laws_moved
from datagen.preflight import check_draws
from datagen.seeds import Part, stream
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer
from indexer_env.device import CPU, check_device
from indexer_env.drive_sensors import DriveSensors
from indexer_env.errors import refuse
from indexer_env.faults import faults_from_mapping
from indexer_env.machine import machine_from_mapping
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.simulate import Run

QUANTITY = "table_acceleration"
"""What a record is; a channel of `Run`."""

NOT_OF_THE_ORDER = ("out", "overwrite", "executor", "workers", "address")
"""Keys of conf/generate.yaml that change no byte of a record: where the data set goes and who makes it."""

LARGEST_SHARD = 2**31 - 1
"""Samples in one shard: Arrow counts those of a list column in 32 bits."""


@dataclass(frozen=True)
class Order:
    """What to generate; the same order gives the same bytes.

    Attributes
    ----------
    campaign, base, run
        Which items, from which machine, operating point, faults and sensor, simulated how. Where `run` leaves the
        samples open they are those of one turn of the base, for every item.
    count : int
        Items, rejected ones included, >= 1.
    seed : int
        >= 0.
    shard_items : int
        Items simulated together and written as one file, >= 1.
    config : mapping
        The configuration as composed, for the manifest.
    drive_sensors : DriveSensors
        Which signals of the drive stand beside the record.
    device : str
        "cpu"; "cuda" or "cuda:N" simulates on a GPU, whose last bits are not those of a CPU.
    """

    campaign: Campaign
    base: Base
    run: Run = Run()
    count: int = 126
    seed: int = 0
    shard_items: int = 576
    config: Mapping[str, Any] = field(default_factory=dict)
    drive_sensors: DriveSensors = field(default_factory=DriveSensors)
    device: str = CPU

    def __post_init__(self) -> None:
        check_integer("datagen", "count", self.count, low=1)
        check_integer("datagen", "seed", self.seed, low=0, high=2**63 - 1)
        check_integer("datagen", "shard_items", self.shard_items, low=1)
        check_device("datagen", self.device)
        if self.run.channels != (QUANTITY,):
            raise refuse(
                "datagen", "run.channels", f"{QUANTITY} alone, as a data set holds no other", self.run.channels
            )
        if self.drive_sensors.signals and self.sensor.record_rate(self.run.sample_rate) != self.run.sample_rate:
            rule = "empty where sensor.sample_rate is lower than run.sample_rate, as they are sampled with the record"
            raise refuse("datagen", "drive_sensors.signals", rule, list(self.drive_sensors.signals))
        samples = self._simulated_samples
        object.__setattr__(self, "run", dataclasses.replace(self.run, samples=samples))
        if samples * min(self.count, self.shard_items) > LARGEST_SHARD:
            rule = f"few and short enough for {LARGEST_SHARD} samples in one file"
            remedy = "lower shard_items, run.samples or run.sample_rate, or raise the motor's speed"
            raise refuse("datagen", "records", rule, f"{samples} samples each", remedy)
        # A dry reading: what the sensor refuses, it refuses before the simulation of a whole shard.
        ramp = np.arange(samples, dtype=float)
        self.sensor.read(ramp, self.run.sample_rate, stream(self.seed, Part.SENSOR, 0))
        check_draws(self.campaign, self.base, self.seed, self.count)

    @property
    def sensor(self) -> Sensor:
        """The sensor of the base; items may vary it."""
        return self.base.sensor

    @property
    def record_samples(self) -> int:
        """Samples of each record, as its sensor gives it."""
        return self.sensor.record_samples(self._simulated_samples, self.run.sample_rate)

    @property
    def _simulated_samples(self) -> int:
        return self.run.samples_of(self.base.machine.turn_duration(self.base.operating_point))

    @property
    def shards(self) -> int:
        """Number of shards, those without a record included."""
        return -(-self.count // self.shard_items)

    def items_of(self, number: int) -> range:
        """Numbers of the items of a shard."""
        first = number * self.shard_items
        return range(first, min(first + self.shard_items, self.count))

    @functools.cached_property
    def fingerprint(self) -> str:
        """SHA-256 of all that decides the bytes: `config` left out, which says the same in the user's words, and of the
        device whether it is a GPU, as a CPU goes without saying."""
        fields = {entry.name: getattr(self, entry.name) for entry in dataclasses.fields(self) if entry.name != "config"}
        if fields.pop("device") != CPU:
            fields["device"] = "cuda"
        return hashlib.sha256(json.dumps(_plain(fields)).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """The value in JSON's types; a dataclass keeps the name of its class, so that equal fields of two kinds differ."""
    if dataclasses.is_dataclass(value):
        fields = {entry.name: getattr(value, entry.name) for entry in dataclasses.fields(value)}
        return {"": type(value).__qualname__, **_plain(fields)}
    if isinstance(value, Mapping):
        return {str(key): _plain(below) for key, below in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(below) for below in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"{type(value).__name__} cannot be part of an order, got {value!r}")


def base_from(plain: Mapping[str, Any]) -> Base:
    """The base of a composed `conf/generate.yaml` whose laws have moved."""
    return Base(
        machine_from_mapping(plain["machine"]),
        from_mapping(OperatingPoint, plain["operating_point"]),
        faults_from_mapping(plain["faults"]),
        from_mapping(Sensor, plain["sensor"]),
    )


def order_from(config: Mapping[str, Any]) -> Order:
    """The order of a composed `conf/generate.yaml`; raises ParameterError for whatever breaks a rule."""
    plain = laws_moved(config)
    base, campaign = base_from(plain), make_campaign(plain["campaign"])
    return Order(
        campaign=campaign,
        base=base,
        run=from_mapping(Run, plain["run"]),
        drive_sensors=from_mapping(DriveSensors, plain["drive_sensors"]),
        count=campaign.size if plain["count"] is None else plain["count"],
        seed=plain["seed"],
        shard_items=plain["shard_items"],
        device=plain.get("device", CPU),
        config={key: value for key, value in config.items() if key not in NOT_OF_THE_ORDER},
    )
