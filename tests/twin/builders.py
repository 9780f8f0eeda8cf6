"""Small parts of a twin, made without a fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from discrepancy.records.conditions import Conditions
from indexer_env import Machine, OperatingPoint, Sensor, Signal, load_machine, simulate
from indexer_env.run import Run
from indexer_env.units import RPM
from twin.components import Components
from twin.faults import chosen
from twin.judge import Judge
from twin.learn import View
from twin.network import Told
from twin.nuisance import Nuisance
from twin.remains import Remains
from twin.synthesis import Synthesis
from twin.turns import Cells, Healthy
from twin.weigh import Weights

RATE = 500.0
NOISE = 0.1
MACHINE = load_machine("smooth")
CELLS = Cells(8, 64, RATE)


def healthy() -> Healthy:
    """The reference machine without play."""
    return Healthy(MACHINE, Sensor(), CELLS)


def view() -> View:
    """Nothing left of healthy records but white noise, `NOISE` at 1350 rpm; 1200 to 1500 rpm, 0 to 20 N m."""
    fixed = np.zeros((1, CELLS.stations, CELLS.count))
    spectrum, levels = np.full(CELLS.count // 2 + 1, CELLS.count**0.5), np.array([NOISE / (1350.0 * RPM) ** 0.5])
    remains = Remains(np.array([[1350.0 * RPM, 10.0]]), fixed, levels, spectrum)
    return View(remains, 0.002, (1350.0 * RPM, 150.0 * RPM), (10.0, 10.0))


RANGE = {"motor_speed_rpm": [1200.0, 1500.0], "load_torque": [0.0, 20.0]}


def record(
    machine: Machine = MACHINE, rpm: float = 1400.0, load: float = 5.0, turns: float = 1.1, start: float = 3.0,
    **changes: Any,
) -> tuple[Signal, Conditions]:  # fmt: skip
    """A record without noise, and what is stated of it."""
    point = OperatingPoint(rpm * RPM, load, start)
    samples = int(turns * machine.turn_duration(point) * RATE)
    run = Run(RATE, samples, warmup_turns=1)
    values = simulate(machine, point, run).table_acceleration
    stated = {"motor_speed": rpm * RPM, "load_torque": load, "start_angle": start, **changes}
    return Signal(values, RATE, unit="rad/s^2", source="today.csv"), Conditions(**stated)


class Fixed(nn.Module):
    """A network that always says the same."""

    def __init__(self, any_fault: float, faults: list[float]) -> None:
        super().__init__()
        self.any_fault, self.logits = any_fault, faults

    def forward(self, x: torch.Tensor, conditions: torch.Tensor) -> Told:
        n, f = len(x), len(self.logits)
        logits = torch.tensor(self.logits).expand(n, f)
        return Told(logits, torch.full((n,), self.any_fault), torch.full((n, f), 0.5), torch.full((n, f), -3.0),
                    torch.zeros((n, x.shape[1])))  # fmt: skip


JUDGE = Judge(alarm=0.0, reach=np.full((10, 2), 2.0))
"""Alarm above 0."""

WEIGHTS = Weights(
    np.array([-1.0, 1.0]), np.full((10, 2), 2.0), 0.0, 0.0, float(np.log(4.0)), 4.0, 4.0, np.zeros(10, dtype=bool)
)
"""Named where a size is above 1.2 standard deviations; strange where four times the noise's power is left."""


KNOWN = Nuisance((), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
"""Nothing is open of the machine."""


def components(modes: int = 32, patterns: int = 0) -> Components:
    """Cosines as axes of a turn's mean and differences alike, cosines of the table's angle as patterns."""
    cell, station = (np.arange(CELLS.count) + 0.5) / CELLS.count, (np.arange(CELLS.stations) + 0.5) / CELLS.stations
    axes = np.cos(np.pi * np.arange(modes) * cell[:, None])
    axes /= np.sqrt((axes**2).sum(axis=0))
    rows = np.cos(np.pi * np.arange(1, patterns + 1)[:, None] * station) / np.sqrt(CELLS.stations / 2.0)
    return Components(axes, axes, rows)


def synthesis(
    names: tuple[str, ...] = ("crack", "loose_base", "reducer_play"), modes: int = 32, patterns: int = 0
) -> Synthesis:
    """White noise as covariance."""
    along, seen = components(modes, patterns), view()
    nothing = np.zeros((along.count, along.count))
    return Synthesis(
        healthy(), chosen(names), seen.remains.sigma, along, np.eye(along.count), nothing, nothing, seen.shapes, KNOWN
    )
