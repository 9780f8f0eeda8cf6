"""Turn after turn: items are run until each record is free of the start's transient, or a bound is reached."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from indexer_env.coefficients import Coefficients, Pack, pack
from indexer_env.engine import LARGEST_DEFLECTION, advance
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.trajectory import Batch

if TYPE_CHECKING:
    from indexer_env.cuda.turns import OnCuda

Sink = Callable[[np.ndarray, dict[str, Any]], None]
"""Takes the numbers of finished items (k,) and their channels (k, n_samples), tensors where a GPU ran them."""

_ROWS = {
    "cam_angle": layout.CAM, "cam_rate": layout.CAM_RATE, "table_angle": layout.TABLE, "table_rate": layout.TABLE_RATE,
    "housing_angle": layout.HOUSING, "housing_rate": layout.HOUSING_RATE,
    "motor_angle": layout.MOTOR, "motor_rate": layout.MOTOR_RATE,
    "cam_acceleration": layout.CAM_ACC, "table_acceleration": layout.TABLE_ACC,
    "housing_acceleration": layout.HOUSING_ACC, "motor_acceleration": layout.MOTOR_ACC,
    "deflection_1": layout.DEFLECTION_1, "deflection_2": layout.DEFLECTION_2, "deflection_3": layout.DEFLECTION_3,
    "deflection_rate_1": layout.DEFLECTION_RATE_1, "deflection_rate_2": layout.DEFLECTION_RATE_2,
    "deflection_rate_3": layout.DEFLECTION_RATE_3,
    "torque_1": layout.TORQUE_1, "torque_2": layout.TORQUE_2, "torque_3": layout.TORQUE_3,
    "region_1": layout.REGION_1, "region_2": layout.REGION_2, "region_3": layout.REGION_3,
}  # fmt: skip

_CAM, _CAM_RATE, _TIME = (layout.STATE_NAMES.index(name) for name in ("cam_angle", "cam_rate", "time"))

_APPROACHES, _NEAR_TURN_END, _AT_TURN_END = 40, 1e-3, 1e-9
"""Runs towards the end of a turn of unknown length; rad left from where the present rate is trusted; rad accepted."""

_SHARE_OF_TURN = 0.99
"""Share of the last turn's time after which the end of the next is approached; all that is compared lies before it."""

LEAST_SPEED = 0.2
"""Share of the commanded speed below which a slipping motor counts as stalled."""

LEAST_COMPARED = 16
"""Samples of a cam turn below which two turns are not compared: too few to show a difference."""


class OnCores:
    """Runs packs on the thread that calls it."""

    def empty(self, items: int, samples: int) -> np.ndarray:
        """Room for one channel of a batch (items, samples)."""
        return np.empty((items, samples))

    def index(self, which: np.ndarray) -> slice | np.ndarray:
        """How items are indexed: a mask (n,), all of which takes no copy, or numbers (k,)."""
        return slice(None) if which.dtype == bool and which.all() else which

    def advance(
        self, pack: Pack, features: np.ndarray, n_steps: np.ndarray, steps: np.ndarray, last_steps: np.ndarray,
        **recorded: Any,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """`engine.advance`; an item's own features (n,) are not asked for, as those of the pack give the same bits."""
        return advance(pack, n_steps, steps, last_steps, **recorded)

    def differences(
        self, previous: np.ndarray, present: np.ndarray, lengths: np.ndarray, cam_turn: np.ndarray, least: int
    ) -> np.ndarray:
        """Relative rms difference (n,) of two turns' records (n, samples) over the last cam turn that both reach; NaN
        where they do not reach one or it has fewer than `least` samples. Where it agrees, so does all that follows, and
        the later turn is free of the start's transient from its first sample.
        """
        difference = np.full(len(lengths), np.nan)
        firsts = lengths - cam_turn
        decided = (cam_turn >= least) & (firsts >= 0)
        # items of one window together; its width alone sets the order in which numpy adds, so their company does not
        # count
        for first, end in sorted(set(zip(firsts[decided].tolist(), lengths[decided].tolist(), strict=True))):
            chosen = self.index(decided & (firsts == first) & (lengths == end))
            now = present[chosen, first:end]
            change, size = _sum_of_squares(now - previous[chosen, first:end]), _sum_of_squares(now)
            difference[chosen] = np.sqrt(change / np.maximum(size, np.finfo(float).tiny))
        return difference


class TurnGroup:
    """Items of one model, run turn after turn until their records are settled or the bound is reached."""

    def __init__(
        self,
        members: Sequence[tuple[int, Coefficients]],
        steps_per_sample: int,
        machines: Sequence[Machine],
        points: Sequence[OperatingPoint],
        run: Run,
        samples: int,
        sink: Sink | None = None,
        runner: OnCores | OnCuda | None = None,
    ) -> None:
        self.machines, self.run, self.samples, self.sink = machines, run, samples, sink
        self.runner: Any = runner or OnCores()
        self.features = np.array([item.features for _, item in members], dtype=np.int64)
        self.items = np.array([index for index, _ in members])
        self.durations = np.array([machines[index].turn_duration(points[index]) for index in self.items])
        self.pack = pack([item for _, item in members], [points[index] for index in self.items])
        self.stations = np.array([machines[index].stations for index in self.items])
        self.commanded = 2.0 * math.pi * self.stations / self.durations
        self.start_angles = np.array([points[index].start_angle for index in self.items])
        self.difference = np.full(len(self.items), np.nan)
        self.every = steps_per_sample
        self.step = 1.0 / (run.sample_rate * steps_per_sample)
        self.names = tuple(dict.fromkeys((*run.channels, "table_acceleration")))
        self.judge = self.names.index("table_acceleration")

    def run_into(self, batch: Batch) -> None:
        """Fill the batch's rows of these items, or hand their channels to the sink."""
        previous: Any = None
        previous_lengths = np.zeros(0, dtype=np.int64)
        for turn in range(self.run.warmup_turns + 1):
            last = turn == self.run.warmup_turns
            start = self.pack.states.copy()
            out, sound, lengths = self._turn(batch, whole=not last)
            if previous is not None:
                common = np.minimum(lengths, previous_lengths)
                cam_turn = self._turn_samples() // self.stations
                change = self.runner.differences(previous, out[:, self.judge], common, cam_turn, LEAST_COMPARED)
                self.difference = np.where(np.isnan(change), self.difference, change)
            settled = self.difference <= self.run.warmup_tolerance
            done = sound & (settled | last)
            record = out
            if not last and done.any() and self.samples > lengths[done].min():
                record, fine = self._longer(batch, done, start.copy())
                sound &= fine | ~done
                done &= fine
            if done.any():
                self._record(batch, turn, done, settled, record)
            going = sound & ~done
            if not going.any():
                return
            # a copy is as long as the record, so it is only made where items are left out
            previous, previous_lengths = out[self.runner.index(going), self.judge], lengths[going]
            self._keep(going)
            if self.pack.features & layout.USES_SLIP:
                kept = self._run_to_turn_end(batch, start[going])
                previous, previous_lengths = previous[self.runner.index(kept)], previous_lengths[kept]
                if not len(self.items):
                    return

    def _record(self, batch: Batch, turn: int, done: np.ndarray, settled: np.ndarray, record: Any) -> None:
        """Write the finished items and how they were warmed up into the batch."""
        items, chosen = self.items[done], self.runner.index(done)
        own = {name: record[chosen, self.names.index(name), : self.samples] for name in self.run.channels}
        if self.sink is not None:
            self.sink(items, own)
        else:
            places = self.runner.index(items)
            for name, values in own.items():
                batch.channels[name][places] = values
        batch.warmup_turns[items] = turn
        batch.settled[items] = settled[done]
        batch.warmup_difference[items] = self.difference[done]

    def _turn(self, batch: Batch, *, whole: bool) -> tuple[Any, np.ndarray, np.ndarray]:
        """Advance by one turn, or to the record's end; outputs (n, c, k), sound items (n,), samples of each (n,)."""
        n_steps = np.full(len(self.items), self.samples * self.every, dtype=np.int64)
        remainder = np.zeros(len(self.items))
        if whole:
            n_steps = np.floor(self.durations / self.step + 1e-9).astype(np.int64)
            remainder = np.maximum(self.durations - n_steps * self.step, 0.0)
        return (*self._advance(batch, self.items, self.pack, n_steps, remainder), n_steps // self.every)

    def _turn_samples(self) -> np.ndarray:
        """Whole sampling intervals in a turn of each item (n,)."""
        return np.floor(self.durations / self.step + 1e-9).astype(np.int64) // self.every

    def _longer(self, batch: Batch, done: np.ndarray, start: np.ndarray) -> tuple[Any, np.ndarray]:
        """Records longer than a turn, run in one piece from the start of the turn that settled; outputs (n, c, k) and
        sound items (n,), both only meant where `done`."""
        again = Pack(self.pack.model, self.pack.features, start, self.pack.coefficients, self.pack.pieces)
        n_steps = np.where(done, self.samples * self.every, 0)
        return self._advance(batch, self.items, again, n_steps, np.zeros(len(n_steps)))

    def _advance(
        self, batch: Batch, items: np.ndarray, packed: Pack, n_steps: np.ndarray, remainder: np.ndarray
    ) -> tuple[Any, np.ndarray]:
        """Run a pack; note the faulty items as rejected. Outputs (n, c, k) and sound items (n,)."""
        out, status, when = self.runner.advance(
            packed, self.features, n_steps, np.full(len(items), self.step), remainder,
            every=self.every, rows=np.array([_ROWS[name] for name in self.names]),
            samples=-(-int(n_steps.max()) // self.every),
        )  # fmt: skip
        for k in np.flatnonzero(status != layout.RUNNING):
            name = f"{self.machines[items[k]].name} (item {items[k]})"
            batch.rejected[int(items[k])] = _reason(name, int(status[k]), float(when[k]), packed.states[k])
        return out, status == layout.RUNNING

    def _run_to_turn_end(self, batch: Batch, start: np.ndarray) -> np.ndarray:
        """Run items with slipping motors, whose turns take longer than commanded, on to where their cam ends a turn,
        and set the durations of their next turns a little short of what this one took. Outputs the items kept (n,).
        """
        turn = 2.0 * math.pi * self.stations
        first = self.start_angles
        goal = first + turn * np.ceil((self.pack.states[:, _CAM] - first) / turn - 1e-9)
        kept = self._moving(batch, start)
        self._keep(kept)
        goal, start = goal[kept], start[kept]
        for _ in range(_APPROACHES):
            angle, rate = self.pack.states[:, _CAM], self.pack.states[:, _CAM_RATE]
            rest = goal - angle
            arrived = np.abs(rest) <= _AT_TURN_END
            if arrived.all():
                break
            mean = (angle - start[:, _CAM]) / (self.pack.states[:, _TIME] - start[:, _TIME])
            time = np.maximum(np.where(rest > _NEAR_TURN_END, 0.5 * rest / mean, rest / rate), 0.0)
            time[arrived] = 0.0  # an item's start must not depend on how long its neighbours take
            n_steps = np.floor(time / self.step).astype(np.int64)
            _, sound = self._advance(batch, self.items, self.pack, n_steps, time - n_steps * self.step)
            kept[np.flatnonzero(kept)[~sound]] = False
            self._keep(sound)
            goal, start = goal[sound], start[sound]
        self.durations = _SHARE_OF_TURN * (self.pack.states[:, _TIME] - start[:, _TIME])
        return kept

    def _moving(self, batch: Batch, start: np.ndarray) -> np.ndarray:
        """Items (n,) whose motor keeps up; one that stalls is rejected, as the end of its turn never comes."""
        travelled = self.pack.states[:, _CAM] - start[:, _CAM]
        share = travelled / (self.pack.states[:, _TIME] - start[:, _TIME]) / self.commanded
        moving = share >= LEAST_SPEED
        for k in np.flatnonzero(~moving):
            index = int(self.items[k])
            batch.rejected[index] = (
                f"{self.machines[index].name} (item {index}) stalls: under its load the motor turns at {share[k]:.0%} "
                f"of the commanded speed, less than {LEAST_SPEED:.0%}; lower the load or drive.slip's compliance."
            )
        return moving

    def _keep(self, going: np.ndarray) -> None:
        self.items, self.durations, self.difference = (
            self.items[going],
            self.durations[going],
            self.difference[going],
        )
        self.stations, self.start_angles = self.stations[going], self.start_angles[going]
        self.commanded, self.features = self.commanded[going], self.features[going]
        self.pack.states = self.pack.states[going].copy()
        self.pack.coefficients = self.pack.coefficients[going].copy()


def _sum_of_squares(rows: np.ndarray) -> np.ndarray:
    """Sum (n,) of each row's squares."""
    return np.square(rows).sum(axis=1)


def _reason(name: str, status: int, when: float, state: np.ndarray) -> str:
    what = "became non-finite" if status == layout.NOT_FINITE else f"deflected a joint beyond {LARGEST_DEFLECTION} rad"
    values = ", ".join(f"{key} {value:.4g}" for key, value in zip(layout.STATE_NAMES[:8], state, strict=False))
    return f"{name} {what} at t = {when:.4g} s ({values})."
