"""A twin that needs no training: the reference machine without play, and networks that say what they are told to."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch
import yaml
from safetensors.numpy import save_file
from safetensors.torch import save_file as save_weights

from discrepancy.indexer import machine_yaml
from indexer_env import OperatingPoint, Sensor, Signal, simulate
from indexer_env.effects import make_effect
from indexer_env.run import Run
from indexer_env.units import RPM
from tests.twin import builders
from twin.faults import FAULTS
from twin.folder import VERSION
from twin.network import NETWORKS
from twin.twin import Twin

NAMES = ("crack", "reducer_play", "sensor_loose", "sensor_gain")
RATE, LOAD, RPMS = builders.RATE, 5.0, (1200.0, 1500.0)
SEEN = {"crack": 0.04, "reducer_play": 0.09, "sensor_loose": 0.5, "sensor_gain": None}


def twin_folder(folder: Path, loads: tuple[float, float] = (0.0, 20.0)) -> Path:
    """The folder of such a twin, as `indexer twin` writes it; its networks have not learned anything."""
    folder.mkdir(parents=True)
    (folder / "machine.yaml").write_text(machine_yaml(builders.MACHINE), encoding="utf-8")
    (folder / "sensor.yaml").write_text(yaml.safe_dump(dataclasses.asdict(Sensor())), encoding="utf-8")
    cells = builders.CELLS
    remains = dataclasses.replace(
        builders.view().remains,
        points=np.array([[rpm * RPM, load] for rpm in RPMS for load in loads]),
        fixed=np.zeros((4, cells.stations, cells.count)),
    )
    save_file({k: np.ascontiguousarray(v) for k, v in remains.arrays().items()}, folder / "remains.safetensors")
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = NETWORKS["modes"](len(NAMES), cells.count, cells.stations)
    save_weights(network.state_dict(), folder / "modes_0.safetensors")
    held = {**builders.synthesis(NAMES).arrays(), "own_load": np.zeros(1)}
    save_file(held, folder / "synthesis.safetensors")
    known = {"machine.table_inertia": np.full(3, builders.MACHINE.table_inertia)}
    pq.write_table(pa.table(known), folder / "posterior.parquet")
    reach = [[2.0, 2.0]] * len(NAMES)
    about = {
        "format": "indexer-twin", "version": VERSION,
        "settings": {"faults": list(NAMES), "matters": {}, "coverage": 0.9},
        "networks": ["modes_0"], "cells": dataclasses.asdict(cells), "shift": 0.002,
        "range": {"motor_speed_rpm": list(RPMS), "load_torque": list(loads)},
        "load_factor": 1.0, "noise": builders.NOISE, "sample_noise": builders.NOISE, "unit": "rad/s^2",
        "judge": {"alarm": 0.0, "reach": reach}, "weights": {**builders.WEIGHTS.plain(), "reach": reach},
        "calibration": {"findings": [], "spread": {name: 0.02 for name in ("table_inertia", "cam_inertia")}},
        "check": {"trusted": True, "reason": "", "turns": []},
        "detection": [
            {"fault": name, "motor_speed_rpm": rpm, "load_torque": 0.0, "size": size, "told": None, "unit": ""}
            for name, size in SEEN.items() for rpm in RPMS
        ],
    }  # fmt: skip
    (folder / "twin.yaml").write_text(yaml.safe_dump(about), encoding="utf-8")
    return folder


def saying(twin: Twin, any_fault: float, faults: tuple[float, ...], unlike: bool = False) -> Twin:
    """The twin with networks alone that always give these logits; every size is half of the largest. Unlike: what is
    left of a turn after its simulation always counts as strange."""
    networks = (builders.Fixed(any_fault, list(faults)),)
    if not unlike:
        return dataclasses.replace(twin, networks=networks, synthesis=None)
    assert twin.weights is not None
    return dataclasses.replace(
        twin, networks=networks, weights=dataclasses.replace(twin.weights, strange=-20.0, quiet=1e-9)
    )


def turns(count: int, fault: str | None = None, share: float = 0.0, rpm: float = 1500.0, slip: float = 0.0) -> Signal:
    """A record of so many turns with noise; the machine turns by the share `slip` slower than it should."""
    machine = builders.MACHINE
    if fault is not None:
        one = FAULTS[fault]
        machine = dataclasses.replace(
            machine, effects=(make_effect(one.effect, {one.parameter: one.value(share, machine)}),)
        )
    point = OperatingPoint(rpm * (1.0 - slip) * RPM, LOAD, 0.3)
    samples = round(machine.turn_duration(point) * RATE) * count
    values = np.asarray(simulate(machine, point, Run(RATE, samples, warmup_turns=1)).table_acceleration)
    noise = builders.NOISE * np.random.default_rng(count).standard_normal(samples)
    return Signal(values + noise, RATE, unit="rad/s^2", source="press")
