"""Before any fault occurs: the smallest size of each that will be seen, at each operating point.

The probability of an alarm is fitted as a logistic function of ln t to turns of machines of the posterior, and read off
where it reaches the stated power.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize
from torch import nn

from indexer_env import Machine, OperatingPoint
from indexer_env.units import RPM
from twin.data import Turns
from twin.faults import Fault
from twin.judge import Judge, looked_at
from twin.learn import View

SMALLEST = 3e-3
"""Smallest size tried, as share of the largest."""

TRIED = 60
"""Turns of each fault at each operating point."""

_HELD = 0.05
"""Weight of a weak prior on the slope, which keeps it finite where all sizes tried are told apart."""


@dataclass(frozen=True)
class Seen:
    """The smallest size of a fault that is seen at an operating point; None where not even the largest is."""

    fault: str
    motor_speed_rpm: float
    load_torque: float
    size: float | None
    told: float | None
    unit: str

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        return dict(vars(self))


def points_of(speeds: Sequence[float], loads: Sequence[float]) -> list[OperatingPoint]:
    """Corners and middle of the range [rpm, N m]."""
    corners = list(itertools.product(dict.fromkeys(speeds), dict.fromkeys(loads)))
    middle = (0.5 * sum(speeds), 0.5 * sum(loads))
    return [OperatingPoint(s * RPM, t) for s, t in dict.fromkeys([*corners, middle])]


def seen_of(
    networks: Sequence[nn.Module], turns: Turns, fault: Fault, place: int, view: View, judge: Judge, machine: Machine,
    power: float, seed: int,
) -> list[Seen]:  # fmt: skip
    """Smallest sizes of one fault, number `place` of the table, at each operating point of turns that have it alone."""
    told, rows = looked_at(networks, turns, view, np.arange(len(turns.x)), seed)
    alarm, size = told["any"] > judge.alarm, np.abs(turns.size[rows, place])
    found = []
    for number, point in enumerate(turns.points):
        mine = turns.point[rows] == number
        smallest = size_at(np.log(size[mine]), alarm[mine], power)
        shop = None if smallest is None else float(fault.told(smallest, machine))
        rpm, load = round(point.motor_speed / RPM, 3), round(point.load_torque, 3)
        found.append(Seen(fault.name, rpm, load, smallest, shop, fault.unit))
    return found


def size_at(logs: np.ndarray, alarm: np.ndarray, power: float) -> float | None:
    """Size t at which an alarm has this probability, from ln t (n,) and alarms (n,); None where it is above 1."""
    centre = float(logs.mean())

    def loss(p: np.ndarray) -> float:
        z = p[0] + np.exp(p[1]) * (logs - centre)
        return float((np.logaddexp(0.0, z) - alarm * z).sum()) + _HELD * float(p[1] ** 2)

    best = min((minimize(loss, (a, 1.0), method="Nelder-Mead") for a in (-2.0, 0.0, 2.0)), key=lambda r: r.fun)
    wanted = np.log(power / (1.0 - power))
    size = float(np.exp(centre + (wanted - best.x[0]) / np.exp(best.x[1])))
    return None if size > 1.0 else max(size, SMALLEST)


def worst(seen: Sequence[Seen], fault: str) -> float:
    """The smallest size that is seen at every operating point at which any is; 0 where none is at any: what is named
    all the same is then told whatever its size."""
    return max((one.size for one in seen if one.fault == fault and one.size is not None), default=0.0)
