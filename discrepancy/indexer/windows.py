"""Records of an indexing machine and the windows they are cut into: one cam turn each, begun shortly before an index.

In the dwell β' = 0: whatever the cam does inside its play does not reach the table, and the index that follows makes
contact anew. A window therefore needs only the few numbers of its own start state, however long the record is.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.noise import LEAST, autoregression, noise_of, shared_noise
from indexer_env.checks import check_number
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.signal import Signal
from indexer_records.measured import RATE_TOLERANCE

START_PHASE = 0.97
"""Cam phase [turns] at which a window starts: in the dwell, near enough to the index that the state is still simple."""

_KEPT = 0.6
"""Share of a cam turn that the last window of a record must hold to be kept."""

LEAST_WINDOWS = 4
"""Whole cam turns below which a fit of some twelve parameters says nothing."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """One record and what was known when it was taken.

    Attributes
    ----------
    signal : Signal
        The table's acceleration.
    operating_point : OperatingPoint
        The motor's mean speed, load torque and the cam angle at the first sample.
    noise : float or None
        Standard deviation of the measuring noise [unit of the signal], > 0; estimated from the record where not given.
    start_uncertainty : float
        Standard deviation with which the cam angle at the first sample is known [rad], > 0.
    speed_uncertainty : float
        Relative standard deviation with which the mean speed is known [-], > 0; a once-per-turn pulse gives it to about
        the start angle's uncertainty over the record's cam angle.
    drift_uncertainty : float
        Standard deviation of the change of the speed from the record's start to its end, over its mean [-], >= 0.
    load_uncertainty : float
        Relative standard deviation of the load torque [-], >= 0.
    clock_uncertainty : float
        Relative standard deviation of the logger's sampling rate [-], >= 0.
    inertia_uncertainty : float
        Relative standard deviation by which the table's inertia is another one in this record [-], >= 0.
    begun : float
        Time of the first sample since the sensor's record began [s], >= 0, where this is a part of it: the sensor's
        offset drifts from there.
    estimate : tuple of float or None
        Standard deviation of the noise and its correlation from sample to sample where they were estimated before: a
        record that was resampled shows them no more. Estimated from the signal where not given.
    start_compared : bool
        Whether the cam angle at the first sample was neither stated nor told by a pulse, but found by comparison with
        the nominal machine, so that stations are not known.
    """

    signal: Signal
    operating_point: OperatingPoint
    noise: float | None = None
    start_uncertainty: float = 2e-3
    speed_uncertainty: float = 1e-4
    drift_uncertainty: float = 2e-3
    load_uncertainty: float = 0.05
    clock_uncertainty: float = 2e-3
    inertia_uncertainty: float = 0.0
    begun: float = 0.0
    estimate: tuple[float, float] | None = None
    start_compared: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.signal, Signal):
            raise refuse("Experiment", "signal", "a Signal", self.signal)
        if not isinstance(self.operating_point, OperatingPoint):
            raise refuse("Experiment", "operating_point", "an OperatingPoint", self.operating_point)
        if self.noise is not None:
            check_number("Experiment", "noise", self.noise, low=0.0, low_open=True, unit=self.signal.unit)
        start, speed = self.start_uncertainty, self.speed_uncertainty
        check_number("Experiment", "start_uncertainty", start, low=0.0, low_open=True, unit="rad")
        check_number("Experiment", "speed_uncertainty", speed, low=0.0, low_open=True)
        for name in ("drift_uncertainty", "load_uncertainty", "clock_uncertainty", "inertia_uncertainty"):
            check_number("Experiment", name, getattr(self, name), low=0.0)
        check_number("Experiment", "begun", self.begun, low=0.0, unit="s")

    @property
    def noise_level(self) -> float:
        """Standard deviation of the noise [unit of the signal], given or estimated."""
        return self.noise if self.noise is not None else self._estimated[0]

    @property
    def colour(self) -> float:
        """Correlation of the noise from sample to sample, estimated."""
        return self._estimated[1]

    def thinned(self, every: int) -> Experiment:
        """The record with one in `every` samples, as if it had been taken so: nothing is filtered, and what noise lies
        above half the new rate stays."""
        values, rate = self.signal.values[::every], self.signal.sample_rate / every
        signal = dataclasses.replace(self.signal, values=values, sample_rate=rate)
        return dataclasses.replace(self, signal=signal, noise=self.noise_level, estimate=None)

    def quieter(self, share: float, colour: float) -> Experiment:
        """The record with this share of the noise that was estimated, and its colour; itself where noise is stated. The
        record alone does not show it, so that it counts as stated from here on."""
        if self.noise is not None:
            return self
        noise = share * self.noise_level
        return dataclasses.replace(self, noise=noise, estimate=(noise, colour))

    @functools.cached_property
    def _estimated(self) -> tuple[float, float]:
        return self.estimate or noise_of(self.signal.values, self.signal.sample_rate)


def noise_shown(experiments: Sequence[Experiment], residuals: Sequence[np.ndarray]) -> tuple[float, float]:
    """The noise that residuals (n,) of records show, as a share of that which was estimated of them, and its
    correlation from sample to sample: of sensors whose noise was estimated apart that of the one that shows most; 1
    where none was, or where a record is too short to tell."""
    own = [(row, one) for row, one in zip(residuals, experiments, strict=True) if one.noise is None]
    rate = experiments[0].signal.sample_rate
    if not own or any(autoregression([row], rate) is None for row, _ in own):
        return 1.0, 0.0
    sensors = {one.noise_level: [row for row, other in own if other.noise_level == one.noise_level] for _, one in own}
    share, colour = max(shared_noise(rows, rate) for rows in sensors.values())
    return max([share, *(LEAST * float(one.signal.values.std()) / one.noise_level for _, one in own)]), colour


@dataclass(frozen=True, eq=False)
class Windows:
    """All windows of all experiments.

    Attributes
    ----------
    record, first, count, turn : ndarray (w,) of int
        Which record; its first sample and how many; the cam turn, counted from angle 0, whose index it holds.
    """

    record: np.ndarray
    first: np.ndarray
    count: np.ndarray
    turn: np.ndarray

    @functools.cached_property
    def turns(self) -> list[tuple[int, int]]:
        """Record and cam turn of each window."""
        return [(int(r), int(t)) for r, t in zip(self.record, self.turn, strict=True)]

    def repeats(self, stations: int) -> list[tuple[int, int]]:
        """Windows of one record that leave the same station, one turn of the table apart."""
        at = {turn: k for k, turn in enumerate(self.turns)}
        return [(at[r, t - stations], k) for k, (r, t) in enumerate(self.turns) if (r, t - stations) in at]

    def some(self, which: Sequence[int]) -> Windows:
        """Some of the windows."""
        return Windows(*(column[list(which)] for column in (self.record, self.first, self.count, self.turn)))


def windows_of(experiments: Sequence[Experiment], reduction: float) -> Windows:
    """Windows of experiments on a machine whose cam turns by `reduction` of its motor's turns."""
    rates = [reduction * e.operating_point.motor_speed for e in experiments]
    return cut(
        [len(e.signal.values) for e in experiments],
        [rate / e.signal.sample_rate for rate, e in zip(rates, experiments, strict=True)],
        [e.operating_point.start_angle for e in experiments],
    )


def check_alike(experiments: Sequence[Experiment], unit: str) -> None:
    """Refuse no records, such in another unit than the sensor's, or of several sampling rates."""
    if not experiments:
        raise refuse("IndexerModel", "experiments", "one or more", [], "give the records of the model")
    for experiment in experiments:
        if experiment.signal.unit != unit:
            remedy = "set Sensor.radius for an accelerometer in m/s^2, leave it out for rad/s^2"
            raise refuse("IndexerModel", "experiments", f"in {unit}", experiment.signal.unit, remedy)
    rates = sorted(experiment.signal.sample_rate for experiment in experiments)
    if rates[-1] - rates[0] > RATE_TOLERANCE * rates[0]:
        got = f"{rates[0]:g} to {rates[-1]:g} Hz"
        raise refuse("IndexerModel", "experiments", "of one sampling rate", got, "resample them to the lowest")


def check_enough(windows: Windows, records: int) -> None:
    """Refuse so many records that hold too few windows, or one that holds none."""
    if len(windows.first) < LEAST_WINDOWS:
        rule = f"records that hold {LEAST_WINDOWS} whole cam turns or more in all"
        raise refuse("IndexerModel", "experiments", rule, len(windows.first), "record for longer")
    empty = set(range(records)) - set(windows.record.tolist())
    if empty:
        rule, got = "records that hold a whole cam turn each", f"none in number {min(empty) + 1}"
        raise refuse("IndexerModel", "experiments", rule, got, "record for longer, or leave it out")


def check_rest(machine: Machine) -> None:
    """Refuse a cam that still moves the table where the windows begin."""
    pieces = machine.motion_law.pieces(machine.stations, machine.motion_share)
    moving = (pieces.coefficients[:, 1:] != 0.0).any(axis=1) & (pieces.edges[1:] > START_PHASE)
    if moving.any():
        until = float(pieces.edges[1:][moving].max())
        remedy = "a record of such a cam cannot be cut into windows that start at rest"
        raise refuse("Machine", "motion_law", f"at rest from cam phase {START_PHASE} to 1", until, remedy)


def cut(lengths: list[int], steps: list[float], starts: list[float]) -> Windows:
    """Windows of records of so many samples, the drive side turning by `steps` [rad per sample] from `starts` [rad]."""
    rows = []
    for record, (length, step, start) in enumerate(zip(lengths, steps, starts, strict=True)):
        turn = math.ceil(start / (2.0 * math.pi) - START_PHASE)
        edges = []
        while True:
            sample = math.ceil(((turn + START_PHASE) * 2.0 * math.pi - start) / step)
            if sample >= length:
                break
            edges.append((sample, turn + 1))
            turn += 1
        ends = [*(sample for sample, _ in edges[1:]), length][: len(edges)]
        for (first, number), end in zip(edges, ends, strict=True):
            if (end - first) * step >= _KEPT * 2.0 * math.pi:
                rows.append((record, first, end - first, number))
    return Windows(*np.array(rows, dtype=np.int64).reshape(-1, 4).T)


def covering(windows: Windows, stations: int, count: int) -> list[tuple[int, int]]:
    """Record and cam turn of about so many windows, or of as many as there are stations: successive turns of each
    record, those that make the numbers of times that each station is seen most equal. What a short record has less than
    its share, the others have more; and all have more until every station is seen that a record shows."""
    records = [[turn for turn in windows.turns if turn[0] == record] for record in np.unique(windows.record)]
    shown, chosen = len({turn % stations for _, turn in windows.turns}), list[tuple[int, int]]()
    for least in range(max(count, stations), max(count, stations, len(windows.turns)) + 1):
        chosen = _runs(sorted(records, key=len), stations, least)
        if len({turn % stations for _, turn in chosen}) == shown:
            break
    return sorted(chosen)


def _runs(records: Sequence[list[tuple[int, int]]], stations: int, count: int) -> list[tuple[int, int]]:
    """Record and cam turn of so many windows, successive ones of each record (the shorter ones first): in turns, each
    record takes those that make the stations' numbers most equal beside what the others have."""
    runs, left = list[list[list[tuple[int, int]]]](), count
    for k, mine in enumerate(records):
        share = max(1, math.ceil(left / (len(records) - k)))
        runs.append([mine[begin : begin + share] for begin in range(max(1, len(mine) - share + 1))])
        left -= len(runs[k][0])
    seen = [np.array([np.bincount([t % stations for _, t in run], minlength=stations) for run in own]) for own in runs]
    # nothing of those that have not yet had their turn
    taken, before = [np.zeros(stations, dtype=int) for _ in runs], list[int]()
    best = [-1] * len(runs)
    while best != before:
        before = best.copy()
        for k, own in enumerate(seen):
            total = own + sum(one for other, one in enumerate(taken) if other != k)
            best[k] = int((total**2).sum(axis=1).argmin())
            taken[k] = own[best[k]]
    return [turn for own, number in zip(runs, best, strict=True) for turn in own[number]]
