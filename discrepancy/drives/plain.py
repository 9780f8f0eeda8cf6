"""A whole record of the forward form simulated from one start state, without windows: for pictures and tests."""

from __future__ import annotations

import numpy as np

from discrepancy.drives.advance import WORK, run
from discrepancy.drives.forward import ForwardModel
from discrepancy.model import Hypothesis


def run_plain(
    model: ForwardModel, hypothesis: Hypothesis, point: np.ndarray, start: np.ndarray, k: int = 0
) -> np.ndarray:
    """Measured channels (channels, n) of the k-th record at a global point, in their own units."""
    parameters = model.parameters + hypothesis.parameters
    values = [p.value(z) for p, z in zip(parameters, point, strict=True)]
    joints, command = model.set_up(hypothesis, values)
    course = model.courses[k]
    out = np.zeros((model.channels, len(course.u)))
    work = np.zeros((WORK, max(len(start), len(joints), course.u.shape[1])))
    scale = np.maximum(np.abs(course.states).max(axis=0), 1e-12)
    run(
        model.rates, np.asarray(start, dtype=float), np.zeros(len(joints)), model.command(k, command), 0.0, course.rate,
        model.substeps, np.array(values[: model.own]), model.places, joints, model.measured, scale, work, out,
    )  # fmt: skip
    return out
