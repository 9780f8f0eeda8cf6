"""Machines under control on a GPU: `indexer_env.fleet` whose states, samples and observations stay there.

What an item starts with is worked out where its generator is, and goes to the device once; faults that grow are booked
there too. A control period visits the host in neither direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from indexer_env.control import ControlTask, Limits
from indexer_env.cuda.device import Buffer, Cuda, Series, rows_of_a_thread
from indexer_env.cuda.sensor_stream import StreamOnCuda
from indexer_env.engine import LARGEST_DEFLECTION
from indexer_env.faults import Faults
from indexer_env.fleet import CAM, RATE, REGIONS, TORQUE_1, TORQUES, Fleet, Period
from indexer_env.kernels import layout
from indexer_env.sensors import Sensor
from indexer_env.start import Start


class FleetOnCuda(Fleet):
    """n machines on one GPU; arguments and results as of `Fleet`, arrays as tensors of the device.

    Parameters
    ----------
    cuda : Cuda
    n, task, limits, sensor, truth
        As of `Fleet`.
    """

    def __init__(
        self, cuda: Cuda, n: int, task: ControlTask, limits: Limits, sensor: Sensor, *, truth: bool = False
    ) -> None:
        super().__init__(n, task, limits, sensor, truth=truth)
        self._cuda = cuda
        self.stream = StreamOnCuda(cuda, sensor, task.sample_rate, n)
        self._on: dict[str, Buffer] = {
            name: cuda.put(getattr(self, f"_{name}"))
            for name in (
                "states", "coefficients", "items", "n_steps", "steps", "no_steps", "status", "status_time", "shares",
                "cams", "observations", "features", "numbers", "out",
            )
        }  # fmt: skip
        self._on |= {
            "rows": cuda.put(rows_of_a_thread(self._rows)),
            "actions": cuda.zeros(n, task.actions),
            "readings": cuda.zeros(n, self._samples),
            "rewards": cuda.zeros(n),
            "terminated": cuda.zeros(n, dtype=torch.bool),
            "none": cuda.zeros(n, dtype=torch.int64),
            "models": cuda.zeros(n, dtype=torch.int64),
            "order": cuda.zeros(n, dtype=torch.int64),
        }
        self._series = Series(cuda, self.stream.generator)
        self._reapplied: list[int] = []
        self._alike = np.zeros(0, dtype=np.int64)
        self._powers, self._angles = np.zeros(n), np.zeros(n)

    def _views(self, *names: str) -> list[Any]:
        return [self._on[name].view for name in names]

    def _upload(self, where: np.ndarray, *names: str) -> None:
        """Write rows `where` (k,) of host arrays to the device."""
        index = self._cuda.index_of(where)
        for name in names:
            rows = torch.from_numpy(np.ascontiguousarray(getattr(self, f"_{name}")[where]))
            self._on[name].tensor[index] = rows.to(self._cuda.place)

    def _arrange(self, where: np.ndarray) -> None:
        laid, rows = self._laid, self._rows
        super()._arrange(where)
        if self._laid is not laid:
            self._on["pieces"] = self._cuda.put(self._pieces)
            where = np.flatnonzero(self._started)
        if self._rows is not rows:
            self._on["rows"] = self._cuda.put(rows_of_a_thread(self._rows))
            self._on["out"] = self._cuda.put(self._out)
        if self._laid is not laid or self._rows is not rows:
            self._series = Series(self._cuda, self.stream.generator)
        self._upload(where, "coefficients", "features")
        alike = self._features + (self._kinds << 32)
        if not np.array_equal(alike, self._alike):
            self._alike = alike
            self._on["models"].tensor.copy_(torch.from_numpy(self._kinds // 2))
            self._on["order"].tensor.copy_(torch.from_numpy(np.argsort(alike, kind="stable")))

    def _first_readings(self, where: np.ndarray, rngs: Sequence[np.random.Generator]) -> Any:
        self._status[where] = layout.RUNNING
        self._upload(where, "states", "items", "shares", "n_steps", "status")
        index, chosen = self._cuda.index_of(where), self._cuda.put(where)
        self._advance(chosen, "none")
        out = self._on["out"].tensor
        accelerations = out[index, 0, 0]
        out[index] = out[index][:, :, :1].expand(-1, -1, self._samples + 1)
        self.stream.start(index, accelerations)
        first = self.stream.read(index, accelerations[:, None])
        self._on["readings"].tensor[index] = first.expand(-1, self._samples)
        self._cuda.launch(
            "look", len(where), chosen.view,
            *self._views("readings", "states", "coefficients", "items", "numbers", "observations"),
        )  # fmt: skip
        self._turns[where] = np.floor(self._states[where, CAM] / layout.TWO_PI)
        return self._on["readings"].tensor[index]

    def _advance(self, order: Buffer, n_steps: str) -> None:
        self._cuda.launch(
            "advance", len(order.tensor), order.view,
            *self._views("models", "features", "states", "coefficients", "pieces", n_steps, "steps", "no_steps"),
            self._every, *self._views("rows"), LARGEST_DEFLECTION, *self._views("out", "status", "status_time"),
        )  # fmt: skip

    def seed_noise(self, seed: int) -> None:
        """Start the device's generator anew."""
        self.stream.seed(seed)

    def step(self, actions: Any, live: np.ndarray | None, rngs: Sequence[np.random.Generator]) -> Period:
        """As `Fleet.step`, with actions (n, k) of the device; readings are made of all items."""
        on = self._on
        on["actions"].tensor.copy_(actions)
        self._series.run(self._period)
        if self._any_changing:
            self._book()
        fresh: list[Any] = [on[name].tensor.clone() for name in ("rewards", "terminated", "readings")]
        return Period(self.observations, *fresh)

    def _period(self) -> None:
        """A control period on the present arrays, from `actions` to `rewards`, `terminated` and `observations`."""
        order, on = self._on["order"], self._on
        self._cuda.launch(
            "begin", len(self), order.view,
            *self._views("actions", "states", "coefficients", "items", "numbers", "shares", "cams", "status"),
        )  # fmt: skip
        self._advance(order, "n_steps")
        if not self.stream.plain:
            on["readings"].tensor.copy_(self.stream.read(slice(None), on["out"].tensor[:, 0, 1:]))
        self._cuda.launch(
            "end", len(self), order.view,
            *self._views(
                "out", "readings", "states", "coefficients", "items", "numbers", "cams", "status", "n_steps",
                "observations", "rewards", "terminated",
            ),
        )  # fmt: skip

    def _book(self) -> None:
        """Let faults set in or grow, from angles and work that come from the device as one number a machine."""
        out = self._on["out"].tensor
        self._angles = self._on["states"].tensor[:, CAM].cpu().numpy()
        if self._wearing.any():
            powers = (out[:, TORQUE_1, 1:] * out[:, RATE, 1:]).abs().sum(dim=1)
            self._powers = powers.cpu().numpy()
        terminated = self._on["terminated"].tensor.cpu().numpy()
        self._n_steps[terminated] = 0
        self._reapplied = []
        self._change(terminated)
        if self._reapplied:
            self._upload(np.array(self._reapplied), "coefficients")

    def _cam_angles(self) -> np.ndarray:
        return self._angles

    def _power(self, i: int) -> float:
        return float(self._powers[i])

    def _apply(self, i: int, start: Start, faults: Faults) -> None:
        super()._apply(i, start, faults)
        self._reapplied.append(i)

    @property
    def observations(self) -> Any:
        """Observations (n, 7) float32 of the present, a new tensor, row by row."""
        return self._on["observations"].tensor.clone(memory_format=torch.contiguous_format)

    def truths(self) -> dict[str, Any]:
        """As `Fleet.truths`, as tensors of the device."""
        out, put = self._on["out"].tensor, self._cuda.put
        known = {
            name: put(np.array([getattr(faults, name) for faults in self._applied])).tensor
            for name in ("roller_crack", "screw_looseness", "backlash")
        }
        return known | {
            "table_acceleration": out[:, 0, 1:].clone(), "cam_angle": out[:, 1, 1:].clone(),
            "torques": out[:, TORQUES, 1:].clone(), "regions": out[:, REGIONS, 1:].clone(),
        }  # fmt: skip
