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
from twin.judge import Judge
from twin.learn import View
from twin.network import Told
from twin.turns import Cells, Healthy, Remains

RATE = 500.0
NOISE = 0.1
MACHINE = load_machine("smooth")
CELLS = Cells(8, 64, RATE)


def healthy() -> Healthy:
    """The reference machine without play."""
    return Healthy(MACHINE, Sensor(), CELLS)


def view() -> View:
    """Nothing left of healthy records; 1200 to 1500 rpm, 0 to 20 N m."""
    fixed = np.zeros((1, CELLS.stations, CELLS.count))
    spectrum = np.full(CELLS.count // 2 + 1, NOISE * CELLS.count**0.5)
    remains = Remains(np.array([[1350.0 * RPM, 10.0]]), fixed, spectrum, NOISE)
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

    def __init__(self, any_fault: float, faults: list[float], novelty: float = 1.0) -> None:
        super().__init__()
        self.any_fault, self.logits, self.strange = any_fault, faults, novelty

    def forward(self, x: torch.Tensor, conditions: torch.Tensor) -> Told:
        n, f = len(x), len(self.logits)
        logits = torch.tensor(self.logits).expand(n, f)
        seen = torch.asinh(x.mean(dim=1) * x.shape[1] ** 0.5) + self.strange
        return Told(logits, torch.full((n,), self.any_fault), torch.full((n, f), 0.5), torch.full((n, f), -3.0),
                    torch.zeros((n, x.shape[1])), seen)  # fmt: skip


JUDGE = Judge(alarm=0.0, reach=np.full(10, 2.0), novelty=np.array([0.0, 0.0, 0.0]), strange=1.0)
"""Alarm above 0, a novelty is usual at 1 and strange above e."""
