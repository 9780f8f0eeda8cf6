"""n machines under control, one kernel call per control period: the core of both environments.

Each machine has its own parameters, operating point, faults and generator. Machines share a call where they have the
same model (and the motor slips in all or none); what else some of them have acts in the others at its null value, which
changes no bit. An item's numbers therefore do not depend on its fleet: a fleet of one is the single environment.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from indexer_env.coefficients import PLACES, start_states
from indexer_env.control import ControlTask, Limits, dwell_begin, task_numbers
from indexer_env.engine import LARGEST_DEFLECTION, control_kernels, prepare_kernel, run_kernel
from indexer_env.faults import Faults
from indexer_env.kernels import layout
from indexer_env.kernels.control import BASE_LOAD, DWELL_BEGIN, ITEM_COLUMNS, NOMINAL_SPEED, OBSERVED, SLIPS
from indexer_env.law_table import LawTable
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensor_stream import SensorStream
from indexer_env.sensors import Sensor
from indexer_env.start import Start, items_of

ROWS = np.array([
    layout.TABLE_ACC, layout.CAM, layout.CAM_RATE, layout.TORQUE_1, layout.TORQUE_2, layout.TORQUE_3,
    layout.REGION_1, layout.REGION_2, layout.REGION_3,
    layout.DEFLECTION_1, layout.DEFLECTION_2, layout.DEFLECTION_3,
    layout.TABLE, layout.HOUSING, layout.MOTOR,
], dtype=np.int64)  # fmt: skip
"""What is recorded of a period; only the first two unless the truth is asked for or wear needs the work done."""

_FEW = 2
RATE, TORQUE_1, TORQUES, REGIONS = 2, 3, slice(3, 6), slice(6, 9)
_SCENE = {
    "table_acceleration": 0, "cam_angle": 1, "deflection_1": 9, "deflection_2": 10, "deflection_3": 11,
    "table_angle": 12, "housing_angle": 13, "motor_angle": 14,
}  # fmt: skip
"""Places in ROWS of what a picture needs."""

_KEPT = [PLACES[name] for name in ("law_first", "law_count", "load_torque", "motor_acceleration")]
CAM, _TIME = layout.STATE_NAMES.index("cam_angle"), layout.STATE_NAMES.index("time")


class Period(NamedTuple):
    """What a control period gives, in fresh arrays: observations (n, 7) float32, rewards (n,) of the formula in
    `IndexerEnv`, terminated (n,) bool, readings (n, m) in the sensor's unit."""

    observations: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    readings: np.ndarray


class Fleet:
    """n machines, started one by one and stepped together.

    Parameters
    ----------
    n : int
    task : ControlTask
    limits : Limits
    sensor : Sensor
    truth : bool
        Whether all of ROWS is recorded.
    """

    def __init__(self, n: int, task: ControlTask, limits: Limits, sensor: Sensor, *, truth: bool = False) -> None:
        self.task, self.truth = task, truth
        self._stream = SensorStream(sensor, task.sample_rate, n)
        self._plain = self._stream.plain
        self._numbers = task_numbers(task, limits, sensor.scale if self._plain else 0.0)
        self._samples, self._every = task.samples, task.steps_per_sample
        self._step = task.integrator_step
        self._states = np.zeros((n, layout.STATE_ROWS))
        self._coefficients = np.zeros((n, layout.COEFFICIENT_ROWS))
        self._items = np.zeros((n, ITEM_COLUMNS))
        self._n_steps = np.zeros(n, dtype=np.int64)
        self._steps, self._no_steps = np.full(n, self._step), np.zeros(n)
        self._status, self._status_time = np.zeros(n, dtype=np.int64), np.zeros(n)
        self._shares, self._cams = np.ones(n), np.zeros(n)
        self._observations = np.zeros((n, OBSERVED), dtype=np.float32)
        self._rows = ROWS if truth else ROWS[:_FEW]
        self._out = np.zeros((n, len(self._rows), self._samples + 1))
        self._starts: list[Start] = []
        self._laws: list[LawTable | None] = [None] * n
        self._laid: list[LawTable] = []
        self._pieces = np.zeros((0, layout.PIECE_COLUMNS))
        self._started, self._wearing = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        self._kinds, self._features = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self._groups: list[tuple[int, int, np.ndarray | None]] = []
        self._periods, self._turns = np.zeros(n, dtype=np.int64), np.zeros(n)
        self._work, self._booked = np.zeros(n), np.zeros(n)
        self._changing, self._any_changing = np.zeros(n, dtype=bool), False
        self._applied: list[Faults] = [Faults()] * n

    def __len__(self) -> int:
        return len(self._states)

    def start(self, index: Sequence[int], starts: Sequence[Start], rngs: Sequence[np.random.Generator]) -> np.ndarray:
        """Start items `index` (k,) anew; `rngs` has the generators of all items. Readings (k, m) are those of a period
        before the start in which the first acceleration lasted; what is seen then is in `observations`.

        Raises
        ------
        ParameterError
            A machine, its faults included, that does not fit its effects or the step. Nothing has then changed.
        """
        faults = [start.faults_at(0.0, 0.0) for start in starts]
        first = items_of(list(zip(starts, faults, strict=True)), self._step)
        changing = [place for place, start in enumerate(starts) if start.course.changes]
        ends = items_of([(starts[place], starts[place].worst) for place in changing], self._step)
        worst = dict(zip(changing, ends, strict=True))
        where = np.asarray(index, dtype=np.int64)
        self._starts = self._starts or [starts[0]] * len(self)
        for i, start, item, fault in zip(index, starts, first, faults, strict=True):
            self._starts[i], self._laws[i], self._applied[i] = start, item.law, fault
        points, rows = [start.operating_point for start in starts], np.stack([item.row for item in first])
        features = np.array([item.features for item in first])
        slips = (features & layout.USES_SLIP) // layout.USES_SLIP
        self._states[where], self._coefficients[where] = start_states(rows, points), rows
        self._kinds[where] = 2 * np.array([item.model for item in first]) + slips
        self._items[where, NOMINAL_SPEED] = [point.motor_speed for point in points]
        self._items[where, DWELL_BEGIN] = [dwell_begin(start.machine) for start in starts]
        self._items[where, BASE_LOAD], self._items[where, SLIPS] = rows[:, PLACES["load_torque"]], slips
        self._changing[where] = [start.course.changes for start in starts]
        self._wearing[where] = [start.course.backlash_per_joule > 0.0 for start in starts]
        for place, item in worst.items():
            features[place] |= item.features
        self._features[where] = features
        self._shares[where], self._started[where] = 1.0, True
        self._periods[where], self._work[where], self._booked[where] = 0, 0.0, 0.0
        self._n_steps[where] = self._samples * self._every
        self._arrange(where)
        return self._first_readings(where, rngs)

    def _arrange(self, where: np.ndarray) -> None:
        """Lay the laws' pieces side by side where one is new, and group the items that have been started."""
        places = {id(law): place for place, law in enumerate(self._laid)}
        if any(id(self._laws[i]) not in places for i in where):
            self._laid = list({id(law): law for law in self._laws if law is not None}.values())
            self._pieces = np.concatenate([law.pieces for law in self._laid])
            places = {id(law): place for place, law in enumerate(self._laid)}
            where = np.flatnonzero(self._started)
        own = [places[id(self._laws[i])] for i in where]
        counts = np.array([len(law.pieces) for law in self._laid])
        firsts = np.cumsum(counts) - counts
        self._coefficients[where[:, np.newaxis], _KEPT[:2]] = np.stack([firsts[own], counts[own]], axis=1)
        started = self._started
        self._groups = []
        for kind in np.unique(self._kinds[started]):
            members = np.flatnonzero(started & (self._kinds == kind))
            features = int(np.bitwise_or.reduce(self._features[members]))
            self._groups.append((int(kind) // 2, features, None if len(members) == len(self) else members))
        self._any_changing = bool(self._changing.any())
        rows = ROWS if self.truth or self._wearing.any() else ROWS[:_FEW]
        if len(self._rows) != len(rows):
            self._rows = rows
            self._out = np.zeros((len(self), len(rows), self._samples + 1))

    def _first_readings(self, where: np.ndarray, rngs: Sequence[np.random.Generator]) -> np.ndarray:
        """Put the tables of items on their laws, and read the sensor and the scene for the first time."""
        prepare_kernel()
        chosen = np.zeros(len(self), dtype=bool)
        chosen[where] = True
        for model, features, members in self._groups:
            index = where if members is None else members[chosen[members]]
            if len(index):
                self._run_some(model, features, index, np.zeros(len(index), dtype=np.int64))
        accelerations = self._out[where, 0, 0]
        self._out[where] = self._out[where, :, :1]
        self._stream.start(where, accelerations)
        first = self._stream.read(where, accelerations[:, np.newaxis], rngs)
        readings = np.repeat(first, self._samples, axis=1)
        look = control_kernels()[2]
        look(where, readings, self._states, self._coefficients, self._items, self._numbers, self._observations)
        self._turns[where] = np.floor(self._states[where, CAM] / (2.0 * math.pi))
        return readings

    def seed_noise(self, seed: int) -> None:
        """Start anew what draws the sensor's noise; here that is each item's own generator."""

    def step(self, actions: np.ndarray, live: np.ndarray | None, rngs: Sequence[np.random.Generator]) -> Period:
        """Run one control period under actions (n, k), checked. Of items that are not `live` (l,) no reading is made,
        and what the period holds of them means nothing; None: all are."""
        begin, end, _ = control_kernels()
        n, states, coefficients = len(self._states), self._states, self._coefficients
        begin(actions, states, coefficients, self._items, self._numbers, self._shares, self._cams, self._status)
        for model, features, members in self._groups:
            if members is None:
                run_kernel((
                    model, features, states, coefficients, self._pieces, self._n_steps, self._steps, self._no_steps,
                    self._every, self._rows, LARGEST_DEFLECTION, self._out, self._status, self._status_time,
                ))  # fmt: skip
            else:
                self._run_some(model, features, members, self._n_steps[members])
        readings, rewards, terminated = np.empty((n, self._samples)), np.empty(n), np.empty(n, dtype=np.bool_)
        if not self._plain:
            live = np.arange(n) if live is None else live
            readings[live] = self._stream.read(live, self._out[live, 0, 1:], rngs)
        end(
            self._out, readings, states, coefficients, self._items, self._numbers, self._cams, self._status,
            self._n_steps, self._observations, rewards, terminated,
        )  # fmt: skip
        if self._any_changing:
            self._change(terminated)
        return Period(self.observations, rewards, terminated, readings)

    def _run_some(self, model: int, features: int, index: np.ndarray, n_steps: np.ndarray) -> None:
        """Run items `index` (k,), which do not stand side by side."""
        states, rows = self._states[index], self._coefficients[index]
        status, when = self._status[index], self._status_time[index]
        out = np.empty((len(index), *self._out.shape[1:]))
        run_kernel((
            model, features, states, rows, self._pieces, n_steps, self._steps[index], self._no_steps[index],
            self._every, self._rows, LARGEST_DEFLECTION, out, status, when,
        ))  # fmt: skip
        self._states[index], self._status[index], self._status_time[index] = states, status, when
        self._out[index] = out

    def _change(self, terminated: np.ndarray) -> None:
        """Let faults set in or grow. A fault whose time has come acts from the next period on; wear is booked once per
        cam turn, from the energy that the input joint transmitted."""
        running = self._changing & ~terminated & (self._n_steps > 0)
        self._periods[running] += 1
        turns = np.floor(self._cam_angles() / (2.0 * math.pi), where=running, out=self._turns.copy())
        for i in np.flatnonzero(running).tolist():
            start = self._starts[i]
            if start.course.backlash_per_joule > 0.0:
                self._work[i] += self._power(i) / self.task.sample_rate
            if turns[i] > self._turns[i]:
                self._booked[i] = self._work[i]
            faults = start.faults_at(self._age(i), float(self._booked[i]))
            if faults != self._applied[i]:
                self._apply(i, start, faults)
        self._turns = turns

    def _cam_angles(self) -> np.ndarray:
        """Cam angles (n,) of the present [rad]."""
        return self._states[:, CAM]

    def _power(self, i: int) -> float:
        """Power that the input joint of item i transmitted [W], summed over the period's samples."""
        return float(np.abs(self._out[i, TORQUE_1, 1:] * self._out[i, RATE, 1:]).sum())

    def _age(self, i: int) -> float:
        """Time in the episode of item i [s], the very float that a user writes for it."""
        return int(self._periods[i]) * self._samples / self.task.sample_rate

    def _apply(self, i: int, start: Start, faults: Faults) -> None:
        """Give item i the coefficients of these faults while it runs."""
        item = start.item(faults, self._step)
        kept = self._coefficients[i, _KEPT]
        self._coefficients[i] = item.row
        self._coefficients[i, _KEPT] = kept
        self._applied[i] = faults

    @property
    def observations(self) -> np.ndarray:
        """Observations (n, 7) float32 of the present, a new array."""
        return self._observations.copy()

    def channels(self, i: int) -> dict[str, np.ndarray]:
        """What a picture of item i needs, at the last period's samples (m,); the fleet must record the truth."""
        end = float(self._states[i, _TIME])
        ago = np.arange(self._samples - 1, -1, -1) / self.task.sample_rate
        return {"time": end - ago} | {name: self._out[i, place, 1:].copy() for name, place in _SCENE.items()}

    def machine(self, i: int) -> Machine:
        """The machine of item i with the faults that have set in; screws that wait to let go count as tight."""
        start, faults = self._starts[i], self._applied[i]
        if self._age(i) < start.course.loose_at:
            faults = dataclasses.replace(faults, screw_looseness=0.0)
        return faults.applied_to(start.machine)

    def operating_point(self, i: int) -> OperatingPoint:
        """The operating point of item i."""
        return self._starts[i].operating_point

    def truths(self) -> dict[str, np.ndarray]:
        """What no bench shows, of all items (n, …): the faults in force, and at the period's samples the table's
        acceleration [rad/s²] and the cam angle [rad] (n, m), torques [N m] and regions [-] of the three joints
        (n, 3, m)."""
        count = len(self)
        faults = [self._applied[i] for i in range(count)]
        return {
            "roller_crack": np.array([item.roller_crack for item in faults]),
            "screw_looseness": np.array([item.screw_looseness for item in faults]),
            "backlash": np.array([item.backlash for item in faults]),
            "table_acceleration": self._out[:, 0, 1:].copy(),
            "cam_angle": self._out[:, 1, 1:].copy(),
            "torques": self._out[:, TORQUES, 1:].copy(),
            "regions": self._out[:, REGIONS, 1:].copy(),
        }
