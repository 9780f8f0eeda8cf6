"""The files of a twin's folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from safetensors.numpy import load_file
from safetensors.torch import load_file as load_weights
from torch import nn

from indexer_env.build import from_mapping
from indexer_env.errors import ParameterError
from indexer_env.machine import Machine
from indexer_env.presets import load_machine
from indexer_env.sensors import Sensor
from indexer_env.units import RPM
from twin.faults import Fault
from twin.learn import View
from twin.network import NETWORKS as KINDS
from twin.nuisance import Nuisance
from twin.synthesis import Synthesis
from twin.turns import Cells, Healthy, Remains

FORMAT = "indexer-twin"
VERSION = 4

NETWORKS = ("modes_0", "modes_1")
"""Networks that diagnose together: two, as many as most machines have cores to teach them side by side."""

PAPER = "paper_0"
"""The paper's network, taught beside them and shown beside them, which takes no part in a diagnosis."""


def about_of(folder: Path) -> dict[str, Any]:
    """twin.yaml of a folder."""
    path = folder / "twin.yaml"
    if not path.is_file():
        raise ParameterError(
            f"twin must be the folder of a finished twin, got {folder}, which holds no twin.yaml; "
            "make one with indexer twin."
        )
    about = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise ParameterError(f"{path} must be the head of a twin, got another file; name the folder that twin wrote.")
    if about.get("version") != VERSION:
        got = about.get("version")
        raise ParameterError(f"{path} must be of version {VERSION}, got {got}; make the twin anew with this software.")
    return about


def machine_and_sensor(folder: Path) -> tuple[Machine, Sensor]:
    """The healthy machine and its sensor."""
    machine = load_machine(folder / "machine.yaml")
    sensor = yaml.safe_load((folder / "sensor.yaml").read_text(encoding="utf-8"))
    return machine, from_mapping(Sensor, sensor, "sensor")


def networks_of(folder: Path, names: Sequence[str], faults: int, cells: Cells) -> tuple[nn.Module, ...]:
    """The networks of these names, "modes_0" for the first of kind modes."""
    found = []
    for name in names:
        network = KINDS[name.partition("_")[0]](faults, cells.count, cells.stations)
        network.load_state_dict(load_weights(folder / f"{name}.safetensors"))
        found.append(network.eval())
    return tuple(found)


def view_of(about: Mapping[str, Any], remains: Remains) -> View:
    """What turns go through, from the range and the shift in twin.yaml."""

    def middle(key: str, factor: float) -> tuple[float, float]:
        low, high = (factor * float(value) for value in about["range"][key])
        return 0.5 * (low + high), 0.5 * (high - low) or 1.0

    return View(remains, float(about["shift"]), middle("motor_speed_rpm", RPM), middle("load_torque", 1.0))


def synthesis_of(folder: Path, faults: Sequence[Fault], healthy: Healthy, view: View) -> Synthesis:
    """The simulator as it is fitted to turns."""
    held = load_file(folder / "synthesis.safetensors")
    nuisance = Nuisance.of(folder / "posterior.parquet")
    return Synthesis(
        healthy, faults, view.remains.noise, held["axes"], held["covariance"], held["open"], held["growth"],
        view.shapes, nuisance,
    )  # fmt: skip
