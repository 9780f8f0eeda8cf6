"""The constant offset of a sensor: a table that indexes has no acceleration on the average of a cam turn."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from scipy.stats import t

from discrepancy.records.reading import Record

_CHANCE = 1e-4
"""Probability below which a mean other than the sensor's own offset is one: few cam turns tell little."""


def first_dwell_of(motion_share: float, start_angle: float) -> float:
    """Cam angle [rad] from a first sample, taken at `start_angle`, to the middle of the first dwell."""
    return (math.pi * (1.0 + motion_share) - start_angle) % (2.0 * math.pi)


def without_offset(
    record: Record, cam_rate: float, first_dwell: float, stated: float
) -> tuple[Record, list[str]]:  # fmt: skip
    """The record less the offset that it has beyond the one stated [unit of the signal], and what is to be said of it.

    The mean m_k of cam turn k is that of the sensor, a + b t: over a turn from dwell to dwell the table's rate gains
    nothing. A drift b is an effect of the library, so a alone is taken out, where Student's law leaves no doubt of it.
    `first_dwell` is the cam angle from the first sample to the middle of the first dwell [rad]: turns that are cut in
    the motion would lose more and more of it where the speed drifts.
    """
    signal = record.signal
    length, first = (angle / cam_rate * signal.sample_rate for angle in (2.0 * math.pi, first_dwell))
    count = int((len(signal.values) - first) / length)
    if count < 3:
        return record, []
    ends = np.rint(first + np.arange(count + 1) * length).astype(int)
    means = np.add.reduceat(signal.values[: ends[-1]], ends[:-1]) / np.diff(ends) - stated
    columns = np.stack([np.ones(count), (ends[:-1] + ends[1:]) / (2.0 * length)], axis=1)
    (offset, _), squares, _, _ = np.linalg.lstsq(columns, means, rcond=None)
    variance = float(squares.sum()) / (count - 2) * np.linalg.inv(columns.T @ columns)[0, 0]
    if 2.0 * t.sf(abs(offset) / math.sqrt(variance + 1e-300), count - 2) >= _CHANCE:
        return record, []
    level = dataclasses.replace(signal, values=signal.values - offset)
    said = f"{record.name}: the sensor reads {stated + offset:.3g} {signal.unit} at rest; its offset is taken out"
    return dataclasses.replace(record, signal=level), [said]
