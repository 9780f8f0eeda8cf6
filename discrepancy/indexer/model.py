"""The indexing machine as a model whose records can be explained."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from discrepancy.indexer.advance import COMMAND, in_parts, let_slip, samples_per_step, step_of, steps_per_sample
from discrepancy.indexer.library import Seen, library
from discrepancy.indexer.lines import lines
from discrepancy.indexer.machines import Machines
from discrepancy.indexer.parameters import OfRecords, base_parameters, record_parameters, scaled
from discrepancy.indexer.reading import ReadAs, Reading, bounded, numbered
from discrepancy.indexer.states import LOCAL, play_grid, start_states
from discrepancy.indexer.together import Together
from discrepancy.indexer.windows import LEAST_WINDOWS, Experiment, check_alike, check_rest, covering, windows_of
from discrepancy.model import Hypothesis, Jobs, Model
from indexer_env.coefficients import PLACES, Coefficients, Pack, coefficients
from indexer_env.effects.measures import measures
from indexer_env.errors import refuse
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


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
        check_rest(machine)
        check_alike(self.experiments, self.sensor.unit)
        base = base_parameters(machine, self.uncertainty)
        base = together.parameters if together else base
        of_records = tuple(p for k, e in enumerate(self.experiments) for p in record_parameters(k, e))
        self.parameters = base + of_records + tuple(p for effect in known for p in effect.parameters)
        self._machines = Machines(machine, self.sensor, self.parameters, known, together)
        self._of_records = OfRecords(self.parameters, len(self.experiments))
        self._cut()

    def _cut(self) -> None:
        self.windows = w = windows_of(self.experiments, self.machine.reduction)
        if len(w.first) < LEAST_WINDOWS:
            rule = f"records that hold {LEAST_WINDOWS} whole cam turns or more in all"
            raise refuse("IndexerModel", "experiments", rule, len(w.first), "record for longer")
        empty = set(range(len(self.experiments))) - set(w.record.tolist())
        if empty:
            rule, got = "records that hold a whole cam turn each", f"none in number {min(empty) + 1}"
            raise refuse("IndexerModel", "experiments", rule, got, "record for longer, or leave it out")
        self._rates = np.array([self.machine.reduction * e.operating_point.motor_speed for e in self.experiments])
        self._fastest = float(self._rates.max()) / self.machine.reduction
        self._loads = np.array([e.operating_point.load_torque for e in self.experiments])
        self._starts = np.array([e.operating_point.start_angle for e in self.experiments])
        self._lengths_of = np.array([len(e.signal.values) for e in self.experiments])
        self._sample_rates = np.array([e.signal.sample_rate for e in self.experiments])
        self.sample_rate = float(self._sample_rates[0])
        self._noise = np.array([e.noise_level for e in self.experiments])
        self._begun = np.array([e.begun for e in self.experiments])
        self._periods = 2.0 * math.pi * self._sample_rates / self._rates
        self._lay_out()

    def _lay_out(self) -> None:
        w = self.windows
        self.counts, self.groups = w.count, w.record
        measured = np.zeros((len(w.first), int(w.count.max())))
        for i, (record, first, count) in enumerate(zip(w.record, w.first, w.count, strict=True)):
            measured[i, :count] = self.experiments[record].signal.values[first : first + count]
        self._inside = np.arange(measured.shape[1]) < w.count[:, None]
        self._reading = self.sensed(measured, w.count, w.first, self._begun[w.record], self.sample_rate)

    def part(self, windows: int) -> IndexerModel:
        """Successive cam turns of each record that show all stations, and of samples that lie closer than the
        integrator's steps one for each step."""
        chosen = covering(self.windows, self.machine.stations, windows)
        item = coefficients(self.machine, OperatingPoint())
        step = step_of(item.model, item.features, item.row[None], item.law, self._fastest)
        every = samples_per_step(self.sample_rate, step, self.sensor)
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
        full, groups = self.with_all_samples(), range(len(self.experiments))
        rows = [residual[full.groups == k][full._inside[full.groups == k]] for k in groups]
        return lines(rows, full.sample_rate, (self._rates / self.machine.reduction / (2.0 * math.pi)).tolist())

    def kin(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        if self._machines.together is not None:
            return np.zeros((0, len(point)))  # the common scale is one of the directions
        return scaled(self.parameters + hypothesis.parameters, point)

    def repeats(self) -> Sequence[tuple[int, int]]:
        return self.windows.repeats(self.machine.stations)

    def recording(self, readings: np.ndarray) -> IndexerModel:
        other = copy.copy(self)
        measured = np.where(self._inside, readings, 0.0) * self._noise[self.groups][:, None]
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
        extended = self._machines.coefficients(hypothesis, jobs.points)
        clock = self._of_records.value("clock", jobs.points[jobs.point], self.windows.record[jobs.window])
        sensors, sensor_of = numbered([s for _, s in extended], self.sensor, jobs.point, clock, self.sample_rate)
        for some, made in self._advanced(jobs, [item for item, _ in extended], (self.channel,), sensor_of):
            for number in np.unique(sensor_of[some]).tolist():
                # one sensor's jobs stand side by side
                mine = np.flatnonzero(sensor_of[some] == number)
                window = jobs.window[some[mine]]
                rows = reading(sensors[number], made[mine[0] : mine[-1] + 1, 0], window)
                rows *= (1.0 / self._noise[self.windows.record[window]])[:, None]
                yield some[mine], rows, bounded(rows, self.counts[window])

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
        out = np.empty((len(jobs.window), len(channels), self._inside.shape[1]))
        for some, made in self._advanced(jobs, items, channels, np.zeros(len(jobs.window), dtype=int)):
            out[some] = made
        return out

    def _advanced(
        self, jobs: Jobs, items: Sequence[Coefficients], channels: Sequence[int | np.integer], beside: np.ndarray
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """The same, some jobs at a time, which fit into a core's cache; those of one number in `beside` (n,) stand side
        by side."""
        w, n_records, samples = self.windows, len(self.experiments), self._inside.shape[1]
        record = w.record[jobs.window]
        # a row for each point under the load of each record
        kind = jobs.point * n_records + record
        of_point, of_record = np.divmod(np.arange(len(items) * n_records), n_records)
        pieces = items[0].law.pieces
        table = np.stack([item.row for item in items])[of_point]
        table[:, PLACES["law_count"]] = len(pieces)
        load, inertia = (self._of_records.value(name, jobs.points[of_point], of_record) for name in ("load", "inertia"))
        table[:, PLACES["load_torque"]] *= self._loads[of_record] * (1.0 + load)
        table[:, PLACES["table_inertia"]] *= np.exp(inertia)
        drive, speed, rates = self._motion(jobs, record)
        counts = self.counts[jobs.window]
        # a block of the kernel takes as long as its longest window; the last, half empty, gets the shortest ones
        order = np.lexsort((-counts, beside))
        groups: dict[tuple[int, int], list[int]] = {}
        for k, item in enumerate(items):
            groups.setdefault((item.model, item.features), []).append(k)
        for (model, features), members in groups.items():
            mine, of_group = order, slice(None)
            if len(groups) > 1:
                mine, of_group = order[np.isin(jobs.point[order], members)], np.isin(of_point, members)
            rows, turn = table[kind[mine]], w.turn[jobs.window[mine]].astype(float)
            states = start_states(rows, drive[mine], speed[mine], turn, jobs.states[mine])
            pack = Pack(model, features, states, rows, pieces)
            sample_rates = rates[mine]
            step = step_of(model, features, table[of_group], items[0].law, self._fastest)
            every = steps_per_sample(self.sample_rate, step)
            if features & layout.USES_SLIP:
                of, begun, by = record[mine], w.first[jobs.window[mine]], self.machine.reduction
                ahead, command, motor = let_slip(
                    pack, kind[mine], sample_rates, every, self._periods[of], begun, self._lengths_of[of]
                )
                pack.states[:] = start_states(rows, drive[mine] + by * ahead, by * motor, turn, jobs.states[mine])
                pack.states[:, COMMAND] = command
            for part, made in in_parts(pack, counts[mine], sample_rates, every, channels, samples):
                yield mine[part], made

    def _motion(self, jobs: Jobs, record: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Drive angle [rad] and rate [rad/s] at the start of each job's window (n,), and its true sampling rate [Hz].

        With ω the mean rate over a record of length T and d what the speed drifts over it, the drive's angle is
        α0 + ω t (1 + d (t/T - 1)/2).
        """
        points = jobs.points[jobs.point]
        start, speed, drift, clock = (
            self._of_records.value(name, points, record) for name in ("start_angle", "speed", "drift", "clock")
        )
        sample_rate = self._sample_rates[record] * (1.0 + clock)
        time = self.windows.first[jobs.window] / sample_rate
        share = time * sample_rate / self._lengths_of[record]
        # the clock tells the speed as well: so many radians per sample stay
        rate = self._rates[record] * (1.0 + speed) * (1.0 + clock)
        angle = self._starts[record] + start + rate * time * (1.0 + 0.5 * drift * (share - 1.0))
        middle = share + 0.5 * self.counts[jobs.window] / self._lengths_of[record]
        return angle, rate * (1.0 + drift * (middle - 0.5)), sample_rate
