"""What healthy records leave after calibration: a fixed part, and noise that follows speed and load.

    R(p) = s Σ_r w_r(p) R_r        σ²(p) = ω Σ_r w_r(p) λ_r²        w_r(p) ∝ 1 / (d_r²(p) + d₀²)

p is the operating point, ω its motor speed, R_r the fixed part of record r, d_r its distance from p as a share of the
range recorded. λ_r² ω_r is the variance of a cell in record r: a cell averages as many samples of white noise as it
lasts, 1/ω; what follows the load, as rattling does, is known from the records alone.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env import OperatingPoint
from twin.turns import Healthy, shift_shapes, without_shift

_ONE = 0.02
"""Relative difference of speeds, and of loads, that count as one where all records have the same [-]."""

_NEAR = 0.1
"""d₀²: square of the distance between operating points, as shares of the range recorded, at which a healthy record
counts half of what it does at its point."""


@dataclass(frozen=True, eq=False)
class Remains:
    """What healthy records leave.

    Attributes
    ----------
    points : ndarray (r, 2)
        Motor speed [rad/s] and load [N m] of each record.
    fixed : ndarray (r, stations, cells)
        R_r [unit of the sensor]
    levels : ndarray (r,)
        λ_r [unit of the sensor / √(rad/s)]
    spectrum : ndarray (cells // 2 + 1,)
        Amplitude of the noise of cells by order of the cam, where the standard deviation of a cell is 1.
    """

    points: np.ndarray
    fixed: np.ndarray
    levels: np.ndarray
    spectrum: np.ndarray

    def at(self, point: OperatingPoint) -> np.ndarray:
        """R (stations, cells) at an operating point: the records' own, the nearer ones for more, times `shared`."""
        return self.shared * self.parts(point).sum(axis=0)

    def parts(self, point: OperatingPoint) -> np.ndarray:
        """What each record's own part (r, stations, cells) has in the mean at an operating point."""
        weights = self._weights((point.motor_speed, point.load_torque))
        return weights[:, None, None] * self.fixed

    def sigma(self, point: OperatingPoint) -> float:
        """σ of a cell at an operating point [unit of the sensor]."""
        weights = self._weights((point.motor_speed, point.load_torque))
        return float(np.sqrt(point.motor_speed * (weights * self.levels**2).sum()))

    @property
    def sigmas(self) -> np.ndarray:
        """σ (r,) that each record showed itself [unit of the sensor]."""
        return self.levels * np.sqrt(self.points[:, 0])

    @functools.cached_property
    def shared(self) -> float:
        """s: how much of what is predicted of a record by the others it shows, by least squares, 0 to 1: what belongs
        to one record alone is none of the machine's at another operating point. 1 of a single record, which nothing
        tells."""
        if len(self.fixed) == 1:
            return 1.0
        there, predicted = [], []
        for k, point in enumerate(self.points):
            weights = self._weights(point) * (np.arange(len(self.points)) != k)
            there.append(self.fixed[k].ravel())
            predicted.append(np.tensordot(weights / weights.sum(), self.fixed, 1).ravel())
        found = float((np.array(predicted) ** 2).sum())
        return min(max(float((np.array(there) * predicted).sum()) / found, 0.0), 1.0) if found > 0.0 else 0.0

    def _weights(self, point: Sequence[float] | np.ndarray) -> np.ndarray:
        """Weights (r,) of the records at a motor speed and load."""
        weights = 1.0 / (_apart(self.points, point, self.points) + _NEAR)
        return weights / weights.sum()

    def with_those_of(self, before: Remains) -> Remains:
        """These and those of earlier records of the same machine near whose operating points there is no newer one."""
        span = np.concatenate([before.points, self.points])
        kept = [k for k, point in enumerate(before.points) if _apart(self.points, point, span).min() > _NEAR]
        power = len(self.points) * self.spectrum**2 + len(kept) * before.spectrum**2
        rows = {n: np.concatenate([getattr(self, n), getattr(before, n)[kept]]) for n in ("points", "fixed", "levels")}
        return Remains(**rows, spectrum=np.sqrt(power / (len(self.points) + len(kept))))

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name, for a file."""
        arrays = {f"remains.{field.name}": getattr(self, field.name) for field in dataclasses.fields(self)}
        return {**arrays, "remains.fixed": self.fixed.astype(np.float32)}

    @classmethod
    def restore(cls, arrays: Mapping[str, np.ndarray]) -> Remains:
        """What gave these arrays."""
        return cls(**{field.name: arrays[f"remains.{field.name}"].astype(float) for field in dataclasses.fields(cls)})


def _apart(points: np.ndarray, point: Sequence[float] | np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Squares (r,) of the distances of points (r, 2) from another one, as shares of the range recorded."""
    span = np.maximum(np.ptp(recorded, axis=0), np.maximum(1e-9, _ONE * np.abs(recorded).max(axis=0)))
    return (((points - point) / span) ** 2).sum(axis=1)


def remains_of(
    turns: Sequence[np.ndarray], points: Sequence[OperatingPoint], shifts: float, healthy: Healthy
) -> Remains:
    """What is left of healthy turns (k, stations, cells) of each record.

    The fixed part is the mean over a record's cam turns, on it that of each station; either is shrunk by how much of it
    chance explains (James and Stein), so that noise is not learned by heart. What they take of the noise's variance is
    put back into the rest: a part that is the mean of n cam turns, of which the share c is kept, takes c (2 − c)/n. Of
    a single turn nothing tells what its stations differ by from noise, and all of it counts as noise.
    """
    fixed, levels, power = [], [], []
    for mine, point in zip(turns, points, strict=True):
        reference = healthy.turn(point)
        left = mine - reference
        shapes = shift_shapes(reference, shifts)
        for k in range(len(left)):
            left[k] = without_shift(left[k], shapes, float(np.median(np.abs(np.diff(left[k], 2)))) / 1.65)
        count, stations = left.shape[:2]
        common = left.mean(axis=(0, 1))
        whole = _kept(common, float(left.reshape(-1, left.shape[2]).var(axis=0, ddof=1).mean()) / (count * stations))
        common *= whole
        own = left.mean(axis=0) - common
        kept = _kept(own, float(left.var(axis=0, ddof=1).mean()) / count) if count > 1 else 0.0
        fixed.append(common + kept * own)
        # of the common mean, what the shrinking left of it is in each station's own part once more
        lost = 1.0 - (1.0 - kept) ** 2 * np.array([1.0, (1.0 - whole) ** 2])
        taken = ((stations - 1) * lost[0] + lost[1]) / (stations * count)
        rest = (left - fixed[-1]).reshape(-1, left.shape[2]) / np.sqrt(1.0 - taken)
        sigma = float(rest.std())
        levels.append(sigma / np.sqrt(point.motor_speed))
        power.append((np.abs(np.fft.rfft(rest / max(sigma, 1e-300), axis=1)) ** 2).mean(axis=0))
    each = [len(mine) for mine in turns]
    at = np.array([(p.motor_speed, p.load_torque) for p in points])
    return Remains(at, np.array(fixed), np.array(levels), np.sqrt(np.average(power, axis=0, weights=each)))


def _kept(mean: np.ndarray, variance: float) -> float:
    """Share of a mean that its own variance does not explain."""
    found = float((mean**2).mean())
    return max(0.0, 1.0 - variance / found) if found > 0.0 else 0.0
