"""Start states of windows, from a few numbers each: deflection and rate of the input and of the output joint, and the
housing's on a loose base."""

from __future__ import annotations

import math

import numpy as np

from discrepancy.model import Parameter
from indexer_env.coefficients import PLACES, Coefficients
from indexer_env.kernels import layout

LOCAL = (
    Parameter("deflection_1", "rad", 0.0, 1e-4),
    Parameter("deflection_rate_1", "rad/s", 0.0, 1e-2),
    Parameter("deflection_2", "rad", 0.0, 1e-5),
    Parameter("deflection_rate_2", "rad/s", 0.0, 1e-3),
    Parameter("housing_angle", "rad", 0.0, 1e-6),
    Parameter("housing_rate", "rad/s", 0.0, 1e-4),
)
"""δ1, δ̇1; δ2 beyond where the load holds the table at rest, δ̇2; θ and θ̇, on a loose base alone."""

_C = PLACES.__getitem__
_S = {name: place for place, name in enumerate(layout.STATE_NAMES)}.__getitem__
_SCALES = np.array([p.scale for p in LOCAL])

_BY_KERNEL = -2.0
"""Region below -1, for which the kernel finds those of all joints by the deflections that it sees."""

_LITTLE = 2e-3
"""Play of the input joint [rad] below which a coarser grid does."""

_POINTS_LITTLE, _POINTS, _MOST = 5, 13, 37
"""Points along each side of the grid: with little play, with more, and where the drive is shaken, at most."""

_RATE, _REACH = 0.15, 0.58
"""Largest rate of a cam that rattles, in ω g, and its largest deflection, in g: the play's edges are at 0.5."""

_BY_FLANK, _BY_MESH = 2.5, 0.9
"""What a shaken flank adds to that rate, in its own rate, and a mesh that varies, in its depth times ω g."""


def start_states(
    rows: np.ndarray, drive: np.ndarray, rate: np.ndarray, turn: np.ndarray, local: np.ndarray
) -> np.ndarray:
    """States (n, STATE_ROWS) as the kernel takes them.

    Parameters
    ----------
    rows : ndarray (n, COEFFICIENT_ROWS)
    drive, rate : ndarray (n,)
        Drive side τγ [rad] and its rate [rad/s]; the motor's command is its rate.
    turn : ndarray (n,)
        Cam turn whose index follows.
    local : ndarray (n, 4) or (n, 6)
        Scaled values of LOCAL, without those of the housing where it is fixed.
    """
    values = np.zeros((len(rows), len(LOCAL)))
    values[:, : local.shape[1]] = local * _SCALES[: local.shape[1]]
    d1, v1, d2, v2, housing, housing_rate = values.T
    column = rows.T
    motor, motor_rate = drive / column[_C("reduction")], rate / column[_C("reduction")]
    extra, extra_rate = _harmonics(column, motor, motor_rate)
    following = np.mod(turn, column[_C("stations")]) == column[_C("spacing_station")]
    rest = turn * column[_C("advance")] + np.where(following, column[_C("spacing_error")], 0.0)
    d2 = d2 + _resting_deflection(column, rest)
    states = np.zeros((len(rows), layout.STATE_ROWS))
    states[:, _S("motor_angle")], states[:, _S("motor_rate")] = motor, motor_rate
    states[:, _S("motor_command")] = motor_rate
    states[:, _S("cam_angle")] = drive + extra - d1
    states[:, _S("cam_rate")] = rate + extra_rate - v1
    states[:, _S("table_angle")] = rest + d2 + housing
    states[:, _S("table_rate")] = v2 + housing_rate
    states[:, _S("housing_angle")], states[:, _S("housing_rate")] = housing, housing_rate
    states[:, _S("region_1")], states[:, _S("piece")] = _BY_KERNEL, -1.0
    return states


def _resting_deflection(column: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Deflection δ2 (n,) [rad] at which load and imbalance hold the table, at rest at `angle` (n,) [rad], against a
    flank; column (rows, n)."""
    load = column[_C("load_torque")]
    load = load + column[_C("imbalance_torque")] * np.sin(angle + column[_C("imbalance_phase")])
    play = np.maximum(column[_C("edge_2")], 0.0)
    return -load / column[_C("stiffness_2")] - np.sign(load) * play


def _harmonics(column: np.ndarray, motor: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What ripple and transmission error add to the drive side (n,) [rad] and to its rate [rad/s]."""
    angle, speed = np.zeros_like(motor), np.zeros_like(motor)
    for name in ("ripple", "transmission"):
        amplitude, order, phase = (column[_C(f"{name}_{part}")] for part in ("amplitude", "order", "phase"))
        if not amplitude.any():
            continue
        angle += amplitude * np.sin(order * motor + phase)
        speed += amplitude * order * rate * np.cos(order * motor + phase)
    return angle, speed


def play_grid(item: Coefficients, motor_speed: float, *, shaken: bool) -> np.ndarray:
    """Scaled (δ1, δ̇1) (c, 2) over what a cam that rattles in its play can have; no rows where it has none.

    A flank returns the cam with rates of the order of ω g, ω = √(k/J), g the play (measured on the reference machine:
    up to 0.12 of it, from 2′ to 20°), and it penetrates the flank by no more than a tenth of the play. A drive that
    shakes the flank, or a mesh whose stiffness does, adds to both: up to 0.4 ω g by a mesh that varies by 0.35, and up
    to 1.7 ω g by a transmission error whose own rate is 0.8 ω g.

    Parameters
    ----------
    item : Coefficients
    motor_speed : float
        rad/s.
    shaken : bool
        Whether what shakes the drive counts. With little play the cam hardly leaves the flank, which settles its state.
    """
    play = 2.0 * max(item["edge_1"], 0.0)
    if play == 0.0:
        return np.zeros((0, 2))
    frequency = math.sqrt(item["stiffness_1"] / item["cam_inertia"])
    points, added = _POINTS_LITTLE, 0.0
    if play >= _LITTLE:
        points = _POINTS
        if shaken:
            forced = sum(abs(item[f"{name}_amplitude"]) * item[f"{name}_order"] for name in ("ripple", "transmission"))
            added = _BY_FLANK * forced * motor_speed / (frequency * play) + _BY_MESH * abs(item["mesh_depth"])
    reach, rate = _REACH + added / 2.0, (_RATE + added) * frequency * play
    along, across = _odd(points * reach / _REACH), _odd(points * (1.0 + added / _RATE))
    deflections, rates = np.meshgrid(np.linspace(-reach, reach, along) * play, np.linspace(-rate, rate, across))
    return np.stack([deflections.ravel(), rates.ravel()], axis=1) / _SCALES[:2]


def _odd(points: float) -> int:
    """An odd number of points, so that one lies at 0, no more than `_MOST`."""
    return 2 * round((min(points, _MOST) - 1.0) / 2.0) + 1
