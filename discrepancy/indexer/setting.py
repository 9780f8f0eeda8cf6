"""What a fitted model says of its records, for causes to be compared: what it leaves of them, the motion it simulates,
and what torques and accelerations beside it would add to the readings.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.model import IndexerModel
from discrepancy.indexer.nuisance import free_responses
from discrepancy.indexer.parameters import OfRecords
from discrepancy.indexer.reading import filters_of, passed
from discrepancy.indexer.response import Response, motion_of
from discrepancy.origin import Laid
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.machine import Machine

_RATE = 320.0
"""Hz to which records are averaged: machines move below 100 Hz."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A simulated motion and what it is linearised to.

    Attributes
    ----------
    machine : Machine
    laid : Laid
        Residuals, averaged to `_RATE`.
    motion : mapping of str to ndarray (w, n)
        As of `response.ROWS`.
    response : Response
    unit : ndarray (w,)
        Reading over the noise per acceleration, before the filters.
    table : ndarray (w,)
        Inertia of the table in each window [kg m²].
    passes : ndarray (f,) of complex
        What the sensor's filters pass on of each frequency of a window that is continued by as many zeros; empty where
        it has none.
    """

    machine: Machine
    laid: Laid
    motion: dict[str, np.ndarray]
    response: Response
    unit: np.ndarray
    table: np.ndarray
    passes: np.ndarray

    def readings(self, torque: np.ndarray, joint: str) -> np.ndarray:
        """What torques (w, n, k) add to what is read, over the noise."""
        return self.read(self.response(torque, joint))

    def read(self, acceleration: np.ndarray) -> np.ndarray:
        """What is read of accelerations (w, n, k), over the noise, the filters at rest before."""
        return self._filtered(self.unit[:, None, None] * acceleration, self.passes)

    def pulled(self, row: np.ndarray, joint: str) -> np.ndarray:
        """z (w, n) for which Σ z u is the product of a row (w, n) with the readings of torques u (w, n)."""
        back = self._filtered(row[..., None], self.passes.conj())[..., 0]
        return self.response.backwards(self.unit[:, None] * back, joint)

    def _filtered(self, rows: np.ndarray, passes: np.ndarray) -> np.ndarray:
        if not len(passes):
            return rows
        n = rows.shape[1]
        spectrum = np.fft.rfft(rows, 2 * n, axis=1) * passes[:, None]
        return np.fft.irfft(spectrum, 2 * n, axis=1)[:, :n] * self.laid.inside[..., None]

    @property
    def rate(self) -> np.ndarray:
        """Speed (w, n) of the cam over its rms."""
        return self.motion["cam_rate"] / self.rms(self.motion["cam_rate"])

    def rms(self, row: np.ndarray) -> float:
        """Of a row (w, n) over all windows."""
        return math.sqrt(float((row[self.laid.inside] ** 2).mean())) or 1.0


def setting_of(model: IndexerModel, place: Point) -> Setting:
    """The records of a model at a fitted place."""
    problem = Problem(model, place.hypothesis)
    r, by_global, by_local = problem.linearised(place)
    machine, motion = motion_of(model, place)
    sensor = model.machine_at(place.hypothesis, place.z)[1]
    filters = filters_of(sensor, model.sample_rate)
    if filters:
        by_local = np.concatenate([by_local, _remembered(filters, model.counts)])
    every = _every(model)
    counts = model.counts // every
    inside = np.asarray(np.arange(int(counts.max())) < counts[:, None])
    inside &= np.isfinite(motion["table_acc"][:, :1])
    averaged = functools.partial(_averaged, inside=inside, every=every)
    motion = {name: averaged(row) for name, row in motion.items()}
    rate = model.sample_rate / every
    time = (model.windows.first[:, None] / every + np.arange(inside.shape[1]) + 0.5) / rate
    step = np.full(len(counts), 1.0 / rate)
    free = problem.movable
    laid = Laid(
        averaged(r), np.moveaxis(averaged(by_global[free]), 0, 2), np.moveaxis(averaged(by_local), 0, 2),
        problem.known[free].astype(float), place.z[free], inside, model.groups, time, step,
    )  # fmt: skip
    noise = np.array([e.noise_level for e in model.experiments])[model.groups]
    of_records = OfRecords(model.parameters, len(model.experiments))
    own = of_records.value("inertia", np.repeat(place.z[None], len(counts), axis=0), model.groups)
    table = machine.table_inertia * np.exp(own)
    response = Response(machine, motion, inside, step, table)
    frequencies = np.fft.rfftfreq(2 * inside.shape[1], 1.0 / rate) if filters else np.zeros(0)
    passes = passed(filters, frequencies, model.sample_rate)
    return Setting(machine, laid, motion, response, sensor.scale / noise, table, passes)


def residual_at(model: IndexerModel, place: Point, inside: np.ndarray) -> np.ndarray:
    """What a place leaves of the readings (w, n), in noise, where `inside` of a setting of the same model is true."""
    return _averaged(Problem(model, place.hypothesis).left(place), inside, _every(model))


def _every(model: IndexerModel) -> int:
    """Samples that are averaged to one."""
    return max(1, round(model.sample_rate / _RATE))


def _averaged(rows: np.ndarray, inside: np.ndarray, every: int) -> np.ndarray:
    """Means (..., w, n) of so many samples each of rows (..., w, m); 0 outside."""
    n = inside.shape[1]
    missing = n * every - rows.shape[-1]
    if missing > 0:
        rows = np.concatenate([rows, np.zeros((*rows.shape[:-1], missing))], axis=-1)
    blocks = rows[..., : n * every].reshape(*rows.shape[:-1], n, every)
    return np.where(inside, np.nan_to_num(blocks).mean(axis=-1), 0.0)


def _remembered(filters: Sequence[np.ndarray], counts: np.ndarray) -> np.ndarray:
    """What filters may remember (k, w, n) of the time before windows of so many samples: unknown, as a start state."""
    free = np.zeros((2 * sum(map(len, filters)), len(counts), int(counts.max())))
    for count in np.unique(counts).tolist():
        basis = free_responses(filters, count)
        free[: len(basis), counts == count, :count] = basis[:, None]
    return free
