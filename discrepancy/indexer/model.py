"""The indexing machine as a model whose records can be explained."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.indexer.advance import COMMAND, in_parts, let_slip, samples_per_step, steps_of
from discrepancy.indexer.laid_out import Conditions, LaidOut
from discrepancy.indexer.library import Seen, library
from discrepancy.indexer.lines import lines
from discrepancy.indexer.machines import Machines
from discrepancy.indexer.parameters import base_parameters, record_parameters, scaled
from discrepancy.indexer.reading import ReadAs, Reading, bounded, numbered, runs
from discrepancy.indexer.states import LOCAL, play_grid, start_states
from discrepancy.indexer.together import Together
from discrepancy.indexer.windows import (
    Experiment,
    check_alike,
    check_enough,
    check_rest,
    covering,
    noise_shown,
    windows_of,
)
from discrepancy.jobs import Jobs
from discrepancy.model import Hypothesis, Model
from indexer_env.coefficients import Coefficients, Pack, coefficients
from indexer_env.effects.measures import measures
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


@dataclass(frozen=True, eq=False)
class _At:
    """Points of a hypothesis laid out, with the different sensors and the number (p r,) of each point's and record's:
    a search asks for many start states at the same points."""

    hypothesis: Hypothesis
    points: bytes
    apart: bool
    laid: LaidOut
    sensors: list[Sensor]
    sensor_of: np.ndarray


class IndexerModel(Model):
    """A nominal machine, records of it, and the effects it may lack.

    Parameters
    ----------
    machine : Machine
        Model B; its effects are taken as they are.
    experiments : sequence of Experiment
    sensor : Sensor, optional
        The measuring chain as it is believed to be; ideal where not given.
    uncertainty : mapping, optional
        Relative standard deviations that replace those of `parameters.UNCERTAINTY`.
    without : tuple of str
        Effects that are not looked for.
    known : tuple of Hypothesis
        Single effects that the machine is known to have, their parameters to be fitted as its own are.
    together : Together, optional
        What is known of the machine's numbers together, in place of each for itself.
    """

    channel = layout.TABLE_ACC
    """Row of the kernel's workspace that the sensor reads."""

    sensed: type[Reading] = Reading
    """What it makes of that row."""

    _with_all: IndexerModel | None = None  # the windows of a part with the samples that were left out

    def __init__(
        self, machine: Machine, experiments: Sequence[Experiment], sensor: Sensor | None = None,
        uncertainty: Mapping[str, float] | None = None, without: tuple[str, ...] = (),
        known: tuple[Hypothesis, ...] = (), together: Together | None = None,
    ) -> None:  # fmt: skip
        self.machine, self.experiments, self.without, self.known = machine, tuple(experiments), without, known
        self.sensor, self.uncertainty = sensor or Sensor(), dict(uncertainty or {})
        self.names = tuple(one.signal.source for one in self.experiments)
        check_rest(machine)
        check_alike(self.experiments, self.sensor.unit)
        base = together.parameters if together else base_parameters(machine, self.uncertainty)
        of_records = tuple(p for k, e in enumerate(self.experiments) for p in record_parameters(k, e))
        self.parameters = base + of_records + tuple(p for effect in known for p in effect.parameters)
        self._machines = Machines(machine, self.sensor, self.parameters, known, together)
        self._cut()

    def _cut(self) -> None:
        self.windows = windows_of(self.experiments, self.machine.reduction)
        check_enough(self.windows, len(self.experiments))
        self._stated = Conditions(self.experiments, self.machine.reduction, self.parameters)
        self._fastest, self.sample_rate = self._stated.fastest, float(self._stated.sample_rates[0])
        self._last: _At | None = None
        self._lay_out()

    def _lay_out(self) -> None:
        w = self.windows
        self.counts, self.groups = w.count, w.record
        measured = np.zeros((len(w.first), int(w.count.max())))
        for i, (record, first, count) in enumerate(zip(w.record, w.first, w.count, strict=True)):
            measured[i, :count] = self.experiments[record].signal.values[first : first + count]
        self._inside = np.arange(measured.shape[1]) < w.count[:, None]
        self._reading = self.sensed(measured, w.count, w.first, self._stated.begun[w.record], self.sample_rate)

    def part(self, windows: int) -> IndexerModel:
        """Successive cam turns of each record that show all stations, and of samples that lie closer than the
        integrator's steps one for each step."""
        chosen = covering(self.windows, self.machine.stations, windows)
        item = coefficients(self.machine, OperatingPoint())
        step = steps_of(item.model, item.features, item.row[None], item.law, self._fastest)
        every = samples_per_step(self.sample_rate, float(step[0]), self.sensor)
        if every == 1:
            return self._of(chosen)
        thinned = tuple(one.thinned(every) for one in self.experiments)
        # the last window of a record may be long enough to be kept with all its samples and not with some of them
        if not set(chosen) <= set(windows_of(thinned, self.machine.reduction).turns):
            return self._of(chosen)
        thin = copy.copy(self)
        thin.experiments = thinned
        thin._cut()
        thin = thin._of(chosen)
        thin._with_all = self._of(chosen)
        return thin

    def _of(self, turns: Sequence[tuple[int, int]]) -> IndexerModel:
        """The model with the windows of these cam turns, (record, turn) each, alone."""
        own = self.windows.turns
        if len(turns) == len(own):
            return self
        other = copy.copy(self)
        other.windows = self.windows.some([own.index(turn) for turn in turns])
        other._lay_out()
        return other

    def among(self, whole: Model) -> np.ndarray:
        assert isinstance(whole, IndexerModel)
        of_all = whole.windows.turns
        return np.array([of_all.index(turn) for turn in self.windows.turns])

    def with_all_samples(self) -> IndexerModel:
        return self._with_all or self

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        orders, hums = ((), ()) if residual is None else self._lines(residual)
        sizes = measures(self.machine, self._fastest, abs(self.sensor.scale))
        seen = Seen(sizes, self.sample_rate, self.sensor.unit, orders, hums)
        return library(self.machine, self._has() | set(self.without), seen)

    def _has(self) -> set[str]:
        """Names of the effects that the machine has before any is looked for."""
        return {effect.name for effect in (*self.machine.effects, *self.known)}

    def _lines(self, residual: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Orders and frequencies at which lines stand in every record, residuals (w, n) of all samples end to end."""
        full, turns = self.with_all_samples(), self._stated.rates / self.machine.reduction / (2.0 * math.pi)
        return lines(full._end_to_end(residual), full.sample_rate, turns.tolist())

    def _end_to_end(self, residual: np.ndarray) -> list[np.ndarray]:
        """Residuals (w, n) of each record's windows, one behind the other."""
        return [residual[mine][self._inside[mine]] for k in range(len(self.experiments)) for mine in [self.groups == k]]

    def noise_left(self, residual: np.ndarray) -> tuple[float, float]:
        return noise_shown(self.experiments, self._end_to_end(residual))

    def with_noise(self, share: float, colour: float) -> IndexerModel:
        other = copy.copy(self)
        other.experiments = tuple(one.quieter(share, colour) for one in self.experiments)
        other._stated = Conditions(other.experiments, self.machine.reduction, self.parameters)
        other._with_all = self._with_all and self._with_all.with_noise(share, colour)
        return other

    def kin(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        if self._machines.together is not None:
            return np.zeros((0, len(point)))  # the common scale is one of the directions
        return scaled(self.parameters + hypothesis.parameters, point)

    def repeats(self) -> Sequence[tuple[int, int]]:
        return self.windows.repeats(self.machine.stations)

    def recording(self, readings: np.ndarray) -> IndexerModel:
        other = copy.copy(self)
        measured = np.where(self._inside, readings, 0.0) * self._stated.noise[self.groups][:, None]
        other._reading, other._with_all = dataclasses.replace(self._reading, measured=measured), None
        return other

    def local_count(self, hypothesis: Hypothesis) -> int:
        return len(LOCAL) if "base.looseness" in self._has() | set(hypothesis.names) else len(LOCAL) - 2

    def freed(self, hypothesis: Hypothesis) -> int:
        return super().freed(hypothesis) + ("sensor.mains_hum" in hypothesis.names)  # its phase (`nuisance`)

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        item = self.coefficients_at(hypothesis, point)
        return play_grid(item, self._fastest, shaken=shaken)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return self._whole(self._reading.difference, hypothesis, jobs)

    def readings(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return self._whole(self._reading.whole, hypothesis, jobs)

    def squares(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        out = np.empty(len(jobs.window))
        for mine, _, squares in self._seen_by(self._reading.difference, hypothesis, jobs):
            out[mine] = squares
        return out

    def _whole(self, reading: ReadAs, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        """What `reading` makes of all jobs (n, samples)."""
        out = np.empty((len(jobs.window), self._inside.shape[1]))
        for mine, rows, _ in self._seen_by(reading, hypothesis, jobs):
            out[mine] = rows
        return out

    def _seen_by(
        self, reading: ReadAs, hypothesis: Hypothesis, jobs: Jobs
    ) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Some jobs at a time, what `reading` makes of their true accelerations over the noise (k, samples), 0 beyond
        a window's end, and its sum of squares (k,)."""
        at = self._at(hypothesis, jobs)
        kind = jobs.point * at.laid.records + self.groups[jobs.window]
        sensor_of = at.sensor_of[kind]
        for some, made in self._advanced(jobs, at.laid, kind, (self.channel,), sensor_of):
            # one sensor's jobs stand side by side
            for part in runs(sensor_of[some]):
                mine = some[part]
                window = jobs.window[mine]
                rows = reading(at.sensors[sensor_of[mine[0]]], made[part, 0], window)
                yield mine, rows, bounded(rows, 1.0 / self._stated.noise[self.groups[window]], self.counts[window])

    def _at(self, hypothesis: Hypothesis, jobs: Jobs) -> _At:
        """The points of some jobs, or those of the last call where they are the same."""
        points, last = jobs.points.tobytes(), self._last
        if last and last.hypothesis is hypothesis and last.points == points and last.apart == jobs.apart:
            return last
        extended = self._machines.coefficients(hypothesis, jobs.points)
        laid = self._stated.laid_out([item for item, _ in extended], jobs.points, apart=jobs.apart)
        of_point = np.repeat(np.arange(len(extended)), laid.records)
        own = numbered([sensor for _, sensor in extended], self.sensor, of_point, laid.clock, self.sample_rate)
        self._last = _At(hypothesis, points, jobs.apart, laid, *own)
        return self._last

    def machine_at(self, hypothesis: Hypothesis, point: np.ndarray) -> tuple[Machine, Sensor]:
        """Machine and sensor that a global point stands for."""
        return self._machines.at(hypothesis, point)

    def coefficients_at(self, hypothesis: Hypothesis, point: np.ndarray) -> Coefficients:
        """Coefficients of that machine, its load the common error of all loads over what is stated."""
        return self._machines.coefficients(hypothesis, point[None])[0][0]

    def values(self, hypothesis: Hypothesis, point: np.ndarray) -> dict[str, float]:
        """Values of all global parameters by name."""
        return self._machines.values(hypothesis, point)

    def simulated(self, jobs: Jobs, items: Sequence[Coefficients], channels: Sequence[int | np.integer]) -> np.ndarray:
        """Rows of the kernel's workspace (n, channels, samples) over the jobs' windows, coefficients for each point."""
        laid = self._stated.laid_out(items, jobs.points, apart=False)
        out = np.empty((len(jobs.window), len(channels), self._inside.shape[1]))
        kind = jobs.point * laid.records + self.groups[jobs.window]
        for some, made in self._advanced(jobs, laid, kind, channels, np.zeros(len(kind), dtype=int)):
            out[some] = made
        return out

    def _advanced(
        self, jobs: Jobs, laid: LaidOut, kind: np.ndarray, channels: Sequence[int | np.integer], beside: np.ndarray
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """The same of jobs of a `kind` (n,), their point and record, some jobs at a time, which fit into a core's
        cache; those of one number in `beside` (n,) stand side by side."""
        samples, stated = self._inside.shape[1], self._stated
        # a block of the kernel takes as long as its longest window; the last, half empty, gets the shortest ones
        order = np.lexsort((-self.counts[jobs.window], beside))
        for group in laid.groups:
            mine = order if len(laid.groups) == 1 else order[group.points[jobs.point[order]]]
            if not len(mine):
                continue
            own, window, local = kind[mine], jobs.window[mine], jobs.states[mine]
            counts, turn = self.counts[window], self.windows.turn[window].astype(float)
            drive, speed = laid.motion(own, self.windows.first[window], counts, stated.lengths[self.groups[window]])
            rows, rates = laid.table.take(own, axis=0), laid.sample_rate[own]
            states = start_states(rows, drive, speed, turn, local)
            pack = Pack(group.model, group.features, states, rows, laid.law.pieces)
            if group.features & layout.USES_SLIP:
                of, begun, by = self.groups[window], self.windows.first[window], self.machine.reduction
                ahead, command, motor = let_slip(
                    pack, own, rates, group.every, stated.periods[of], begun, stated.lengths[of]
                )
                pack.states[:] = start_states(rows, drive + by * ahead, by * motor, turn, local)
                pack.states[:, COMMAND] = command
            for part, made in in_parts(pack, counts, rates, group.every, channels, samples):
                yield mine[part], made
