"""The files of a twin's folder."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml
from safetensors import SafetensorError
from safetensors.numpy import load_file
from safetensors.torch import load_file as load_weights
from torch import nn

from indexer_env.build import from_mapping
from indexer_env.errors import ParameterError
from indexer_env.machine import Machine, machine_from_mapping
from indexer_env.sensors import Sensor
from indexer_env.units import RPM
from twin.components import Components
from twin.faults import Fault, chosen
from twin.learn import View
from twin.network import NETWORKS as KINDS
from twin.nuisance import Nuisance
from twin.remains import Remains
from twin.synthesis import SQUARE, Synthesis
from twin.turns import Cells, Healthy

FORMAT = "indexer-twin"
VERSION = 12

FORMER = ".former"
"""Folder in a twin's own in which it stays while another one is made in its place."""

NETWORKS = ("modes_0", "modes_1")
"""Networks that diagnose together: two, as many as most machines have cores to teach them side by side."""

PAPER = "paper_0"
"""The paper's network, taught beside them and shown beside them, which takes no part in a diagnosis."""


_HELD: dict[str, tuple[str, ...]] = {
    "settings": ("faults", "matters", "coverage"), "networks": (), "cells": ("stations", "count", "rate"), "shift": (),
    "range": ("motor_speed_rpm", "load_torque"), "load_factor": (), "noise": (), "sample_noise": (), "unit": (),
    "calibration": ("findings", "spread"), "judge": ("alarm", "reach"),
    "weights": ("name", "reach", "slope", "rattled", "strange", "quiet", "quiet_mean", "pooled"), "detection": (),
    "check": ("trusted", "reason", "turns"),
}  # fmt: skip
"""What a diagnosis reads of twin.yaml."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """A file of a twin is read within; one that is damaged or cannot be read raises one sentence."""
    try:
        with path.open("rb"):
            pass
        yield
    except (OSError, SafetensorError, yaml.YAMLError, LookupError, TypeError, ValueError, RuntimeError) as error:
        remedy = "let this user read it" if isinstance(error, PermissionError) else "make the twin anew"
        raise ParameterError(f"{path} cannot be read ({_why(error)}); {remedy}.") from error


def _why(error: Exception) -> str:
    """What an error says, in one line."""
    if isinstance(error, KeyError):
        return f"it lacks {error.args[0]}"
    if isinstance(error, RuntimeError):
        return "its arrays are not this network's"
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(said.split()).rstrip(".")


def _yaml(path: Path) -> dict[str, Any]:
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise TypeError(f"it holds no mapping but {type(content).__name__}")
    return content


def about_of(folder: Path) -> dict[str, Any]:
    """twin.yaml of a folder."""
    path = folder / "twin.yaml"
    if not path.is_file():
        aside = folder / FORMER
        remedy = f"; the one before is in {aside}" if (aside / path.name).is_file() else "; make one with indexer twin"
        raise ParameterError(
            f"twin must be the folder of a finished twin, got {folder}, which holds no twin.yaml{remedy}."
        )
    with reading(path):
        about = _yaml(path)
    if about.get("format") != FORMAT:
        raise ParameterError(f"{path} must be the head of a twin, got another file; name the folder that twin wrote.")
    if about.get("version") != VERSION:
        got = about.get("version")
        raise ParameterError(f"{path} must be of version {VERSION}, got {got}; make the twin anew with this software.")
    with reading(path):
        for key, below in _HELD.items():
            if about.get(key) is None:
                raise KeyError(key)
            for name in below:
                if name not in about[key]:
                    raise KeyError(f"{key}.{name}")
    return about


def machine_and_sensor(folder: Path) -> tuple[Machine, Sensor]:
    """The healthy machine and its sensor."""
    with reading(folder / "machine.yaml"):
        machine = machine_from_mapping(_yaml(folder / "machine.yaml"))
    with reading(folder / "sensor.yaml"):
        sensor = from_mapping(Sensor, _yaml(folder / "sensor.yaml"), "sensor")
    return machine, sensor


def stored_remains(folder: Path) -> Remains:
    """What healthy records leave."""
    with reading(folder / "remains.safetensors"):
        return Remains.restore(load_file(folder / "remains.safetensors"))


def networks_of(folder: Path, names: Sequence[str], faults: int, cells: Cells) -> tuple[nn.Module, ...]:
    """The networks of these names, "modes_0" for the first of kind modes."""
    found = []
    for name in names:
        network = KINDS[name.partition("_")[0]](faults, cells.count, cells.stations)
        path = folder / f"{name}.safetensors"
        with reading(path):
            network.load_state_dict(load_weights(path))
        found.append(network.eval())
    return tuple(found)


def faults_of(about: Mapping[str, Any], machine: Machine, sensor: Sensor) -> tuple[Fault, ...]:
    """The fault table of a twin."""
    fastest = float(about["range"]["motor_speed_rpm"][1]) * RPM
    return chosen(list(about["settings"]["faults"]), fastest, sensor, machine)


def view_of(about: Mapping[str, Any], remains: Remains) -> View:
    """What turns go through, from the range and the shift in twin.yaml."""

    def middle(key: str, factor: float) -> tuple[float, float]:
        low, high = (factor * float(value) for value in about["range"][key])
        return 0.5 * (low + high), 0.5 * (high - low)

    return View(remains, float(about["shift"]), middle("motor_speed_rpm", RPM), middle("load_torque", 1.0))


def synthesis_of(folder: Path, faults: Sequence[Fault], healthy: Healthy, view: View) -> Synthesis:
    """The simulator as it is fitted to turns."""
    path, posterior = folder / "synthesis.safetensors", folder / "posterior.parquet"
    with reading(path):
        held = load_file(path)
        components, square = Components.restore(held), {name: held[name] for name in SQUARE}
        own_load = float(held["own_load"][0])
    with reading(posterior):
        nuisance = Nuisance.of(posterior, own_load)
    return Synthesis(healthy, faults, view.remains.sigma, components, shapes=view.shapes, nuisance=nuisance, **square)
