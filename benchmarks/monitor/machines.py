"""What the measurements share: a model, lives of machines, and a pipeline that is fed by hand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import torch

from classifier.model import load_model
from datagen.shard import read_shards
from monitor.alarms import Limits, Rules
from monitor.analysis.classifier import ClassifierDiagnoser
from monitor.intake.blocks import NANO, Block
from monitor.plan import CHANGE, Plan
from monitor.sources import demo

WORK = Path("benchmarks/monitor/.work")
RADIUS_M = 0.4


def model(records: int = 3000) -> ClassifierDiagnoser:
    """The demonstration's model, taught on more records; made once."""
    folder = (WORK / f"model-{records}").resolve()
    torch.set_num_threads(1)
    folder.parent.mkdir(parents=True, exist_ok=True)
    demo.make_model(folder, records)
    return ClassifierDiagnoser([load_model(folder)])


def data_set(name: str, *overrides: str) -> Path:
    """A data set of `datagen`; made once for each name."""
    folder = (WORK / name).resolve()
    if not (folder / "manifest.json").is_file():
        subprocess.run([sys.executable, "-m", "datagen", f"out={folder}", "overwrite=true", *overrides], check=True)
    return folder


def plan(play: tuple[float, float, float] = (3.0, 6.0, 20.0)) -> Plan:
    """Limits of the measurements: those of conf/monitor.yaml, but danger where the campaign's life ends."""
    limits = {
        "backlash_deg": Limits(*play),
        "crack": Limits(0.15, 0.25, 0.4),
        "looseness": Limits(0.3, 0.5, 0.8),
        CHANGE: Limits(1.5, 3.0, 6.0),
    }
    return Plan(limits, Rules(), sensor_radius=RADIUS_M)


def lives(folder: Path) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Each machine's records (n, samples), true remaining turns (n,) and true play (n,) [degrees]."""
    data = read_shards(folder)
    draws = data.table.column("machine_draw").to_numpy()
    left = data.table.column("remaining_turns").to_numpy()
    play = np.degrees(data.table.column("fault_backlash").to_numpy())
    return [(data.records[draws == one], left[draws == one], play[draws == one]) for one in np.unique(draws)]


def block(machine: str, record: np.ndarray, start_s: float) -> Block:
    """A whole turn as a recording of its own."""
    return Block(machine, round(start_s * NANO), 1000.0, "m/s^2", record, begins=True)
