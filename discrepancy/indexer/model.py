"""The indexing machine as a model whose records can be explained."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.indexer.library import library
from discrepancy.indexer.parameters import base_parameters, changed, record_parameters
from discrepancy.indexer.states import LOCAL, play_grid, start_states
from discrepancy.indexer.windows import Experiment, cut
from discrepancy.model import NONE, Hypothesis, Jobs, Model
from indexer_env.coefficients import Coefficients, Pack, coefficients
from indexer_env.effects import Effect, MachineEffect, SensorEffect, make_effect
from indexer_env.engine import LARGEST_DEFLECTION, prepare_kernel, run_kernel
from indexer_env.errors import refuse
from indexer_env.filters import filtered
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor

_STEP = 1e-3
"""Largest step of the integrator [s]: with landings on the edges its error stays fifty times below 1.5 % noise, from no
play to 20 degrees of it and with every effect."""

_HARMONICS = 40
"""Orders of the cam turn that the black box may use: up to 40 Hz at the reference speed, beyond the machine's modes."""

_SLIP_ROUNDS = 3
"""Windows simulated to find how much faster than the mean speed a slipping motor's command is."""

_MOTOR_ANGLE, _MOTOR_RATE, _COMMAND = (
    layout.STATE_NAMES.index(name) for name in ("motor_angle", "motor_rate", "motor_command")
)

_LEAST_WINDOWS = 4
"""Whole cam turns below which a fit of some twelve parameters says nothing."""

_BAD = 1e3
"""Normalised residual of a run that left the physical range: worse than any that did not."""


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
    known : tuple of Hypothesis
        Effects the machine is known to have, their parameters to be fitted.
    without : tuple of str
        Effects that are not looked for.
    """

    channel = layout.TABLE_ACC
    """Row of the kernel's workspace that the sensor reads."""

    def __init__(
        self,
        machine: Machine,
        experiments: Sequence[Experiment],
        sensor: Sensor | None = None,
        uncertainty: Mapping[str, float] | None = None,
        known: tuple[Hypothesis, ...] = (),
        without: tuple[str, ...] = (),
    ) -> None:
        self.machine, self.experiments, self.known, self.without = machine, tuple(experiments), known, without
        self.sensor, self.uncertainty = sensor or Sensor(), dict(uncertainty or {})
        for experiment in self.experiments:
            if experiment.signal.unit != self.sensor.unit:
                remedy = "set Sensor.radius for an accelerometer in m/s^2, leave it out for rad/s^2"
                raise refuse("IndexerModel", "experiments", f"in {self.sensor.unit}", experiment.signal.unit, remedy)
        base = base_parameters(machine, self.uncertainty)
        self._n_machine = len(base)
        of_records = tuple(p for k, e in enumerate(self.experiments) for p in record_parameters(k, e))
        self.parameters = base + of_records + tuple(p for h in known for p in h.parameters)
        self._cut()

    def _cut(self) -> None:
        reduction = self.machine.reduction
        rates = [reduction * e.operating_point.motor_speed for e in self.experiments]
        self.windows = cut(
            [len(e.signal.values) for e in self.experiments],
            [rate / e.signal.sample_rate for rate, e in zip(rates, self.experiments, strict=True)],
            [e.operating_point.start_angle for e in self.experiments],
        )
        w = self.windows
        if len(w.first) < _LEAST_WINDOWS:
            rule = f"records that hold {_LEAST_WINDOWS} whole cam turns or more in all"
            raise refuse("IndexerModel", "experiments", rule, len(w.first), "record for longer")
        self.counts, self.groups = w.count, w.record
        self._rates = np.array(rates)
        self._starts = np.array([e.operating_point.start_angle for e in self.experiments])
        self._start_scales = np.array([e.start_uncertainty for e in self.experiments])
        self._speed_scales = np.array([e.speed_uncertainty for e in self.experiments])
        self._sample_rates = np.array([e.signal.sample_rate for e in self.experiments])
        self._noise = np.array([e.noise_level for e in self.experiments])
        self._measured = np.zeros((len(w.first), int(w.count.max())))
        for i, (record, first, count) in enumerate(zip(w.record, w.first, w.count, strict=True)):
            self._measured[i, :count] = self.experiments[record].signal.values[first : first + count]
        self._inside = np.arange(self._measured.shape[1]) < w.count[:, None]

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        names = [effect.name for effect in self.machine.effects] + [h.name for h in self.known]
        return library(self.machine, (*names, *self.without))

    def extended(self, hypothesis: Hypothesis) -> IndexerModel:
        known = (*self.known, hypothesis)
        return IndexerModel(self.machine, self.experiments, self.sensor, self.uncertainty, known, self.without)

    def features(self) -> np.ndarray:
        """Fourier series over the cam phase, constant and growing with the square of the speed."""
        w = self.windows
        time = (w.first[:, None] + np.arange(self._measured.shape[1])) / self._sample_rates[w.record][:, None]
        phase = self._starts[w.record][:, None] + self._rates[w.record][:, None] * time
        harmonics = np.arange(1, _HARMONICS + 1) * phase[:, :, None]
        series = np.concatenate([np.ones((*phase.shape, 1)), np.cos(harmonics), np.sin(harmonics)], axis=2)
        square = (self._rates[w.record] / self._rates.max()) ** 2
        return np.concatenate([series, series * square[:, None, None]], axis=2)

    def local_count(self, hypothesis: Hypothesis) -> int:
        loose = any(h.name == "base.looseness" for h in (*self.known, hypothesis))
        return len(LOCAL) if loose else len(LOCAL) - 2

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        item = coefficients(self.machine_at(hypothesis, point)[0], OperatingPoint())
        play = 2.0 * max(item["edge_1"], 0.0)
        if play == 0.0:
            return np.zeros((0, 2))
        size = 7 if play < 2e-3 else 13
        return play_grid(item["stiffness_1"], item["cam_inertia"], play, size, size)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        extended = [self.machine_at(hypothesis, point) for point in jobs.points]
        acceleration = self._simulate(jobs, [machine for machine, _ in extended])
        out = np.empty_like(acceleration)
        sensors: dict[Sensor, list[int]] = {}
        for p, (_, sensor) in enumerate(extended):
            sensors.setdefault(sensor, []).append(p)
        measured = self._measured[jobs.window]
        for sensor, points in sensors.items():
            mine = np.flatnonzero(np.isin(jobs.point, points)) if len(sensors) > 1 else slice(None)
            out[mine] = self._read(sensor, acceleration[mine], jobs.window[mine]) - measured[mine]
            if sensor.hum_amplitude != self.sensor.hum_amplitude:
                out[mine] = self._with_hum(sensor, out[mine], jobs.window[mine])
        out /= self._noise[self.windows.record[jobs.window]][:, None]
        np.copyto(out, _BAD, where=~np.isfinite(out))
        np.copyto(out, 0.0, where=~self._inside[jobs.window])
        return np.clip(out, -_BAD, _BAD, out=out)

    def values(self, hypothesis: Hypothesis, point: np.ndarray) -> dict[str, float]:
        """Values of all global parameters by name."""
        parameters = self.parameters + hypothesis.parameters
        return {p.name: p.value(z) for p, z in zip(parameters, point, strict=True)}

    def machine_at(self, hypothesis: Hypothesis, point: np.ndarray) -> tuple[Machine, Sensor]:
        """Machine and sensor that a global point stands for."""
        values = self.values(hypothesis, point)
        machine = changed(self.machine, {p.name: values[p.name] for p in self.parameters[: self._n_machine]})
        sensor = self.sensor
        for effect in (effect_of(h, values) for h in (*self.known, hypothesis) if h.name != NONE.name):
            if isinstance(effect, MachineEffect):
                machine = machine.with_effects(effect)
            elif isinstance(effect, SensorEffect):
                sensor = effect.extend_sensor(sensor)
        return machine, sensor

    def _simulate(self, jobs: Jobs, machines: list[Machine]) -> np.ndarray:
        """True accelerations (n, samples) of the jobs' windows."""
        w, n_records = self.windows, len(self.experiments)
        items: dict[tuple[int, int], Coefficients] = {}
        record = w.record[jobs.window]
        keys = jobs.point * n_records + record
        for key in np.unique(keys):
            p, r = divmod(int(key), n_records)
            items[p, r] = coefficients(machines[p], self.experiments[r].operating_point)
        start, speed = self._motion(jobs, record)
        drive = start + speed * w.first[jobs.window] / self._sample_rates[record]
        out = np.full((len(keys), self._measured.shape[1]), np.nan)
        groups: dict[tuple[int, int], list[int]] = {}
        for (p, r), item in items.items():
            groups.setdefault((item.model, item.features), []).append(p * n_records + r)
        for (model, features), members in groups.items():
            mine = np.flatnonzero(np.isin(keys, members))
            rows = np.stack([items[divmod(int(k), n_records)].row for k in keys[mine]])
            pieces = next(iter(items.values())).law.pieces
            rows[:, layout.COEFFICIENT_NAMES.index("law_count")] = len(pieces)
            states = start_states(
                rows, drive[mine], speed[mine], w.turn[jobs.window[mine]].astype(float), jobs.states[mine]
            )
            counts, sample_rates = w.count[jobs.window[mine]], self._sample_rates[record[mine]]
            pack = Pack(model, features, states, rows, pieces)
            if features & layout.USES_SLIP:
                self._let_slip(pack, keys[mine], counts, sample_rates)
            out[mine] = self._run(pack, counts, sample_rates)
        return out

    def _motion(self, jobs: Jobs, record: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Drive angle at the record's first sample [rad] and its rate [rad/s] of each job (n,)."""
        z = jobs.points[jobs.point]
        of_start, of_speed = self._n_machine + 2 * record, self._n_machine + 2 * record + 1
        at = np.arange(len(record))
        start = self._starts[record] + z[at, of_start] * self._start_scales[record]
        return start, self._rates[record] * (1.0 + z[at, of_speed] * self._speed_scales[record])

    def _let_slip(self, pack: Pack, keys: np.ndarray, counts: np.ndarray, sample_rates: np.ndarray) -> None:
        """Set command and start rate of slipping motors so that each cam turn takes as long as it was measured to.

        What the motor loses in one index it makes up for in the dwell, so one window of each machine and record tells
        how much faster the command is than the mean speed, and at which rate a window ends and the next one starts.
        """
        every = self._every(sample_rates)
        _, one, of = np.unique(keys, return_index=True, return_inverse=True)
        time = (counts[one] * every - 1) / (sample_rates[one] * every)
        mean, rate = pack.states[one, _MOTOR_RATE], pack.states[one, _MOTOR_RATE]
        command = mean
        for _ in range(_SLIP_ROUNDS):
            states = pack.states[one].copy()
            states[:, _MOTOR_RATE], states[:, _COMMAND] = rate, command
            start = states[:, _MOTOR_ANGLE].copy()
            trial = Pack(pack.model, pack.features, states, pack.coefficients[one], pack.pieces)
            self._run(trial, counts[one], sample_rates[one])
            lost = mean - (states[:, _MOTOR_ANGLE] - start) / time
            failed = ~np.isfinite(lost + states[:, _MOTOR_RATE])
            command, rate = command + lost, states[:, _MOTOR_RATE]
            # a run that fails here fails below as well, where it counts as worse than any that does not
            command[failed], rate[failed] = mean[failed], mean[failed]
        pack.states[:, _MOTOR_RATE], pack.states[:, _COMMAND] = rate[of], command[of]

    @staticmethod
    def _every(sample_rates: np.ndarray) -> int:
        """Integrator steps per sample."""
        return max(1, math.ceil(1.0 / (float(sample_rates.min()) * _STEP) - 1e-9))

    def _run(self, pack: Pack, counts: np.ndarray, sample_rates: np.ndarray) -> np.ndarray:
        """Advance a pack; the channel (n, samples), NaN behind a run's end."""
        prepare_kernel(pack)
        every, n = self._every(sample_rates), len(counts)
        out = np.full((n, 1, self._measured.shape[1]), np.nan)
        status, when = np.zeros(n, dtype=np.int64), np.zeros(n)
        run_kernel((
            pack.model, pack.features, pack.states, pack.coefficients, pack.pieces,
            counts.astype(np.int64) * every - 1, 1.0 / (sample_rates * every), np.zeros(n),
            every, np.array([self.channel], dtype=np.int64), LARGEST_DEFLECTION, out, status, when,
        ))  # fmt: skip
        out[status != layout.RUNNING] = np.nan
        return out[:, 0]

    def _read(self, sensor: Sensor, acceleration: np.ndarray, window: np.ndarray) -> np.ndarray:
        """The sensor's reading (n, samples) of windows that each begin in a dwell. What still rings there of the turn
        before is as if that had been the same turn."""
        y = acceleration * sensor.scale
        record = self.windows.record[window]
        rate = float(self._sample_rates[record[0]])
        sections = sensor.sections(rate)
        if sections:
            y = np.where(np.isfinite(y), y, _BAD)
            turn_before = np.arange(-y.shape[1], 0) % self.windows.count[window][:, None]
            y = np.concatenate([np.take_along_axis(y, turn_before, axis=1), y], axis=1)
            for section in sections:
                y = filtered(section, y)
            y = y[:, y.shape[1] // 2 :]
        if sensor.offset == 0.0 and sensor.offset_drift == 0.0 and self.sensor.hum_amplitude == 0.0:
            return y
        time = (self.windows.first[window][:, None] + np.arange(y.shape[1])) / rate
        quiet = dataclasses.replace(sensor, hum_amplitude=self.sensor.hum_amplitude)
        return quiet.with_background(y, time)

    def _with_hum(self, sensor: Sensor, difference: np.ndarray, window: np.ndarray) -> np.ndarray:
        """Simulated less measured readings (n, samples) with hum, in each window with the phase that fits best: the
        mains frequency wanders, so that no phase holds for a whole record."""
        rate = self._sample_rates[self.windows.record[window]][:, None]
        angle = 2.0 * math.pi * sensor.hum_hz * np.arange(difference.shape[1]) / rate
        inside = np.where(self._inside[window] & np.isfinite(difference), difference, 0.0)
        cosine, sine = np.cos(angle), np.sin(angle)
        a, b = ((inside * wave).sum(axis=1, keepdims=True) for wave in (cosine, sine))
        size = np.maximum(np.hypot(a, b), 1e-300)
        amplitude = sensor.hum_amplitude - self.sensor.hum_amplitude
        return difference - amplitude * (a * cosine + b * sine) / size


def effect_of(hypothesis: Hypothesis, values: Mapping[str, float]) -> Effect:
    """The effect a hypothesis stands for at these parameter values."""
    start = f"{hypothesis.name}."
    own = {name.removeprefix(start): value for name, value in values.items() if name.startswith(start)}
    return make_effect(hypothesis.name, {**own, **hypothesis.fixed})
