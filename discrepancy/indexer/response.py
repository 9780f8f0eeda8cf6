"""What torques at the joints would add to the table's acceleration: the machine linearised along a simulated motion.

With small changes dα of the cam, dφ of the table and dθ of the housing, the joints' present stiffnesses and dampings,
and torques u_t that brake the table, u_2 in joint 2, u_1 on the cam, u_3 on the housing,

    dM1 = -k1 dα - r1 dα̇,    dM3 = k3 dθ + r3 dθ̇
    dM2 = k2 (dφ - β' dα - dθ) + r2 (dφ̇ - β' dα̇ - β'' α̇ dα - dθ̇)
    J_t dφ̈ = -dM2 - u_2 - u_t
    (J_C + J_F β'²) dα̈ + J_F β' dθ̈ = dM1 + β' (dM2 + u_2) + u_1 - 2 J_F β' β'' α̇ dα̇
                          + (β'' (M2 - J_F (β'' α̇² + 2 β' α̈ + θ̈)) - J_F β' β''' α̇²) dα
    J_F β' dα̈ + (J_F + J_b) dθ̈ = dM2 + u_2 - dM3 + u_3 - 2 J_F β'' α̇ dα̇ - J_F (β'' α̈ + β''' α̇²) dα

(θ is 0 where the base is tight), advanced from sample to sample by the exponential of their matrix in the middle, as
its Padé approximant of order 2, 2: the midpoint rule, of order 1, 1, would shift what rings by a radian in ten periods.
Backwards, the same recursion gives what each moment's torque adds to the product of the readings with any row, of which
searches over many torques are made.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discrepancy.indexer.model import IndexerModel
from discrepancy.jobs import Jobs
from discrepancy.place import Point
from indexer_env.kernels import layout
from indexer_env.machine import Machine

ROWS = {
    "cam": layout.CAM, "cam_rate": layout.CAM_RATE, "cam_acc": layout.CAM_ACC,
    "table": layout.TABLE, "table_rate": layout.TABLE_RATE, "table_acc": layout.TABLE_ACC,
    "rate_2": layout.DEFLECTION_RATE_2, "torque_1": layout.TORQUE_1, "torque_2": layout.TORQUE_2,
    "k1": layout.LINE_K_1, "r1": layout.LINE_R_1, "k2": layout.LINE_K_2, "r2": layout.LINE_R_2,
}  # fmt: skip
"""What is known of the motion, by name."""

ROWS_ON_BASE = {"housing_acc": layout.HOUSING_ACC, "k3": layout.LINE_K_3, "r3": layout.LINE_R_3}
"""The same on a loose base."""

JOINTS = ("table", "joint 2", "cam", "housing")
"""Where a torque may act; on a tight base the housing moves by none."""

_NEAR = 1e-4
"""rad; step of the difference that gives β'''."""


def motion_of(model: IndexerModel, place: Point) -> tuple[Machine, dict[str, np.ndarray]]:
    """The machine of a place and its motion, a row (w, n) for each name of ROWS and, on a loose base, of ROWS_ON_BASE;
    NaN in a window that failed."""
    windows = np.arange(len(model.counts))
    jobs = Jobs.at(place.z, windows, place.states)
    machine = model.machine_at(place.hypothesis, place.z)[0]
    item = model.coefficients_at(place.hypothesis, place.z)
    rows = ROWS | (ROWS_ON_BASE if item.model == layout.MODEL_B_ON_BASE else {})
    found = model.simulated(jobs, [item], tuple(rows.values()))
    return machine, {name: found[:, k] for k, name in enumerate(rows)}


class Response:
    """The linearised machine.

    Parameters
    ----------
    machine : Machine
    motion : mapping of str to ndarray (w, n)
        As of `motion_of`, 0 beyond a window's end.
    inside : ndarray (w, n) of bool
    step : ndarray (w,)
        Time between samples [s].
    table : ndarray (w,)
        Inertia of the table in each window [kg m²].
    """

    def __init__(
        self, machine: Machine, motion: Mapping[str, np.ndarray], inside: np.ndarray, step: np.ndarray,
        table: np.ndarray,
    ) -> None:  # fmt: skip
        cam, rate, acc = motion["cam"], motion["cam_rate"], motion["cam_acc"]

        def curvature(angle: np.ndarray) -> np.ndarray:
            return machine.motion_law.evaluate(angle, machine.stations, machine.motion_share)[2]

        _, b1, b2 = machine.motion_law.evaluate(cam, machine.stations, machine.motion_share)
        b3 = (curvature(cam + _NEAR) - curvature(cam - _NEAR)) / (2.0 * _NEAR)
        turret = machine.follower_inertia
        none = np.zeros_like(cam)
        loose = "k3" in motion
        shaken, k3, r3 = (motion[name] for name in ROWS_ON_BASE) if loose else (none, none, none)
        # states dα, dα̇, dφ, dφ̇, dθ, dθ̇
        k2, r2 = motion["k2"], motion["r2"]
        torque_1 = np.stack([-motion["k1"], -motion["r1"], none, none, none, none], -1)
        torque_2 = np.stack([-k2 * b1 - r2 * b2 * rate, -r2 * b1, k2, r2, -k2, -r2], -1)
        by_cam = torque_1 + b1[..., None] * torque_2
        by_cam[..., 0] += b2 * (motion["torque_2"] - turret * (b2 * rate**2 + 2.0 * b1 * acc + shaken))
        by_cam[..., 0] -= turret * b1 * b3 * rate**2
        by_cam[..., 1] -= 2.0 * turret * b1 * b2 * rate
        by_housing = torque_2 - np.stack([none, none, none, none, k3, r3], -1)
        by_housing[..., 0] -= turret * (b2 * acc + b3 * rate**2)
        by_housing[..., 1] -= 2.0 * turret * b2 * rate
        # accelerations of cam and housing by generalised forces on them
        of_cam, between = machine.cam_inertia + turret * b1**2, turret * b1 if loose else none
        of_housing = none + (turret + machine.housing_inertia)
        determinant = of_cam * of_housing - between**2
        cam_by, mixed, housing_by = (x / determinant for x in (of_housing, -between, of_cam))
        if not loose:
            housing_by = none
        size = 6 if loose else 4
        slope = np.zeros((*cam.shape, size, size))
        slope[..., 0, 1] = slope[..., 2, 3] = 1.0
        slope[..., 1, :] = (cam_by[..., None] * by_cam + mixed[..., None] * by_housing)[..., :size]
        slope[..., 3, :] = (-torque_2 / table[:, None, None])[..., :size]
        if loose:
            slope[..., 4, 5] = 1.0
            slope[..., 5, :] = mixed[..., None] * by_cam + housing_by[..., None] * by_housing
        middle = 0.5 * (slope[:, 1:] + slope[:, :-1])
        middle[~inside[:, 1:]] = 0.0
        x = step[:, None, None, None] * middle
        even = np.eye(size) + x @ x / 12.0
        ahead = np.linalg.inv(even - 0.5 * x)
        self._through, self._in = ahead @ (even + 0.5 * x), 0.5 * step[:, None, None, None] * ahead
        self._out = slope[..., 3, :]
        falls = none - 1.0 / table[:, None]
        enters = {
            "table": (none, falls, none),
            "joint 2": (b1 * cam_by + mixed, falls, b1 * mixed + housing_by),
            "cam": (cam_by, none, mixed),
            "housing": (mixed, none, housing_by),
        }
        self._enters = {
            joint: np.stack([none, cam, none, table, none, housing], -1)[..., :size]
            for joint, (cam, table, housing) in enters.items()
        }

    def __call__(self, torque: np.ndarray, joint: str) -> np.ndarray:
        """Accelerations (w, n, k) that torques (w, n, k) at one of JOINTS add."""
        enters = self._enters[joint]
        n, out = torque.shape[1], np.empty_like(torque)
        state = np.zeros((len(torque), enters.shape[2], torque.shape[2]))
        push = enters[:, 0, :, None] * torque[:, 0, None, :]
        for k in range(n):
            out[:, k] = (self._out[:, k, None, :] @ state)[:, 0] + push[:, 3]
            if k + 1 < n:
                following = enters[:, k + 1, :, None] * torque[:, k + 1, None, :]
                state = self._through[:, k] @ state + self._in[:, k] @ (push + following)
                push = following
        return out

    def backwards(self, row: np.ndarray, joint: str) -> np.ndarray:
        """z (w, n) for which Σ z u is the product of a row (w, n) with the accelerations that torques u (w, n) add."""
        n, size = row.shape[1], self._out.shape[2]
        pulls, ahead = np.zeros((*row.shape, size)), np.zeros((len(row), size))
        for k in range(n - 1, -1, -1):
            pulls[:, k, 3] += row[:, k]
            if k + 1 < n:
                pull = (ahead[:, None] @ self._in[:, k])[:, 0]
                pulls[:, k] += pull
                pulls[:, k + 1] += pull
                ahead = (ahead[:, None] @ self._through[:, k])[:, 0]
            ahead = ahead + self._out[:, k] * row[:, k, None]
        return (pulls * self._enters[joint]).sum(axis=2)
