"""What twin.yaml says of a calibration and of the networks, and the small questions that stages share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from discrepancy.indexer import Experiment
from twin.calibrate import Calibrated
from twin.data import Turns
from twin.judge import sigmoid
from twin.turns import Healthy


def turns_of(experiment: Experiment, healthy: Healthy) -> np.ndarray:
    """Whole turns (k, stations, cells) of a record."""
    point = experiment.operating_point
    cam_rate = healthy.machine.reduction * point.motor_speed
    return healthy.cells.turns(experiment.signal.values, cam_rate, point.start_angle, experiment.signal.sample_rate)


def scores(told: dict[str, np.ndarray], rows: np.ndarray, turns: Turns) -> dict[str, float | None]:
    """How a network does on control turns: the share whose set of faults it names exactly, by how many there are; None
    where there is no such turn, as with several faults where the table has one."""
    named = sigmoid(told["faults"]) > 0.5
    there = turns.there[rows]
    right, number = (named == there).all(axis=1), there.sum(axis=1)
    groups = {"all": number >= 0, "healthy": number == 0, "one": number == 1, "several": number > 1}
    return {name: float(right[mine].mean()) if mine.any() else None for name, mine in groups.items()}


def span(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    # speeds that a motor is told alike differ by what the records show of slip and of the pulse
    return (low, high) if high - low > 0.01 * abs(high) else (0.5 * (low + high),) * 2  # type: ignore[return-value]


def calibration_card(found: Calibrated) -> dict[str, Any]:
    """What the card says of the calibration."""
    rows = []
    for path, unit, column in zip(found.paths, found.units, found.draws.T, strict=True):
        low, high = np.quantile(column, (0.025, 0.975))
        rows.append({
            "path": path, "unit": unit, "value": float(np.mean(column)), "low": float(low), "high": float(high)
        })  # fmt: skip
    return {
        "headline": found.headline, "verdict": found.verdict, "level": found.level,
        "findings": [
            {
                "effect": f.effect, "grade": f.grade, "values": {k: float(v) for k, v in f.values.items()},
                "interval": [float(v) for v in f.interval], "size": f.size, "rivals": list(f.rivals),
            }
            for f in found.findings
        ],
        "parameters": rows, "scale_spread": found.scale_spread,
        "spread": {k: float(v) for k, v in found.spread.items()}, "notes": list(found.notes),
    }  # fmt: skip
