"""Points of a model as the kernel takes them: all that is the same for each window of a record and each start state."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.advance import steps_of, steps_per_sample
from discrepancy.indexer.parameters import OfRecords
from discrepancy.indexer.windows import Experiment
from discrepancy.model import Parameter
from indexer_env.coefficients import PLACES, Coefficients, LawTable


@dataclass(frozen=True, eq=False)
class Group:
    """Points that one call of the kernel may advance.

    Attributes
    ----------
    model, features : int
        As of `Coefficients`.
    every : int
        Integrator steps from sample to sample.
    points : ndarray (p,) of bool
        Which points these are.
    """

    model: int
    features: int
    every: int
    points: np.ndarray


@dataclass(frozen=True, eq=False)
class LaidOut:
    """Points under the conditions of all records, a row or column p r + k for each point p and record k of r.

    Attributes
    ----------
    records : int
        r.
    table : ndarray (p r, COEFFICIENT_ROWS)
        Coefficients under the record's load.
    start, rate, drift, clock, sample_rate : ndarray (p r,)
        Drive angle at the record's first sample [rad], mean rate of the drive side [rad/s], what it drifts by over the
        record, over itself, by how much its sampling rate is higher than stated, relatively, and that rate [Hz].
    groups : list of Group
    law : LawTable
    """

    records: int
    table: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    drift: np.ndarray
    clock: np.ndarray
    sample_rate: np.ndarray
    groups: list[Group]
    law: LawTable

    def motion(
        self, kind: np.ndarray, first: np.ndarray, counts: np.ndarray, lengths: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Drive angle [rad] and rate [rad/s] at the start of windows (n,) of some kinds (n,), by their first samples,
        how many they have, and those of their records.

        With ω the mean rate over a record of length T and d what the speed drifts over it, the drive's angle is
        α0 + ω t (1 + d (t/T - 1)/2).
        """
        sample_rate, rate, drift = self.sample_rate[kind], self.rate[kind], self.drift[kind]
        time = first / sample_rate
        share = time * sample_rate / lengths
        angle = self.start[kind] + rate * time * (1.0 + 0.5 * drift * (share - 1.0))
        middle = share + 0.5 * counts / lengths
        return angle, rate * (1.0 + drift * (middle - 0.5))


class Conditions:
    """What is stated of records.

    Parameters
    ----------
    experiments : sequence of Experiment
    reduction : float
        Of the machine.
    parameters : sequence of Parameter
        Of the model.
    """

    def __init__(self, experiments: Sequence[Experiment], reduction: float, parameters: Sequence[Parameter]) -> None:
        self.rates = np.array([reduction * e.operating_point.motor_speed for e in experiments])
        self.fastest = float(self.rates.max()) / reduction
        self.loads = np.array([e.operating_point.load_torque for e in experiments])
        self.starts = np.array([e.operating_point.start_angle for e in experiments])
        self.lengths = np.array([len(e.signal.values) for e in experiments])
        self.sample_rates = np.array([e.signal.sample_rate for e in experiments])
        self.noise = np.array([e.noise_level for e in experiments])
        self.begun = np.array([e.begun for e in experiments])
        self.periods = 2.0 * math.pi * self.sample_rates / self.rates
        self._of_records = OfRecords(parameters, len(experiments))

    def laid_out(self, items: Sequence[Coefficients], points: np.ndarray, *, apart: bool) -> LaidOut:
        """Points (p, g) whose coefficients these are; where they are `apart`, each takes steps of its own, and all of
        one group else take the same ones."""
        records = len(self.rates)
        of_point, record = np.divmod(np.arange(len(items) * records), records)
        start, speed, drift, load, clock, inertia = self._of_records.values(points[of_point], record)
        table = np.repeat(np.stack([item.row for item in items]), records, axis=0)
        table[:, PLACES["law_count"]] = len(items[0].law.pieces)
        table[:, PLACES["load_torque"]] *= self.loads[record] * (1.0 + load)
        table[:, PLACES["table_inertia"]] *= np.exp(inertia)
        # the clock tells the speed as well: so many radians per sample stay
        rate = self.rates[record] * (1.0 + speed) * (1.0 + clock)
        sample_rate = self.sample_rates[record] * (1.0 + clock)
        groups = self._grouped(items, table.reshape(len(items), records, -1), apart)
        return LaidOut(
            records, table, self.starts[record] + start, rate, drift, clock, sample_rate, groups, items[0].law
        )

    def _grouped(self, items: Sequence[Coefficients], rows: np.ndarray, apart: bool) -> list[Group]:
        """Groups of points with rows (p, r, c)."""
        kinds: dict[tuple[int, int], list[int]] = {}
        for k, item in enumerate(items):
            kinds.setdefault((item.model, item.features), []).append(k)
        found: dict[tuple[int, int, int], np.ndarray] = {}
        for (model, features), members in kinds.items():
            mine = rows[members]
            steps = steps_of(model, features, mine.reshape(-1, mine.shape[2]), items[0].law, self.fastest)
            steps = steps.reshape(mine.shape[:2]).min(axis=1)
            for k, step in zip(members, steps.tolist() if apart else [float(steps.min())] * len(members), strict=True):
                every = steps_per_sample(float(self.sample_rates[0]), step)
                points = found.setdefault((model, features, every), np.zeros(len(items), dtype=bool))
                points[k] = True
        return [Group(*kind, points) for kind, points in found.items()]
